"""Corners of a motion between two samples, and errors that are the same everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Array
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.residuals.unresolved_acceleration import UNRESOLVED
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run

FINE = 1e-3
"""Interval of the motion, s."""
RAMP = 1.5
"""Acceleration of a ramp, m/s²."""


def motion() -> tuple[Array, Array, Array]:
    """Time, motor angle and acceleration of the cable: ramps of 0.2 s and constant speeds between,
    whose corners are at odd times."""
    time = np.arange(0.0, 80.0, FINE)
    within = np.mod(time * 0.973, 20.0)
    acceleration = np.zeros_like(time)
    for start, sign in ((1.31, 1.0), (8.53, -1.0), (11.11, -1.0), (18.33, 1.0)):
        acceleration[(within >= start) & (within < start + 0.2)] = sign * RAMP
    speed = np.cumsum(acceleration) * FINE
    speed -= speed.mean()
    wound = np.cumsum(speed) * FINE
    radius = float(np.hypot(0.06, 0.005 / (2 * np.pi)))
    return time, wound / radius * GROOVED.gearbox.ratio, acceleration


def diagnosed(interval: float, resolution: float) -> Diagnosis:
    """Two repeats of a weight of 30 kg on the cable, its cell with a noise, sampled at an interval.
    The repeats start at other times within a sample."""
    time, angle, acceleration = motion()
    runs = []
    for seed in range(2):
        random = np.random.default_rng(seed)
        at = np.arange(0.1, 79.5, interval) + 0.37 * seed * interval
        tension = 30.0 * (9.80665 + np.interp(at, time, acceleration))
        channels = {
            "motor_angle": Channel(np.interp(at, time, angle), "rad"),
            "tension": Channel(tension + resolution * random.standard_normal(len(at)), "N"),
        }
        runs.append(Run(f"run-{seed}", at - at[0], channels, {"load_mass": "30 kg"}))
    return diagnose(runs, GROOVED).diagnosis


@pytest.mark.parametrize(("interval", "noise", "found"), [(0.04, 0.5, True), (0.04, 20.0, False)])
def test_corners_between_samples_are_found(interval: float, noise: float, found: bool) -> None:
    findings = [f for f in diagnosed(interval, noise).sanity if f.code == UNRESOLVED]
    assert [f.channel for f in findings] == ["tension"] * found
    for finding in findings:
        assert 1 / 3 <= finding.value <= 1.0
        assert "40.0 ms between samples" in finding.text

"""Errors of simulated motions beside those of the prediction."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simulated_profiles import AXIS, INERTIA, profile_of, torque_run
from winchkit import forward
from winchkit.dynamics.comparison import simulated_errors, smoothed
from winchkit.report.simulated import simulated_text
from winchkit.runs import Channel

CONTROL = """
[control]
position_gain = "20 1/s"
velocity_gain = "5 N m s"
"""
NOISE = 1e-4


def test_open_loop_it_shows_nothing_once_the_initial_speed_errs_as_much(tmp_path: Path) -> None:
    """A true model errs by that speed alone, a wrong inertia by more, to the end."""
    true = profile_of(tmp_path, AXIS)
    run = forward(true, torque=torque_run(np.full(5000, 0.01)), initial_speed=0.0)
    random = np.random.default_rng(1)
    noisy = run["motor_angle"] + NOISE * random.standard_normal(len(run))
    channels = {**run.channels, "motor_angle": Channel(noisy, "rad")}
    channels.pop("motor_velocity")
    run = replace(run, channels=channels)
    (found,) = simulated_errors([run], true)
    assert found.driven_by == "torque"
    assert found.meaningful_until is not None
    assert 0.0 < found.meaningful_until < run.time[-1]
    assert "the comparison means nothing" in simulated_text([found])
    coarse = profile_of(tmp_path, AXIS.replace("0.5 kg m^2", "5 kg m^2"))
    (found,) = simulated_errors([run], coarse)
    assert found.meaningful_until is None
    lacking = 0.01 * run.time**2 / 2 * (1 / INERTIA - 1 / 5)
    assert found.rms == pytest.approx(np.sqrt(np.mean(lacking**2)), rel=0.05)


@pytest.mark.parametrize("noise", [1e-6, 1e-5, 1e-3])
def test_the_initial_speed_errs_as_much_as_is_stated(tmp_path: Path, noise: float) -> None:
    """The error of a true model is that of the initial speed, where differences are one-sided."""
    true = profile_of(tmp_path, AXIS, ("motor-viscous", 'viscosity = "0.2 N m s"'))
    time = np.arange(0, 4, 0.01)
    torque = 1.5 * np.sin(1.3 * time) + np.sin(3.1 * time + 1)
    run = forward(true, torque=torque_run(torque), initial_speed=0.3)
    random, errors = np.random.default_rng(2), []
    for _ in range(12):
        noisy = run["motor_angle"] + noise * random.standard_normal(len(run))
        measured = replace(run, channels={"motor_angle": Channel(noisy, "rad")})
        speed, std = smoothed(measured, true).initial_rate
        errors.append((speed - 0.3) / std)
    assert 0.4 < np.sqrt(np.mean(np.square(errors))) < 1.6
    channels = {"motor_angle": Channel(noisy, "rad"), "motor_torque": Channel(torque, "N m")}
    (found,) = simulated_errors([replace(run, channels=channels)], true)
    assert found.meaningful_until is not None


@pytest.mark.parametrize("rate", [100, 20])
def test_under_loops_the_reference_channel_is_followed(tmp_path: Path, rate: int) -> None:
    """And its torque, straight between the samples, makes the motion again."""
    profile = profile_of(tmp_path, AXIS + CONTROL)
    goal = torque_run(np.zeros(5 * rate), rate)
    path = 0.3 * np.sin(goal.time) ** 2
    goal = replace(goal, channels={"motor_angle": Channel(path, "rad")})
    run = forward(profile, reference=goal, initial_speed=0.0)
    followed = replace(run, channels={**run.channels, "reference_angle": Channel(path, "rad")})
    errors = {e.driven_by: e for e in simulated_errors([followed], profile)}
    assert set(errors) == {"torque", "reference"}
    assert errors["reference"].rms < 1e-4
    assert errors["torque"].rms < 0.06 / rate
    assert errors["reference"].meaningful_until is None

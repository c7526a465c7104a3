"""A joint that turns at one constant speed in each run, in one direction: gravity and dry friction.

The friction grows with the speed and saturates, by a formula outside the catalogue. With one
direction nothing distinguishes dry friction from an offset; presliding over a whole run is neither.
Angles and torques have five decimals, as in a file.
"""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

GRAVITY, DRY, GROWTH, INERTIA, NOISE = 39.0, 8.0, 1.0, 2.0, 0.3
"""N m; kg m²."""
SPEEDS = (1, 3, 10, 20, 40, 60)
"""°/s."""
STEP, SECONDS, RAMP = 0.015, 5.0, 0.15


def ladder(seed: int) -> list[Run]:
    random, runs = np.random.default_rng(seed), []
    for degrees in SPEEDS:
        time = np.arange(0.01, SECONDS, STEP)
        speed = np.deg2rad(degrees) * (1 - np.exp(-time / RAMP))
        angle = np.cumsum(speed) * STEP
        torque = GRAVITY * np.sin(angle + 0.07) + DRY + GROWTH * (1 - np.exp(-speed / 0.25))
        torque += INERTIA * np.gradient(speed, time) + random.normal(0.0, NOISE, time.size)
        shown = np.round(np.rad2deg(angle) + random.normal(0.0, 0.001, time.size), 5)
        channels = {
            "motor_angle": Channel(np.deg2rad(shown), "rad"),
            "motor_torque": Channel(np.round(torque, 5), "N m"),
        }
        runs.append(Run(f"at-{degrees:02d}", np.round(time, 5), channels, {}))
    return runs


def test_a_distance_that_is_not_determined_is_no_presliding() -> None:
    steps = diagnose(ladder(7), AxisProfile(name="joint")).diagnosis.steps
    (weight,) = [step for step in steps if step.effects[0] == "joint-gravity"]
    assert weight.parameters["joint-gravity"]["amplitude"].value == pytest.approx(39.0, rel=0.02)
    (friction,) = [step for step in steps if "motor-coulomb" in step.effects]
    assert friction.effects[0] != "motor-dahl"

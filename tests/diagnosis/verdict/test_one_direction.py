"""One effect that imitates two: a run of one direction, in which friction is an offset.

A joint with gravity and Coulomb friction turns once from one end to the other at one speed. Its
torque is nearly linear in the angle, as of a spring with an offset. Where every file has one of the
two directions, friction is an offset of each file.
"""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

JOINT = AxisProfile(name="joint")
RATE = 200.0
SECONDS = 5.0
REACH = 1.05
"""Angle at the ends, rad."""
GRAVITY, FRICTION, NOISE = -2.2, 1.75, (0.1, 0.03)
"""N m; noise of a first-order process of 0.1 s, and white noise."""


def joint(seed: int, *, back: bool) -> Diagnosis:
    """Diagnosis of a move from end to end, or there and back."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, 1 / RATE)
    speed = np.clip(np.minimum(time, SECONDS - time) / 0.5, 0.0, 1.0)
    if back:
        time, speed = np.arange(0.0, 2 * SECONDS, 1 / RATE), np.concatenate([speed, -speed])
    angle = np.cumsum(speed) / RATE
    angle = 2 * REACH * angle / angle.max() - REACH
    speed = np.gradient(angle, time)
    torque = GRAVITY * np.sin(angle) + FRICTION * np.tanh(speed / 0.01)
    state, coloured = 0.0, np.empty(len(time))
    for index, step in enumerate(random.standard_normal(len(time))):
        state = 0.95 * state + 0.25 * step
        coloured[index] = state
    torque += NOISE[0] * coloured + NOISE[1] * random.standard_normal(len(time))
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return diagnose([Run("move", time, channels, {})], JOINT).diagnosis


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_in_one_direction_nothing_but_gravity_may_be_certain(seed: int) -> None:
    found = joint(seed, back=False)
    names = [effect for step in found.steps for effect in step.effects]
    assert "joint-gravity" in names
    assert {step.effects[0] for step in found.steps if step.certain} <= {"joint-gravity"}


def test_back_again_gravity_and_friction_are_named() -> None:
    found = joint(3, back=True)
    names = {step.effects[0] for step in found.steps}
    assert "joint-gravity" in names
    assert "spring-balancer" not in names
    assert any(name.startswith("motor-") for name in names)


def test_files_of_one_direction_each_show_friction_and_no_offset() -> None:
    """Three files up and three down: their offsets follow the direction, as only friction does."""
    random, time = np.random.default_rng(5), np.arange(0.0, 20.0, 0.02)
    runs = []
    for number, speed in enumerate((3.0, 5.0, 8.0, -3.0, -5.0, -8.0)):
        angle = speed * (time + 0.03 * np.sin(0.7 * time))
        torque = 0.030 * np.sign(speed) + 0.006 * random.standard_normal(len(time))
        channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
        runs.append(Run(f"file {number}", time, channels, {}))
    found = diagnose(runs, JOINT).diagnosis
    assert found.verdict == "explained"
    (step,) = found.steps
    assert step.effects[0] == "motor-coulomb"
    assert step.parameters["motor-coulomb"]["torque"].value == pytest.approx(0.030, abs=0.001)

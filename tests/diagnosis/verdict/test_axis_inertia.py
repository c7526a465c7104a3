"""The inertia of an axis is that of the arm it moves, not of a rotor.

A joint with gravity, viscous friction and the inertia of an arm, in its torque and angle, moves by
harmonics whose amplitudes are closed forms, without repeats.
"""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, term
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Estimate
from winchkit.diagnosis.verdict.plausibility import implausible
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

JOINT = AxisProfile(name="joint")
INERTIA, GRAVITY, VISCOUS = 18.0, 100.0, 17.0
RATE, SECONDS = 100.0, 60.0
HARMONICS = ((0.3, 0.13, 0.0), (0.2, 0.37, 1.0), (0.06, 0.83, 2.0))
"""Amplitude, rad; frequency, Hz; phase, rad."""


def arm(seed: int) -> Run:
    random = np.random.default_rng(seed)
    time = np.arange(0.0, SECONDS, 1 / RATE)
    angle, speed, acceleration = np.full(len(time), -1.2), np.zeros(len(time)), np.zeros(len(time))
    for amplitude, frequency, phase in HARMONICS:
        omega = 2 * np.pi * frequency
        at = omega * time + phase
        angle += amplitude * np.sin(at)
        speed += amplitude * omega * np.cos(at)
        acceleration -= amplitude * omega**2 * np.sin(at)
    torque = INERTIA * acceleration + GRAVITY * np.cos(angle) + VISCOUS * speed
    torque += random.standard_normal(len(time))
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return Run("arm", time, channels, {})


def inertia(value: float, profile: object) -> str | None:
    values = {"inertia": Estimate(value, 0.1, "kg m^2", (value - 0.2, value + 0.2))}
    return implausible(term("rotor-inertia", inertia=value), values, profile)  # type: ignore[arg-type]


def test_the_range_of_rotors_is_one_of_winches() -> None:
    assert inertia(95.0, JOINT) is None
    assert "rotors of motors" in (inertia(95.0, GROOVED) or "")


@pytest.mark.parametrize("seed", [0, 1])
def test_an_arm_is_explained_by_gravity_inertia_and_friction(seed: int) -> None:
    found = diagnose([arm(seed)], JOINT).diagnosis
    assert found.verdict == "explained"
    values = {step.effects[0]: step.parameters[step.effects[0]] for step in found.steps}
    moved = values["rotor-inertia"]["inertia"]
    assert moved.value == pytest.approx(INERTIA, abs=4 * moved.std)
    assert values["joint-gravity"]["amplitude"].value == pytest.approx(GRAVITY, rel=0.02)
    assert values["motor-viscous"]["viscosity"].value == pytest.approx(VISCOUS, rel=0.05)

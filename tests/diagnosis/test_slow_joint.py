"""Dry and viscous friction of a joint that turns slowly are distinguished, with their sizes.

The torque is made by formula with a sign that is sharp: gravity, inertia, viscous and dry friction.
"""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

JOINT = AxisProfile(name="joint")
RATE, SECONDS = 250.0, 40.0
GRAVITY, INERTIA, VISCOSITY, DRY = 100.0, 18.0, 17.0, 14.0
"""N m, kg m^2, N m s and N m: a shoulder of an arm."""
HIDDEN = "joint-gravity", "rotor-inertia", "motor-viscous", "motor-coulomb"
ENCODER_NOISE, TORQUE_NOISE = 1e-5, 2.0
FREQUENCIES = 2 * np.pi * np.array([0.05, 0.1, 0.15, 0.2, 0.25])
"""rad/s, of the sines of the motion."""


def slow_joint(
    seed: int,
    fastest: float,
    encoder_noise: float = ENCODER_NOISE,
    rate: float = RATE,
    step: float = 0.0,
) -> Run:
    """A multisine whose highest speed is ``fastest``, rad/s; noise and step of the encoder, rad."""
    random = np.random.default_rng(seed)
    size, phase = random.normal(size=5), random.uniform(0, 2 * np.pi, 5)
    time = np.arange(0.0, SECONDS, 1 / rate)
    turn = np.outer(time, FREQUENCIES) + phase
    size = size * fastest / np.max(np.abs(np.cos(turn) @ size))
    angle, speed = np.sin(turn) @ (size / FREQUENCIES), np.cos(turn) @ size
    acceleration = -np.sin(turn) @ (size * FREQUENCIES)
    torque = GRAVITY * np.cos(angle) + INERTIA * acceleration + VISCOSITY * speed
    torque += DRY * np.sign(speed) + TORQUE_NOISE * random.normal(size=len(time))
    angle = angle + encoder_noise * random.normal(size=len(time))
    if step:
        angle = step * np.round(angle / step)
    channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
    return Run(f"joint-{seed}", time, channels, {})


def hidden_values(run: Run) -> dict[tuple[str, str], float]:
    """Values of the named effects, which have to be those of the joint."""
    found = diagnose([run], JOINT).diagnosis
    assert found.verdict == "explained"
    values = {
        (effect, name): parameter.value
        for step in found.steps
        for effect in step.effects[:1]
        for name, parameter in step.parameters[effect].items()
    }
    assert {effect for effect, _ in values} == set(HIDDEN)
    return values


@pytest.mark.parametrize(
    ("fastest", "encoder_noise"), [(0.8, 1e-5), (1.5, 1e-5), (4.0, 1e-5), (1.5, 1e-4), (4.0, 1e-3)]
)
def test_dry_friction_of_a_slow_joint_has_its_size(fastest: float, encoder_noise: float) -> None:
    """By differences an encoder of 0.1 mrad adds an acceleration of 3.8 rad/s^2, 69 N m here.

    The model's reversals are rounded over 0.005 rad/s, these are sharp: less than 1 % of the dry
    friction at 0.8 rad/s, and what that is of the viscous torque there.
    """
    values = hidden_values(slow_joint(0, fastest, encoder_noise))
    assert values["motor-coulomb", "torque"] == pytest.approx(DRY, rel=0.01)
    assert values["motor-viscous", "viscosity"] == pytest.approx(VISCOSITY, rel=0.022)
    assert values["rotor-inertia", "inertia"] == pytest.approx(INERTIA, rel=0.015)
    assert values["joint-gravity", "amplitude"] == pytest.approx(GRAVITY, rel=0.002)


@pytest.mark.slow
def test_an_encoder_of_ten_bits_at_a_kilohertz_is_a_staircase_and_no_motion() -> None:
    """Seven samples on each of its steps; by every sample the viscosity was twice its size."""
    values = hidden_values(slow_joint(0, 0.8, 0.0, rate=1000.0, step=2 * np.pi / 1024))
    assert values["motor-coulomb", "torque"] == pytest.approx(DRY, rel=0.02)
    assert values["motor-viscous", "viscosity"] == pytest.approx(VISCOSITY, rel=0.03)
    assert values["rotor-inertia", "inertia"] == pytest.approx(INERTIA, rel=0.02)
    assert values["joint-gravity", "amplitude"] == pytest.approx(GRAVITY, rel=0.002)

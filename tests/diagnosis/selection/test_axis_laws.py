"""Laws of a joint behind a gearbox that the search once missed or named with a wrong value.

The generator knows equations of motion only, no effect of the catalogue: the angle is a sum of
sines, the torque is J a + c sgn w + b w + m sin φ plus the law of a test.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis, Step
from winchkit.runs.run import Channel, Run
from winchkit.schema.read import read_profile

Array = NDArray[np.float64]
RATIO, INERTIA, COULOMB, VISCOSITY, WEIGHT = 100.0, 2.2e-4, 0.06, 3e-4, 0.35
NOISE = 0.005
PROFILE = """schema = 1
kind = "axis"
name = "joint"
[motor]
inertia = "2.2e-4 kg m^2"
[gearbox]
ratio = {ratio}
[reference]
motor_angle = "0 rad"
"""
FRICTION = """
[[effect]]
id = "motor-coulomb"
torque = "0.06 N m"
[[effect]]
id = "motor-viscous"
viscosity = "3e-4 N m s"
"""
GRAVITY = """
[[effect]]
id = "joint-gravity"
amplitude = "0.35 N m"
phase = "0 rad"
"""


@dataclass(frozen=True)
class Swing:
    """A motion of the joint: angle of the joint, and angle, rate, acceleration of the motor."""

    time: Array
    phi: Array
    theta: Array
    rate: Array
    acceleration: Array


def swing(seed: int, size: float, seconds: float = 18.0, step: float = 0.004) -> Swing:
    random = np.random.default_rng(seed)
    time = np.arange(0, seconds, step)
    frequencies = np.array([0.11, 0.27, 0.43, 0.71])
    waves = [
        np.sin(2 * np.pi * f * time + random.uniform(0, 6.28)) / (1 + f / 0.11) for f in frequencies
    ]
    phi = np.sum(waves, axis=0)
    phi *= size / np.abs(phi).max()
    theta = RATIO * phi
    rate = np.gradient(theta, time)
    return Swing(time, phi, theta, rate, np.gradient(rate, time))


def plain(s: Swing, weight: float = WEIGHT) -> Array:
    return (
        INERTIA * s.acceleration
        + COULOMB * np.tanh(s.rate / 0.2)
        + VISCOSITY * s.rate
        + weight * np.sin(s.phi)
    )


def runs_of(swings: list[Swing], torque: Callable[[Swing], Array], repeats: int = 2) -> list[Run]:
    out = []
    for number, s in enumerate(swings):
        for repeat in range(repeats):
            noise = np.random.default_rng(10 * number + repeat).normal(0, NOISE, len(s.time))
            channels = {
                "motor_angle": Channel(s.theta, "rad"),
                "motor_torque": Channel(torque(s) + noise, "N m"),
            }
            metadata = {"programme": f"p{number}"}
            out.append(Run(f"run-{number}-{repeat}", s.time, channels, metadata=metadata))
    return out


def found(folder: Path, runs: list[Run], effects: str, ratio: float = RATIO) -> Diagnosis:
    path = folder / "profile.toml"
    path.write_text(PROFILE.format(ratio=ratio) + effects)
    return diagnose(runs, read_profile(path)).diagnosis


def step_of(said: Diagnosis, effect: str) -> Step:
    (step,) = [step for step in said.steps if step.effects[0] == effect]
    return step


@pytest.mark.parametrize("transmitted", [1.0, 0.4])
def test_friction_in_proportion_to_weight_and_inertia_is_named(
    transmitted: float, tmp_path: Path
) -> None:
    """The gear transmits the weight and a part of the inertia, the rest is the rotor's."""

    def torque(s: Swing) -> Array:
        load = WEIGHT * np.sin(s.phi) + transmitted * INERTIA * s.acceleration
        return plain(s) + 0.15 * np.abs(load) * np.tanh(s.rate / 0.2)

    runs = runs_of([swing(1, 1.3), swing(2, 1.3)], torque)
    step = step_of(found(tmp_path, runs, FRICTION + GRAVITY), "friction-of-transmission")
    values = step.parameters["friction-of-transmission"]
    assert step.certain or [d.code for d in step.doubts] == ["reversal"]
    assert values["share"].value == pytest.approx(0.15, abs=0.01)
    assert values["inertia_share"].value == pytest.approx(transmitted, abs=0.1)


def test_friction_in_proportion_to_the_weight_alone_has_the_simpler_law(tmp_path: Path) -> None:
    def torque(s: Swing) -> Array:
        return plain(s) + 0.15 * WEIGHT * np.abs(np.sin(s.phi)) * np.tanh(s.rate / 0.2)

    said = found(tmp_path, runs_of([swing(1, 1.3), swing(2, 1.3)], torque), FRICTION + GRAVITY)
    step = step_of(said, "friction-of-load")
    assert step.parameters["friction-of-load"]["share"].value == pytest.approx(0.15, abs=0.01)


def test_a_weight_that_an_uncertain_step_imitates_is_not_certain(tmp_path: Path) -> None:
    """With a ratio of 120 for 100 the weight is no sine of the angle: a spring mends its value."""
    motions = [swing(7, 1.2), swing(8, 1.2)]
    said = found(tmp_path, runs_of(motions, plain), FRICTION, ratio=120.0)
    step = step_of(said, "joint-gravity")
    value = step.parameters["joint-gravity"]["amplitude"].value
    assert abs(value - WEIGHT) > 0.1 * WEIGHT
    assert not step.certain
    right = found(tmp_path, runs_of(motions, plain), FRICTION)
    assert step_of(right, "joint-gravity").certain


def test_a_stribeck_speed_within_the_reversal_is_no_step_beside_coulomb(tmp_path: Path) -> None:
    """A friction with the root of the speed is none of the laws: its reversal is a nuisance."""

    def torque(s: Swing) -> Array:
        return plain(s, 0.0) + 0.006 * np.sqrt(np.abs(s.rate)) * np.tanh(s.rate / 0.2)

    said = found(tmp_path, runs_of([swing(9, 0.9), swing(10, 0.5)], torque), "")
    for step in said.steps:
        for values in step.parameters.values():
            assert all(e.std < 10 * abs(e.value) for e in values.values() if e.std == e.std)
        assert "undetermined" not in {doubt.code for doubt in step.doubts}

"""A joint recorded with several payloads: their weight and inertia follow from the stated masses.

The arm has weight, inertia and friction of its own; every torque is a closed form of the motion.
"""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.diagnose import diagnose
from winchkit.effects.catalogue import load_catalogue
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import GearboxSpec

G = 9.80665
LEVER, OFFSET, RATIO = 0.45, 0.3, 50.0
WEIGHT, INERTIA, COULOMB, NOISE = 0.5, 6e-4, 0.08, 0.01
"""At the motor: N m, kg m², N m, N m."""
JOINT = AxisProfile(name="joint", gearbox=GearboxSpec(ratio=RATIO))


def run(mass: float | None, seed: int, *, stated: bool = True) -> Run:
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 40.0, 0.02)
    angle, rate, acceleration = np.zeros(len(time)), np.zeros(len(time)), np.zeros(len(time))
    for size, omega in ((1.1, 0.5), (0.3, 1.7)):
        angle += size * np.sin(omega * time)
        rate += size * omega * np.cos(omega * time)
        acceleration -= size * omega**2 * np.sin(omega * time)
    load = mass or 0.0
    joint = load * (G * LEVER * np.sin(angle + OFFSET) + LEVER**2 * acceleration)
    torque = joint / RATIO + WEIGHT * np.sin(angle) + INERTIA * RATIO * acceleration
    torque += COULOMB * np.sign(rate) + NOISE * random.standard_normal(len(time))
    channels = {
        "motor_angle": Channel(RATIO * angle, "rad"),
        "motor_torque": Channel(torque, "N m"),
    }
    metadata = {"load_mass": f"{load} kg"} if stated else {}
    return Run(f"{load:g} kg, {seed}", time, channels, metadata)


def test_payloads_are_explained_by_one_lever() -> None:
    runs = [run(mass, 10 * k + int(mass)) for k in range(2) for mass in (0.0, 2.0, 5.0)]
    found = diagnose(runs, JOINT).diagnosis
    assert found.verdict == "explained"
    named = {step.effects[0]: step.parameters[step.effects[0]] for step in found.steps}
    lever, phase = named["joint-payload"]["lever"], named["joint-payload"]["phase"]
    assert lever.value == pytest.approx(LEVER, abs=4 * lever.std)
    assert phase.value == pytest.approx(OFFSET, abs=4 * phase.std)
    assert named["joint-gravity"]["amplitude"].value == pytest.approx(WEIGHT, rel=0.02)
    assert named["rotor-inertia"]["inertia"].value == pytest.approx(INERTIA, rel=0.03)
    assert named["motor-coulomb"]["torque"].value == pytest.approx(COULOMB, rel=0.05)


@pytest.mark.parametrize("masses", [(2.0, 2.0), (0.0, None)], ids=["one load", "not stated"])
def test_no_lever_is_fitted_to_masses_that_do_not_differ_or_are_unknown(
    masses: tuple[float | None, ...],
) -> None:
    runs = [run(mass, k, stated=mass is not None) for k, mass in enumerate(masses)]
    found = diagnose(runs, JOINT).diagnosis
    assert "joint-payload" not in {effect for step in found.steps for effect in step.effects}


def test_it_needs_several_payloads() -> None:
    assert load_catalogue()["joint-payload"].needs == ("axis", "payloads")

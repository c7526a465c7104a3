"""Loads that are stated: errors of inputs, and a joint recorded with several payloads.

The arm of the joint has weight, inertia and friction of its own; every torque is a closed form of
the motion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, made
from effect_lines import CATALOGUE, EFFECTS
from winchkit.diagnosis.diagnose import diagnose
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals, Stage
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


@pytest.mark.parametrize("masses", [(10.0,), (10.0, 25.0)], ids=["one load", "two"])
def test_a_hook_is_a_share_of_one_load_as_well(masses: tuple[float, ...]) -> None:
    """The runs state a load without the hook of 0.9 kg: a second load distinguishes the two."""
    runs = []
    for mass in masses:
        for repeat in range(2):
            seed = int(10 * mass) + repeat
            heavier = made(seed, GROOVED, load_mass=mass + 0.9, ride=Ride(samples=600))
            stated = {**heavier.metadata, "load_mass": f"{mass} kg"}
            runs.append(replace(heavier, metadata=stated))
    (step,) = diagnose(runs, GROOVED).diagnosis.steps
    assert set(step.effects) == ({"load-offset"} | ({"load-gain"} if len(masses) == 1 else set()))
    assert step.certain == (len(masses) > 1)
    hook = step.parameters["load-offset"]["mass"]
    assert hook.value == pytest.approx(0.9, abs=max(4 * hook.std, 2e-3))


TRUE = standard_motion().load
assert TRUE is not None
READINGS = {
    "cell-gain": ({"gain_error": 0.04}, 1.04 * TRUE),
    "cell-offset": ({"offset": 6.0}, TRUE + 6.0),
}
ELASTIC = Term(CATALOGUE["cable-elongation-linear"], {"axial_stiffness": 4e4})


def predicted(terms: list[Term], **force: object) -> dict[str, np.ndarray]:
    at, line = standard_motion().at, Line(STANDARD_PROFILE, modifiers_of(terms))
    signals = Signals(at.time, at.motor_angle, temperature=at.temperature)
    return line.predict(line.motion(replace(signals, **force)))


def test_effects_that_are_undone_are_those_of_the_cell() -> None:
    assert {e.id for e in EFFECTS if e.correct is not None} == set(READINGS)
    assert all(CATALOGUE[name].stage is Stage.CELL for name in READINGS)


@pytest.mark.parametrize("effect", READINGS)
def test_torque_and_length_follow_from_the_tension_behind_a_wrong_reading(effect: str) -> None:
    values, reading = READINGS[effect]
    shown = predicted([ELASTIC, Term(CATALOGUE[effect], values)], tension=reading)
    right = predicted([ELASTIC], tension=TRUE)
    assert "tension" not in shown
    assert (
        np.max(np.abs(predicted([], tension=reading)["motor_torque"] - right["motor_torque"])) > 0
    )
    for output in ("motor_torque", "cable_length"):
        assert np.allclose(shown[output], right[output], rtol=1e-12, atol=0)


def test_gain_and_offset_of_a_cell_are_undone_the_last_first() -> None:
    both = [Term(CATALOGUE[name], READINGS[name][0]) for name in READINGS]
    shown = predicted(both, tension=1.04 * TRUE + 6.0)
    assert np.allclose(shown["motor_torque"], predicted([], tension=TRUE)["motor_torque"])


def test_under_a_known_load_a_wrong_cell_changes_its_reading_alone() -> None:
    values, reading = READINGS["cell-gain"]
    shown = predicted([ELASTIC, Term(CATALOGUE["cell-gain"], values)], load=TRUE, tension=TRUE)
    right = predicted([ELASTIC], load=TRUE)
    assert np.allclose(shown["tension"], reading)
    assert np.array_equal(shown["motor_torque"], right["motor_torque"])
    assert np.array_equal(shown["cable_length"], right["cable_length"])


@pytest.mark.parametrize("stated", [{"load": TRUE / 1.05}, {"load_mass": 20.0 / 1.05}])
def test_a_wrong_stated_load_pulls_the_cable_with_the_true_one(stated: dict[str, object]) -> None:
    others = [ELASTIC, Term(CATALOGUE["pulley-coulomb"], {"friction": 0.02, "transition": 0.0})]
    heavier = Term(CATALOGUE["load-gain"], {"gain_error": 0.05})
    shown = predicted([*others, heavier], **stated)
    true = {name: 1.05 * value for name, value in stated.items()}  # type: ignore[operator]
    right = predicted(others, **true)
    assert set(shown) == {"cable_length", "tension", "motor_torque"}
    for output, values in right.items():
        assert np.allclose(shown[output], values, rtol=1e-12, atol=1e-12), output


def test_a_wrong_stated_load_changes_nothing_where_none_is_stated() -> None:
    heavier = Term(CATALOGUE["load-gain"], {"gain_error": 0.05})
    shown, right = (predicted(terms, tension=TRUE) for terms in ([ELASTIC, heavier], [ELASTIC]))
    for output, values in right.items():
        assert np.array_equal(shown[output], values)

"""Equivalence sets, and the runs that distinguish their members."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, SPIRAL, Ride, made, term, with_channel, without
from winchkit.arrays import Array
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.term import Term
from winchkit.schema.profiles.winch import GuideSpec, WinchProfile

HIDDEN = {
    "radius": term("drum-radius", radius_error=3e-4),
    "gain": term("cell-gain", gain_error=0.02),
    "drag": term("motor-coulomb", torque=0.02),
    "rope": term("cable-elongation-linear", axial_stiffness=2e5),
}

BENDS = (14000.0, 16000.0, 18000.0)
"""Force scales of cables that are nearly straight under 50 to 400 N, N."""


@cache
def answer(hidden: str, masses: tuple[float, ...], drum: str = "grooved") -> Diagnosis:
    profile: WinchProfile = GROOVED if drum == "grooved" else SPIRAL
    own: tuple[Term, ...] = (HIDDEN[hidden],)
    ride = Ride(samples=400, stroke=800.0 if drum == "spiral" else 400.0)
    runs = [
        made(int(10 * mass) + seed, profile, own, load_mass=mass, ride=ride)
        for mass in masses
        for seed in range(2)
    ]
    return diagnose(runs, profile).diagnosis


def test_a_radius_and_a_ratio_are_one_set_on_a_grooved_drum() -> None:
    found = answer("radius", (10.0, 25.0))
    assert found.verdict == "explained"
    (step,) = found.steps
    # In the order of the catalogue, whichever of the two the selection took.
    assert step.effects == ("drum-radius", "gear-ratio")
    for values in step.parameters.values():
        (estimate,) = values.values()
        assert estimate.interval is not None
        assert estimate.interval[0] < estimate.value < estimate.interval[1]
        assert 0.0 < estimate.std < 0.1 * abs(estimate.value)
    assert step.combination is not None
    assert step.combination.name == "cable per motor turn"
    (angle,) = step.angles.values()
    assert angle < 0.01
    # The same length by either: Δr/r = −e/(1 + e), with the lead of the grooves in between.
    radius = step.parameters["drum-radius"]["radius_error"].value
    ratio = step.parameters["gear-ratio"]["ratio_error"].value
    assert radius == pytest.approx(3e-4, rel=0.05)
    assert radius / 0.06 == pytest.approx(-ratio / (1 + ratio), rel=0.01)
    named = {run.separates for run in found.next_runs}
    assert all(set(pair) == {"drum-radius", "gear-ratio"} for pair in named)
    assert named


def test_a_gain_of_the_cell_is_named_first_with_several_loads() -> None:
    """Motor torque is tension times arm on this bench: its share in the cell is a gain as well."""
    found = answer("gain", (10.0, 20.0, 40.0))
    assert found.verdict == "explained"
    (step,) = found.steps
    assert step.effects == ("cell-gain", "cell-crosstalk")
    estimate = step.parameters["cell-gain"]["gain_error"]
    assert abs(estimate.value - 0.02) < 4 * estimate.std
    assert {frozenset(run.separates) for run in found.next_runs} <= {frozenset(step.effects)}


def test_under_one_load_a_gain_is_not_more_certain_than_it_is() -> None:
    one, several = answer("gain", (10.0,)), answer("gain", (10.0, 20.0, 40.0))
    assert "cell-gain" in one.steps[0].effects
    assert len(one.steps[0].effects) >= len(several.steps[0].effects)
    assert any(note.startswith("one load only") for note in one.notes)


@pytest.mark.parametrize("hidden", ["drag", "rope"])
def test_a_set_of_one_has_no_angles_and_no_next_run(hidden: str) -> None:
    found = answer(hidden, (10.0, 25.0), "spiral")
    (step,) = found.steps
    assert step.effects == (HIDDEN[hidden].effect.id,)
    assert step.angles == {}
    assert found.next_runs == ()


@pytest.mark.parametrize(
    ("hidden", "masses", "drum"),
    [
        ("radius", (10.0, 25.0), "grooved"),
        ("gain", (10.0,), "grooved"),
        ("gain", (10.0, 20.0, 40.0), "grooved"),
    ],
)
def test_the_parsimonious_one_comes_first_and_values_are_of_all(
    hidden: str, masses: tuple[float, ...], drum: str
) -> None:
    for step in answer(hidden, masses, drum).steps:
        assert list(step.parameters) == list(step.effects)
        assert set(step.angles) == set(step.effects) - {HIDDEN[hidden].effect.id}
        assert all(0 <= angle <= np.pi / 2 for angle in step.angles.values())
        sizes = [len(values) for values in step.parameters.values()]
        assert sizes == sorted(sizes)
        own = step.parameters[HIDDEN[hidden].effect.id]
        assert all(estimate.std > 0 for estimate in own.values())
        assert 0 < step.heldout_gain < 1


@cache
def rope(force_scale: float) -> Diagnosis:
    """Of a cable that is stiffer when tight: the less so, the larger its ``force_scale``."""
    law = term(
        "cable-elongation-exponential", strain_scale=force_scale / 2e5, force_scale=force_scale
    )
    runs = [
        made(int(10 * mass) + seed, SPIRAL, (law,), load_mass=mass, ride=Ride(stroke=800.0))
        for mass in (5.0, 12.0, 25.0, 40.0)
        for seed in range(2)
    ]
    return diagnose(runs, SPIRAL).diagnosis


@pytest.mark.parametrize(
    "force_scale",
    [*(pytest.param(scale, marks=pytest.mark.campaign) for scale in (100.0, 200.0)), 400.0],
)
def test_laws_of_a_curved_cable_are_reported_together(force_scale: float) -> None:
    """Four loads show that it is curved, not by which formula; a straight one is out."""
    (step,) = rope(force_scale).steps
    assert set(step.effects) == {"cable-elongation-exponential", "cable-elongation-quartic"}
    for law, parameters in step.parameters.items():
        for name, estimate in parameters.items():
            ends = CATALOGUE[law].parameter(name)
            assert ends.low < estimate.value < ends.high, (law, name)


def test_a_curvature_significant_at_five_percent_is_not_denied() -> None:
    """Between a clear bend and one below the noise, the linear and the curved law form a set."""
    straight = "cable-elongation-linear"
    assert straight not in rope(400.0).steps[0].effects
    assert set(rope(1e6).steps[0].effects) == {straight}
    between = (rope(scale).steps[0].effects for scale in BENDS)
    assert any(straight in effects and len(effects) > 1 for effects in between)


GUIDED = replace(GROOVED, guide=GuideSpec(screw_lead=0.005, distance=0.3))


def guided(offset: float, mismatch: float) -> Diagnosis:
    """A guide far aside, whose cable bends the more the more its screw is wrong."""
    own = (term("guide-offset", offset=offset, mismatch=mismatch),)
    ride = Ride(samples=400, stroke=400.0)
    runs = [
        made(int(10 * mass) + seed, GUIDED, own, load_mass=mass, ride=ride)
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    return diagnose(runs, GUIDED).diagnosis


def test_a_guide_whose_detour_is_straight_is_equivalent_to_a_wrong_ratio() -> None:
    (step,) = guided(0.1, 3e-4).steps
    # 0.15 % of the length: of the torque less than its noise, so that the instrument may be wrong.
    assert {"guide-offset", "gear-ratio", "drum-radius", "length-gain"} == set(step.effects)


def test_a_guide_whose_detour_bends_stands_alone() -> None:
    (step,) = guided(0.02, -6e-3).steps
    assert step.effects == ("guide-offset",)
    values = step.parameters["guide-offset"]
    # The same path with both signs turned.
    sign = np.sign(values["offset"].value)
    assert sign * values["offset"].value == pytest.approx(0.02, rel=0.1)
    assert sign * values["mismatch"].value == pytest.approx(-6e-3, rel=0.05)


@pytest.mark.parametrize(("size", "sets"), [(0.0, 1), (2e-3, 2)])
def test_an_error_of_unknown_cause_is_no_evidence_against_a_rival(size: float, sets: int) -> None:
    """A transmission error would also move the cable, by less than a wave of unknown cause."""
    hidden = term("torque-ripple", amplitude=0.02, phase=0.3, order=2.0)
    ride = Ride(samples=1600, stroke=60.0)
    wave = size * np.sin(2 * np.pi * ride.time / 1.03) ** 3
    runs = []
    for seed in range(4):
        run = without(made(seed, GROOVED, (hidden,), load_mass=10.0, ride=ride), "tension")
        runs.append(with_channel(run, "cable_length", run["cable_length"] + wave, "m"))
    candidates = Catalogue(CATALOGUE[n] for n in ("torque-ripple", "gear-transmission-error"))
    (step,) = diagnose(runs, GROOVED, candidates).diagnosis.steps
    assert step.effects[0] == "torque-ripple"
    assert len(step.effects) == sets


@pytest.mark.parametrize(("size", "sets"), [(0.0, 1), (0.8, 2)])
def test_an_error_of_unknown_cause_does_not_decide_between_rivals(size: float, sets: int) -> None:
    """Crosstalk and a gain differ by the friction of the motor, by less than a wave in the cell."""
    hidden = term("cell-gain", gain_error=0.02), term("motor-coulomb", torque=0.01)
    ride = Ride(samples=1600, stroke=60.0)
    wave = size * np.sin(2 * np.pi * ride.time / 1.03) ** 3
    runs = []
    for seed in range(4):
        run = made(seed, GROOVED, hidden, load_mass=20.0 * (1 + seed // 2), ride=ride)
        runs.append(with_channel(run, "tension", run["tension"] + wave))
    names = "motor-coulomb", "cell-gain", "cell-crosstalk"
    steps = diagnose(runs, GROOVED, Catalogue(CATALOGUE[n] for n in names)).diagnosis.steps
    (step,) = (step for step in steps if "cell-gain" in step.effects)
    assert len(step.effects) == sets


class Straight(Ride):
    """A motion in one direction at one speed."""

    @property
    def angle(self) -> Array:
        return np.asarray(self.stroke * self.time / self.time[-1])


def test_a_rival_with_more_parameters_stays_unless_it_contains_the_law() -> None:
    """At one speed a spring over the angle is a friction that grows with time."""
    spring = term("spring-balancer", stiffness=2e-4, torque=0.0)
    runs = [
        made(int(mass) + seed, GROOVED, (spring,), load_mass=mass, ride=Straight())
        for mass in (10.0, 25.0)
        for seed in range(2)
    ]
    candidates = Catalogue(CATALOGUE[n] for n in ("spring-balancer", "friction-growth"))
    (step,) = diagnose(runs, GROOVED, candidates).diagnosis.steps
    assert set(step.effects) == {"spring-balancer", "friction-growth"}
    assert not step.certain

"""Pairs of effects that mask each other."""

from __future__ import annotations

import pytest

from diagnosis_runs import Ride, engine_for, term
from winchkit.diagnosis.selection.admissible import best_of_each
from winchkit.diagnosis.selection.pairs import screened_pairs
from winchkit.diagnosis.selection.stepwise import _best_pair
from winchkit.effects.term import Term

RIDE = Ride(samples=600, stroke=400.0)
MASSES = (18.0, 20.0, 22.0)
HIDDEN = (term("cell-gain", gain_error=-0.05), term("cell-offset", offset=0.05 * 20 * 9.80665))
"""Under about 20 kg the cell reads right."""


def test_a_gain_masked_by_an_offset_scores_jointly_with_it() -> None:
    engine = engine_for(HIDDEN, RIDE, MASSES)
    present, noise = engine.fit_with_noise(engine.initial_model)
    scores = engine.scores_at_all_points(present, noise)
    alone = {s.candidate.effect.id: s.explained_ss for s in best_of_each(scores)}
    projected = engine.projected(present, noise)
    pairs = screened_pairs(projected, present.residual, scores, engine.penalty_per_parameter)
    named = [
        {item.candidate.effect.id for item in pair.scores} for pair in pairs if pair.suppressed
    ]
    assert {"cell-gain", "cell-offset"} in named
    assert alone["cell-offset"] < 0.5 * present.chi_square
    assert [pair.net_gain for pair in pairs] == sorted((p.net_gain for p in pairs), reverse=True)


def test_a_pair_is_added_and_replaces_a_false_effect() -> None:
    engine = engine_for(HIDDEN, RIDE, MASSES)
    present, noise = engine.fit_with_noise(engine.initial_model)
    grown = _best_pair(engine, present, noise)
    assert grown is not None
    assert set(grown.labels) == {"cell-gain", "cell-offset"}
    gain, offset = sorted(grown.hypothesis.terms, key=lambda t: t.label)
    assert abs(gain.values["gain_error"] + 0.05) < 0.005
    assert abs(offset.values["offset"] - 9.8) < 1.0
    other = present.hypothesis.with_term(
        term("motor-coulomb", torque=1e-3), engine.regression.n_runs
    )
    begun, noise = engine.fit_with_noise(other)
    exchanged = _best_pair(engine, begun, noise)
    assert exchanged is not None
    assert set(exchanged.labels) == {"cell-gain", "cell-offset"}


ONE_WAY = (
    term("motor-viscous", viscosity=2e-4),
    term("motor-viscous-asymmetry", viscosity_difference=2e-4),
)
"""A drag in one direction only: each of the two alone is wrong in the other direction."""


@pytest.mark.parametrize("also", [(), (term("cable-elongation-linear", axial_stiffness=2e5),)])
def test_a_pair_of_effects_that_mask_each_other_is_found(also: tuple[Term, ...]) -> None:
    """Also beside an effect that acts on the length only, where these two do nothing."""
    engine = engine_for((*ONE_WAY, *also), RIDE, MASSES)
    start = engine.initial_model
    for own in also:
        start = start.with_term(own, engine.regression.n_runs)
    present, noise = engine.fit_with_noise(start)
    grown = _best_pair(engine, present, noise)
    assert grown is not None
    assert set(grown.labels) == {t.label for t in (*ONE_WAY, *also)}
    values = {t.label: t.values for t in grown.hypothesis.terms}
    assert values["motor-viscous"]["viscosity"] == pytest.approx(2e-4, rel=0.1)


def test_no_pair_is_added_beside_an_addition_on_the_same_output() -> None:
    engine = engine_for(ONE_WAY, RIDE, MASSES)
    start = engine.initial_model
    for own in (
        term("motor-coulomb", torque=1e-3),
        term("cell-gain", gain_error=1e-4),
        term("drum-radius", radius_error=1e-6),
    ):
        start = start.with_term(own, engine.regression.n_runs)
    assert _best_pair(engine, *engine.fit_with_noise(start)) is None


def test_an_effect_that_imitates_a_pair_is_exchanged_for_it() -> None:
    """Another effect stays beside it; the imitating effect need not be the first addition."""
    hidden = (
        term("pulley-inertia", equivalent_mass=6.5),
        term("cell-gain", gain_error=-0.05),
        term("cell-offset", offset=0.05 * 20 * 9.80665),
    )
    engine = engine_for(hidden, RIDE, MASSES)
    start = engine.initial_model
    for own in (hidden[0], term("motor-coulomb-asymmetry", offset=1e-3)):
        start = start.with_term(own, engine.regression.n_runs)
    grown = _best_pair(engine, *engine.fit_with_noise(start))
    assert grown is not None
    # Cross-talk and gain are one under these loads.
    alike = {label.replace("cell-crosstalk", "cell-gain") for label in grown.labels}
    assert alike == {t.label for t in hidden}

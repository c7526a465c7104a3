"""Effects fitted again after another was added, and exchanged for a rival."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, Ride, engine_for, term
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.exchange import pair_exchange
from winchkit.diagnosis.selection.signatures import Signatures, updated_signatures
from winchkit.diagnosis.selection.stepwise import stepwise_selection
from winchkit.diagnosis.verdict.equivalence import equivalence_set
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.term import Term
from winchkit.effects.transition import with_transitions

RIDE = Ride(samples=1200, rate=25.0, period=12.0)


def test_a_slip_is_found_at_its_time_beside_a_delay() -> None:
    late = term("length-time-offset", delay=0.01)
    engine = engine_for([term("encoder-slip", step=0.01, time=14.7), late], RIDE)
    found = stepwise_selection(engine).final.hypothesis.terms
    assert sorted(t.label for t in found) == ["encoder-slip", "length-time-offset"]
    slip = next(t for t in found if t.label == "encoder-slip")
    assert slip.values["time"] == pytest.approx(14.7, abs=0.1)
    assert slip.values["step"] == pytest.approx(0.01, rel=0.05)


def test_an_effect_that_explained_two_is_refitted_beside_the_second() -> None:
    """A slip makes a creep seem slow and soft; beside the slip it is neither."""
    hidden = (
        term("cable-creep", creep_stiffness=3e5, time_constant=6.0),
        term("encoder-slip", step=-0.04, time=14.7),
    )
    engine = engine_for(hidden, RIDE)
    alone = term("cable-creep", creep_stiffness=2e5, time_constant=20.0)
    present, noise = engine.fit_with_noise(
        engine.initial_model.with_term(alone, engine.regression.n_runs)
    )
    terms = {t.label: t.values for t in pair_exchange(engine, present, noise, 1).hypothesis.terms}
    assert set(terms) == {"cable-creep", "encoder-slip"}
    assert terms["encoder-slip"]["time"] == pytest.approx(14.7, abs=0.1)
    assert terms["cable-creep"]["time_constant"] == pytest.approx(6.0, rel=0.1)


def columns_of(found: Signatures) -> dict[str, np.ndarray]:
    """By effect and the values of a usual size."""
    return {
        f"{candidate.effect.id} {candidate.shape} {usual_step}": found.columns[:, index]
        for candidate in found.candidates
        for index, usual_step in enumerate(candidate.usual_steps, candidate.columns.start)
    }


def test_updated_signatures_equal_newly_computed_ones() -> None:
    """A wrong ratio reaches every output, a stretching cable the length alone."""
    for grown in (
        term("gear-ratio", ratio_error=0.02),
        term("cable-elongation-linear", axial_stiffness=3e5),
    ):
        engine = engine_for([], RIDE)
        before = {name: column.copy() for name, column in columns_of(engine.signatures).items()}
        present = engine.initial_model.with_term(grown, engine.regression.n_runs)
        again = updated_signatures(engine.regression, present, engine.signatures)
        assert again is not None
        told, wanted = columns_of(again), columns_of(engine._signatures(present))
        assert set(told) == set(wanted) == set(before)
        changed = [
            name for name, column in wanted.items() if not np.array_equal(column, before[name])
        ]
        assert changed
        assert all(np.array_equal(told[name], wanted[name]) for name in wanted)
        assert np.allclose(again.gram, engine._signatures(present).gram)


@pytest.mark.parametrize(
    ("grown", "anew"),
    [
        (term("pulley-coulomb", friction=0.05), True),
        (term("cable-elongation-linear", axial_stiffness=3e5), False),
    ],
    ids=["on its way", "elsewhere"],
)
def test_a_new_signature_requires_all_to_be_computed_again(grown: Term, anew: bool) -> None:
    engine = engine_for([], RIDE)
    lag = CATALOGUE["cell-lag"]
    silent = replace(engine.signatures, without_signature=((lag, {}, ({"time_constant": 0.05},)),))
    present = engine.initial_model.with_term(grown, engine.regression.n_runs)
    assert (updated_signatures(engine.regression, present, silent) is None) is anew


ONE_WAY = Ride(samples=1500, rate=25.0, period=100.0)
"""Wound in once and not quite out again: a creep can look like a wrong length of cable."""


@pytest.mark.parametrize("radius_error", [-1e-3, -5e-4, 1e-3])
def test_an_equivalent_effect_is_found_though_the_others_compensate(radius_error: float) -> None:
    """On a grooved drum a wrong radius and a wrong ratio do the same to the last digit."""
    hidden = (
        term("drum-radius", radius_error=radius_error),
        term("cable-creep", creep_stiffness=7e5, time_constant=20.0),
    )
    engine = engine_for(hidden, ONE_WAY)
    start = engine.initial_model
    for own in hidden:
        start = start.with_term(own, engine.regression.n_runs)
    final, noise = engine.fit_with_noise(start)
    alone = engine.refit(final.hypothesis.without(0), noise).hypothesis.terms[0]
    assert abs(np.log(alone.values["creep_stiffness"] / 7e5)) > 1.0
    assert set(equivalence_set(engine, final, noise, 0).effects) == {"drum-radius", "gear-ratio"}


def test_a_fixed_hypothesis_keeps_its_values() -> None:
    creep = term("cable-creep", creep_stiffness=7e5, time_constant=20.0)
    engine = engine_for([creep], ONE_WAY)
    begin, noise = engine.fit_with_noise(engine.initial_model)
    other = begin.hypothesis.with_term(
        term("cable-creep", creep_stiffness=1e6, time_constant=5.0), engine.regression.n_runs
    )
    held = engine.fixed(other, noise)
    assert held.vector == pytest.approx(engine.regression.vector(other))
    assert engine.refit(other, noise).chi_square < held.chi_square


def test_a_rival_with_a_friction_turns_around_over_the_same_speed() -> None:
    """The catalogue's transition, found beside a viscous friction that was still missing, is too
    large: a capstan is a pulley's Coulomb friction, whichever transition that has."""
    engine = engine_for([term("pulley-coulomb", friction=0.01)], RIDE)
    rounded = Catalogue(with_transitions(e, {"m/s": 0.2}) for e in CATALOGUE.of_winches())
    engine = selection_engine(engine.regression.dataset, rounded)
    sharp = term("pulley-coulomb", friction=0.01)
    present, noise = engine.fit_with_noise(
        engine.initial_model.with_term(sharp, engine.regression.n_runs)
    )
    found = equivalence_set(engine, present, noise, engine.n_initial_terms)
    assert set(found.effects) == {"pulley-coulomb", "pulley-capstan"}
    assert [t.values["transition"] for t in found.terms] == [0.0, 0.0]

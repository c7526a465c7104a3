"""Effects of a final model that are significant beside the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, NOISE, Ride, made, term
from winchkit.diagnosis.data.dataset import prepare
from winchkit.diagnosis.diagnose import selection_engine
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import Spread, spread_of
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.selection.stepwise import initial_result
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet
from winchkit.diagnosis.verdict.significance import (
    excess_evidence,
    negligible_additions,
    variance_inflation,
)
from winchkit.effects.term import Term

DRAG = term("motor-coulomb", torque=0.02)


def engine_of(hidden: tuple[Term, ...]) -> TimeSeriesSelection:
    ride = Ride(samples=400)
    runs = [
        made(10 * load + repeat, GROOVED, hidden, load_mass=10.0 * load, ride=ride)
        for load in (1, 2)
        for repeat in range(2)
    ]
    return selection_engine(prepare(runs, GROOVED), CATALOGUE)


def fitted_with(
    engine: TimeSeriesSelection, terms: tuple[Term, ...], widening: float | None = None
) -> tuple[Fit, Noise, Spread]:
    """Fit of some terms; ``widening`` in place of that of their intervals."""
    hypothesis = engine.initial_model
    for one in terms:
        hypothesis = hypothesis.with_term(one, engine.regression.n_runs)
    final, noise = engine.fit_with_noise(hypothesis)
    spread = spread_of(engine.regression, final, noise, engine.regression.blocks)
    if widening is not None:
        spread = replace(spread, widening=np.full(len(final.vector), widening))
    return final, noise, spread


def test_an_effect_that_is_there_is_significant_and_one_that_is_not_is_not() -> None:
    engine = engine_of((DRAG,))
    fitted = fitted_with(engine, (DRAG, term("gear-ratio", ratio_error=1e-7)))
    drag, ratio = (excess_evidence(engine, *fitted, index, threshold=5.0) for index in range(2))
    assert drag > 0.0 > ratio


def test_evidence_is_the_decrease_of_chi_square_beyond_penalty_and_threshold() -> None:
    engine = engine_of((DRAG,))
    final, noise, spread = fitted_with(engine, (DRAG,), 1.0)
    without = engine.refit(final.hypothesis.without(0), noise)
    decrease = without.chi_square - final.chi_square
    penalty = np.log(engine.regression.n_observations)
    found = excess_evidence(engine, final, noise, spread, 0, threshold=5.0)
    assert found == pytest.approx(decrease - penalty - 5.0)
    # Intervals that are as many times longer take the evidence away.
    wider = replace(spread, widening=spread.widening * np.sqrt(decrease / (penalty + 5.0)))
    assert excess_evidence(engine, final, noise, wider, 0, threshold=5.0) == pytest.approx(
        0.0, abs=1e-6
    )


def test_insignificant_effects_come_the_weakest_first() -> None:
    """One that has to stay must not keep the next one in the model."""
    engine = engine_of((DRAG,))
    terms = (term("gear-ratio", ratio_error=1e-7), DRAG, term("motor-viscous", viscosity=1e-7))
    final, noise, spread = fitted_with(engine, terms)
    result = replace(initial_result(engine), final=final, noise=noise, threshold=5.0)
    sets = [
        EquivalenceSet(one, (one.effect.id,), (one,), (final,), {})
        for one in final.hypothesis.terms
    ]
    evidence = [
        excess_evidence(engine, final, noise, spread, index, threshold=5.0) for index in range(3)
    ]
    assert evidence[1] > 0.0 > max(evidence[0], evidence[2])
    found = list(negligible_additions(engine, result, spread, sets))
    assert found == sorted((0, 2), key=lambda index: evidence[index])


def test_a_significant_effect_that_changes_no_error_by_two_percent_is_negligible() -> None:
    """An offset of a tenth of the noise is certain after 4000 samples, and changes 0.5 %."""
    offset = term("cell-offset", offset=0.1 * NOISE["tension"])
    ride = Ride(samples=4000)
    runs = [
        made(10 * load + repeat, GROOVED, (DRAG, offset), load_mass=10.0 * load, ride=ride)
        for load in (1, 2)
        for repeat in range(2)
    ]
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    final, noise, spread = fitted_with(engine, (offset, DRAG))
    assert excess_evidence(engine, final, noise, spread, 0, threshold=5.0) > 0.0
    result = replace(initial_result(engine), final=final, noise=noise, threshold=5.0)
    sets = [
        EquivalenceSet(one, (one.effect.id,), (one,), (final,), {})
        for one in final.hypothesis.terms
    ]
    assert list(negligible_additions(engine, result, spread, sets)) == [0]


def test_the_variance_of_one_amplitude_is_that_of_its_interval() -> None:
    engine = engine_of((DRAG,))
    final, _, spread = fitted_with(engine, (DRAG,))
    index = engine.regression.nuisance_columns.shape[1]
    inflation = variance_inflation(engine.regression, final, spread, 0)
    assert inflation == pytest.approx(float(spread.widening[index]) ** 2)
    assert inflation > 1.0


def test_amplitudes_are_judged_together() -> None:
    """Of a line far from its zero neither offset nor slope is determined, but their sum is."""
    line = term("spring-balancer", stiffness=0.0, torque=0.02)
    engine = engine_of((line,))
    final, noise, spread = fitted_with(engine, (line,), 3.0)
    assert variance_inflation(engine.regression, final, spread, 0) == pytest.approx(9.0)
    undetermined = replace(spread, widening=np.full(len(final.vector), np.inf))
    assert variance_inflation(engine.regression, final, undetermined, 0) == np.inf
    assert excess_evidence(engine, final, noise, undetermined, 0, threshold=0.0) < 0.0

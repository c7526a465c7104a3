"""Additions of which the 95 % region holds the null."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scipy.stats import chi2

from diagnosis_runs import CATALOGUE, GROOVED, Ride, made, term
from winchkit.diagnosis.data.dataset import prepare
from winchkit.diagnosis.diagnose import selection_engine
from winchkit.diagnosis.regression.intervals import spread_of
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.determination import region_holds_null
from winchkit.effects.term import Term


def engine_of(hidden: tuple[Term, ...]) -> TimeSeriesSelection:
    ride = Ride(samples=400)
    runs = [
        made(10 * load + repeat, GROOVED, hidden, load_mass=10.0 * load, ride=ride)
        for load in (1, 2)
        for repeat in range(2)
    ]
    return selection_engine(prepare(runs, GROOVED), CATALOGUE)


def holds_null(engine: TimeSeriesSelection, terms: tuple[Term, ...], wider: float = 1.0) -> list:
    """Of every term beside the others, with intervals that are ``wider`` times as long."""
    hypothesis = engine.initial_model
    for one in terms:
        hypothesis = hypothesis.with_term(one, engine.regression.n_runs)
    final, noise = engine.fit_with_noise(hypothesis)
    spread = spread_of(engine.regression, final, noise, engine.regression.blocks)
    spread = replace(
        spread,
        low=final.vector - wider * (final.vector - spread.low),
        high=final.vector + wider * (spread.high - final.vector),
    )
    return [
        region_holds_null(engine.regression, final, noise, spread, i) for i in range(len(terms))
    ]


def test_an_effect_that_is_there_is_determined_and_one_that_is_not_is_not() -> None:
    drag, ratio = term("motor-coulomb", torque=0.02), term("gear-ratio", ratio_error=1e-7)
    assert holds_null(engine_of((drag,)), (drag, ratio)) == [False, True]


def test_one_amplitude_is_judged_by_its_interval() -> None:
    """The interval ends at the null where it is stretched by the value over its arm."""
    drag = term("motor-coulomb", torque=0.02)
    engine = engine_of((drag,))
    hypothesis = engine.initial_model.with_term(drag, engine.regression.n_runs)
    final, noise = engine.fit_with_noise(hypothesis)
    spread = spread_of(engine.regression, final, noise, engine.regression.blocks)
    index = engine.regression.nuisance_columns.shape[1]
    reach = float(final.vector[index] / (final.vector[index] - spread.low[index]))
    assert holds_null(engine, (drag,), 0.99 * reach) == [False]
    assert holds_null(engine, (drag,), 1.01 * reach) == [True]


def test_amplitudes_are_judged_together() -> None:
    """Of a straight line about a far zero neither offset nor slope is determined, the line is."""
    line = term("spring-balancer", stiffness=0.0, torque=0.02)
    assert chi2.ppf(0.95, 2) == pytest.approx(5.99, abs=0.01)
    engine = engine_of((line,))
    assert holds_null(engine, (line,)) == [False]
    assert holds_null(engine, (line,), 1e4) == [True]

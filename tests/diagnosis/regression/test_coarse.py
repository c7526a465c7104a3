"""The coarse regression: the same optimum as all samples, within its own uncertainty."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, made, term
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.coarse import CoarseTimeSeries, coarse_regression
from winchkit.diagnosis.regression.gls import CoarseProblem, RequiredChiSquare, fit, fit_from
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import BandNoise, noise_from_repeats
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.term import Term

RIDE = Ride(samples=4000)
STIFF = term("cable-elongation-exponential", strain_scale=2e-3, force_scale=120.0)
DAHL = term("pulley-dahl", friction=0.02, stiffness=3000.0)


def problem(*terms: Term) -> tuple[TimeSeriesRegression, CoarseTimeSeries, BandNoise]:
    runs = [
        made(2 * mass + seed, GROOVED, terms, load_mass=float(mass), ride=RIDE)
        for mass in (10, 25)
        for seed in range(2)
    ]
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    coarse = coarse_regression(regression)
    assert coarse is not None
    none = np.zeros((regression.n_rows, 0))
    begun = Hypothesis()
    for own in terms:
        begun = begun.with_term(own, regression.n_runs)
    return regression, coarse, noise_from_repeats(regression, regression.residual(begun), none)


def test_it_has_one_run_of_each_set_and_a_sample_of_many() -> None:
    regression, coarse, _ = problem()
    assert coarse.regression.n_runs == 2
    assert coarse.regression.n_rows < regression.n_rows / 3
    assert not coarse.regression.replicates


def test_short_runs_have_none() -> None:
    runs = [made(seed, GROOVED, ride=Ride(samples=500)) for seed in range(2)]
    assert coarse_regression(TimeSeriesRegression(prepare(runs, GROOVED))) is None


def test_its_optimum_is_that_of_all_samples_within_its_own_uncertainty() -> None:
    regression, coarse, noise = problem(STIFF)
    start = Hypothesis().with_term(Term(STIFF.effect, STIFF.values), regression.n_runs)
    whole = fit(regression, start, noise.inverse_sigma(regression))
    weights = coarse.inverse_sigma(noise)
    found = fit(coarse.regression, coarse.reduced(start), weights)
    whitened = found.jacobian * weights[:, None]
    std = np.sqrt(np.diag(np.linalg.pinv(whitened.T @ whitened)))
    assert np.all(np.abs(found.vector - whole.vector) < 5 * std)


def test_a_fit_that_begins_on_it_ends_where_one_on_all_samples_does() -> None:
    regression, coarse, noise = problem(STIFF)
    effect, weights = STIFF.effect, noise.inverse_sigma(regression)
    begun = [
        Hypothesis().with_term(Term(effect, {"strain_scale": 1e-3, "force_scale": f}), 4)
        for f in (30.0, 1000.0)
    ]
    true = Hypothesis().with_term(Term(effect, STIFF.values), 4)
    best = fit(regression, true, weights)
    coarse_first = fit_from(
        regression, begun, weights, CoarseProblem(coarse, coarse.inverse_sigma(noise))
    )
    assert coarse_first.chi_square == pytest.approx(best.chi_square, abs=0.1)
    assert coarse_first.chi_square <= fit_from(regression, begun, weights).chi_square + 0.1


def test_initial_states_pass_to_the_repeats_and_back() -> None:
    _, coarse, _ = problem()
    states = (1.0, 2.0, 3.0, 4.0)
    whole = Hypothesis((DAHL, STIFF), (), (states, ()))
    assert coarse.reduced(whole).starts == ((1.0, 3.0), ())
    assert coarse.extended(coarse.reduced(whole)).starts == ((1.0, 1.0, 3.0, 3.0), ())


def test_a_rival_far_from_its_target_is_abandoned_and_the_truth_is_not() -> None:
    regression, coarse, noise = problem(STIFF)
    weights = noise.inverse_sigma(regression)
    begun = CoarseProblem(coarse, coarse.inverse_sigma(noise))
    before = fit(regression, Hypothesis(), weights)
    true = Hypothesis().with_term(Term(STIFF.effect, STIFF.values), 4)
    best = fit_from(regression, [true], weights, begun)
    target = RequiredChiSquare(best.chi_square, before.chi_square)
    rival = Hypothesis().with_term(term("motor-coulomb", torque=0.01), 4)
    assert fit_from(regression, [rival], weights, begun, target).abandoned
    assert not fit_from(regression, [true], weights, begun, target).abandoned

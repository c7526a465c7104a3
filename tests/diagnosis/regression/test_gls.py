"""The fit, against scipy's general solver on the same residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from diagnosis_runs import CATALOGUE, GROOVED, NOISE, Ride, made, term
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.gls import fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.term import Term
from winchkit.schema.profiles.winch import GuideSpec

RIDE = Ride(samples=400)
TRUE = {
    "one": (term("drum-radius", radius_error=4e-4),),
    "stiffness": (term("cable-elongation-linear", axial_stiffness=2e5),),
    "three": (
        term("cable-elongation-linear", axial_stiffness=1.5e5),
        term("motor-coulomb", torque=0.02),
        term("cell-gain", gain_error=0.02),
    ),
    "wave": (term("drum-eccentricity", eccentricity=4e-4, phase=1.0),),
    "memory": (term("pulley-dahl", friction=0.02, stiffness=3000.0),),
}


def problem_of(terms: tuple[Term, ...]) -> tuple[TimeSeriesRegression, np.ndarray]:
    runs = [
        made(2 * mass + seed, GROOVED, terms, load_mass=float(mass), ride=RIDE)
        for mass in (10, 25)
        for seed in range(2)
    ]
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    inverse_sigma = np.empty(regression.n_rows)
    for segment in regression.segments:
        inverse_sigma[segment.rows] = 1 / NOISE[segment.output]
    return regression, inverse_sigma


def test_a_fit_converges_along_a_curved_valley() -> None:
    """A guide's offset times its mismatch is seen at once, each of them only by the bend."""
    profile = replace(GROOVED, guide=GuideSpec(0.005))
    aside = term("guide-offset", offset=-0.09, mismatch=0.005)
    runs = [made(seed, profile, (aside,), ride=Ride(samples=800)) for seed in range(4)]
    regression = TimeSeriesRegression(prepare(runs, profile))
    inverse_sigma = np.concatenate(
        [np.full(s.rows.stop - s.rows.start, 1 / NOISE[s.output]) for s in regression.segments]
    )
    best = fit(regression, Hypothesis().with_term(aside, regression.n_runs), inverse_sigma)
    begun = [Term(aside.effect, aside.effect.null | probe) for probe in aside.effect.probes]
    found = [
        fit(regression, Hypothesis().with_term(b, regression.n_runs), inverse_sigma) for b in begun
    ]
    assert min(f.chi_square for f in found) == pytest.approx(best.chi_square, abs=1.0)


def from_usual(terms: tuple[Term, ...], regression: TimeSeriesRegression) -> Hypothesis:
    """The same effects at half their usual size, where a fit may begin."""
    start = Hypothesis()
    for true in terms:
        effect = CATALOGUE[true.effect.id]
        values = {
            p.name: 2 * p.typical if p.reciprocal else p.typical
            for p in effect.parameters
            if p.role != "fixed"
        }
        start = start.with_term(Term(effect, effect.null | values), regression.n_runs)
    return start


@pytest.mark.parametrize("name", TRUE)
def test_a_fit_agrees_with_scipy_least_squares(name: str) -> None:
    regression, inverse_sigma = problem_of(TRUE[name])
    start = from_usual(TRUE[name], regression)
    ours = fit(regression, start, inverse_sigma)
    low, high = regression.bounds(start)
    theirs = least_squares(
        lambda x: regression.residual(regression.hypothesis(x, start)) * inverse_sigma,
        np.clip(regression.vector(start), low, high),
        bounds=(low, high),
        x_scale="jac",
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
        max_nfev=60,
    )
    assert ours.n_unknowns == len(theirs.x)
    # Within a hundredth of what noise alone moves the sum of squares by.
    assert ours.chi_square == pytest.approx(2 * theirs.cost, abs=0.05)
    curvature = np.sqrt(np.diag(np.linalg.pinv(theirs.jac.T @ theirs.jac)))
    assert np.all(np.abs(ours.vector - theirs.x) < 0.25 * curvature + 1e-9)
    assert ours.chi_square == pytest.approx(regression.n_rows, rel=0.15)


@pytest.mark.parametrize("name", ["one", "stiffness", "three", "wave"])
def test_a_fit_recovers_the_true_values(name: str) -> None:
    regression, inverse_sigma = problem_of(TRUE[name])
    found = fit(regression, from_usual(TRUE[name], regression), inverse_sigma)
    for true, got in zip(TRUE[name], found.hypothesis.terms, strict=True):
        for parameter in true.effect.parameters:
            if parameter.role == "amplitude":
                usual = abs(parameter.typical)
                off = abs(got.values[parameter.name] - true.values[parameter.name])
                assert off < 0.1 * max(usual, abs(true.values[parameter.name]))


def test_a_fit_carries_its_own_residual_and_derivative() -> None:
    regression, inverse_sigma = problem_of(TRUE["three"])
    found = fit(regression, from_usual(TRUE["three"], regression), inverse_sigma)
    assert np.allclose(found.residual, regression.residual(found.hypothesis))
    assert found.chi_square == pytest.approx(float(np.sum((found.residual * inverse_sigma) ** 2)))
    assert found.labels == ("cable-elongation-linear", "motor-coulomb", "cell-gain")
    assert np.allclose(regression.vector(found.hypothesis), found.vector, rtol=1e-6)
    gradient = (found.jacobian * inverse_sigma[:, None]).T @ (found.residual * inverse_sigma)
    size = np.sqrt(np.sum((found.jacobian * inverse_sigma[:, None]) ** 2, axis=0))
    assert np.all(np.abs(gradient / size) < 0.5)


def test_bounds_are_kept() -> None:
    """Data that ask for a cable that shortens under load get one that does not stretch."""
    backwards = (term("cable-elongation-linear", axial_stiffness=2e5),)
    regression, inverse_sigma = problem_of(())
    stretch = regression.change(Hypothesis().with_term(backwards[0], regression.n_runs))
    regression.nominal_residual = regression.nominal_residual - stretch
    found = fit(regression, Hypothesis().with_term(backwards[0], regression.n_runs), inverse_sigma)
    assert found.hypothesis.terms[0].values["axial_stiffness"] > 1e9


def test_linearly_dependent_unknowns_stay_small() -> None:
    """A radius and a ratio do the same on a grooved drum: no kilometres are invented."""
    terms = (term("drum-radius", radius_error=3e-4), term("gear-ratio", ratio_error=0.0))
    regression, inverse_sigma = problem_of((terms[0],))
    start = Hypothesis()
    for item in terms:
        start = start.with_term(Term(item.effect, item.effect.null), regression.n_runs)
    found = fit(regression, start, inverse_sigma)
    assert found.chi_square == pytest.approx(regression.n_rows, rel=0.15)
    assert abs(found.hypothesis.terms[0].values["radius_error"]) < 1e-3


def test_the_derivative_is_that_of_the_prediction() -> None:
    regression, _ = problem_of(TRUE["three"])
    start = from_usual(TRUE["three"], regression)
    x = regression.vector(start)
    jacobian = regression.jacobian(x, start)
    here = regression.residual(start)
    for index in range(len(x)):
        moved = x.copy()
        moved[index] += 1e-5
        column = -(regression.residual(regression.hypothesis(moved, start)) - here) / 1e-5
        size = np.linalg.norm(column)
        assert size > 0
        assert np.linalg.norm(jacobian[:, index] - column) < 2e-3 * size

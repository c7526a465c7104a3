"""Statistics of a fit against the formulae of a linear regression with known noise."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.stats import chi2, norm

from diagnosis_runs import Array, Ride, engine_for, term
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import spread_of
from winchkit.diagnosis.verdict.fit_statistics import fit_statistics
from winchkit.fit_statistics import FitStatistics, correlations_of
from winchkit.plain_json import without_nan

TRUE = {"gain_error": 0.01, "offset": 1.0}


@pytest.fixture(scope="module")
def linear() -> tuple[FitStatistics, Array, Array]:
    """Statistics of a fit of gain and offset of a cell, its whitened derivatives and residual."""
    engine = engine_for(
        (term("cell-gain", gain_error=0.01), term("cell-offset", offset=1.0)), Ride()
    )
    regression = engine.regression
    initial, _ = engine.fit_with_noise(engine.initial_model)
    hypothesis = engine.initial_model
    for added in (term("cell-gain", gain_error=0.0), term("cell-offset", offset=0.0)):
        hypothesis = hypothesis.with_term(added, regression.n_runs)
    fit, noise = engine.fit_with_noise(hypothesis)
    spread = spread_of(regression, fit, noise, regression.blocks)
    found = fit_statistics(regression, initial, fit, noise, spread)
    assert found is not None
    return found, *_whitened(fit, noise.inverse_sigma(regression))


def _whitened(fit: Fit, inverse_sigma: Array) -> tuple[Array, Array]:
    measured = fit.residual + fit.jacobian @ fit.vector
    return fit.jacobian * inverse_sigma[:, None], measured * inverse_sigma


def test_chi_square_is_that_of_the_normal_equations(
    linear: tuple[FitStatistics, Array, Array],
) -> None:
    """χ² = yᵀ (1 − X (XᵀX)⁻¹ Xᵀ) y, from a QR decomposition, not from the fit's residual."""
    found, x, y = linear
    basis, _ = np.linalg.qr(x)
    expected = float(y @ y - np.sum((basis.T @ y) ** 2))
    assert found.chi_square == pytest.approx(expected, rel=1e-6)
    rows, p = x.shape
    n = found.n_observations
    # Samples at the ends of runs and beside steps of a layer are not compared.
    assert 0.99 * rows < n < rows
    assert (found.n_unknowns, found.dof) == (p, n - p)
    assert found.reduced_chi_square == pytest.approx(expected / (n - p), rel=1e-6)


def test_the_noise_of_the_simulation_gives_a_reduced_chi_square_of_one(
    linear: tuple[FitStatistics, Array, Array],
) -> None:
    found, _, _ = linear
    low, high = chi2(found.dof).interval(1 - 1e-6)
    # The noise is estimated from two repeats, so that its own variance is of that size.
    assert 0.8 * low < found.chi_square < 1.25 * high


def test_aic_and_bic_differ_between_models_as_their_likelihoods(
    linear: tuple[FitStatistics, Array, Array],
) -> None:
    """−2 ln L by scipy's normal density; its constant is the same for every model."""
    found, x, y = linear
    n, p = found.n_observations, x.shape[1]
    solution, *_ = np.linalg.lstsq(x, y, rcond=None)
    shorter, *_ = np.linalg.lstsq(x[:, :-1], y, rcond=None)
    whole = -2 * np.sum(norm.logpdf(y - x @ solution))
    part = -2 * np.sum(norm.logpdf(y - x[:, :-1] @ shorter))
    squares = float(np.sum((y - x[:, :-1] @ shorter) ** 2))
    other = FitStatistics((), 1.0, n_observations=n, n_unknowns=p - 1, chi_square=squares)
    assert other.aic - found.aic == pytest.approx(part - whole - 2, rel=1e-6)
    assert other.bic - found.bic == pytest.approx(part - whole - np.log(n), rel=1e-6)


def test_values_and_correlation_are_those_of_least_squares(
    linear: tuple[FitStatistics, Array, Array],
) -> None:
    found, x, y = linear
    solution, *_ = np.linalg.lstsq(x, y, rcond=None)
    covariance = np.linalg.inv(x.T @ x)
    sizes = 0.01, 5.0
    names = "cell-gain.gain_error", "cell-offset.offset"
    by_name = {parameter.name: parameter for parameter in found.parameters}
    for index, (name, size) in enumerate(zip(names, sizes, strict=True), start=-2):
        parameter = by_name[name]
        assert parameter.value == pytest.approx(solution[index] * size, rel=1e-4)
        # Never smaller than that of least squares: blocks of time and parts of the data may differ.
        assert parameter.std >= np.sqrt(covariance[index, index]) * size * (1 - 1e-6)
        assert parameter.std < 4 * np.sqrt(covariance[index, index]) * size
        assert parameter.interval is not None
        true = TRUE[name.partition(".")[2]]
        assert parameter.interval[0] < true < parameter.interval[1]
        assert parameter.initial == 0.0
    expected = covariance[-1, -2] / np.sqrt(covariance[-1, -1] * covariance[-2, -2])
    (pair,) = [c for c in found.correlations if {c.a, c.b} == set(names)]
    assert pair.value == pytest.approx(expected, rel=1e-4)


def test_plausible_ranges_are_those_that_the_effects_declare(
    linear: tuple[FitStatistics, Array, Array],
) -> None:
    found, _, _ = linear
    gain = next(p for p in found.parameters if p.name == "cell-gain.gain_error")
    declared = term("cell-gain", gain_error=0.0).effect.parameter("gain_error").plausible
    assert declared is not None
    assert gain.plausible == (declared.low, declared.high)


def test_the_report_and_the_json_have_every_figure(
    linear: tuple[FitStatistics, Array, Array],
) -> None:
    found, _, _ = linear
    text = found.text()
    headings = ["[[Fit Statistics]]", "[[Variables]]", "[[Correlations]]"]
    assert [line.split(" (")[0] for line in text.split("\n") if line.startswith("[[")] == headings
    for shown in (f"{found.chi_square:.6g}", f"{found.bic:.7g}", f"{found.dof}", "init = 0"):
        assert shown in text
    plain = json.loads(json.dumps(without_nan(found.to_json())))
    assert plain["dof"] == found.dof
    assert {"correlations", "condition", "aic", "bic", "parameters"} <= plain.keys()
    assert [p["name"] for p in plain["parameters"]] == [p.name for p in found.parameters]


def test_correlations_below_a_half_and_of_fixed_values_are_left_out() -> None:
    matrix = np.array([[4.0, 1.8, 0.0], [1.8, 1.0, 0.0], [0.0, 0.0, 0.0]])
    (pair,) = correlations_of(("a", "b", "c"), matrix)
    assert (pair.a, pair.b, pair.value) == ("a", "b", pytest.approx(0.9))
    assert correlations_of(("a", "b"), np.array([[1.0, 0.49], [0.49, 1.0]])) == ()


def test_without_degrees_of_freedom_the_reduced_chi_square_is_unknown() -> None:
    assert np.isnan(FitStatistics((), 1.0, n_observations=2, n_unknowns=2).reduced_chi_square)

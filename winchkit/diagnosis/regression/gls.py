"""Generalised least squares by the Levenberg-Marquardt method with bounds and several starts.

The fit minimises χ² = Σ (rᵢ/σᵢ)², the sum of squared whitened residuals. The normal equations are
solved in scaled form, directions that the data do not determine are left out (truncated
eigenvalues), and the iteration stops where it would reduce χ² by less than 0.02. With 10⁵ rows and
a handful of unknowns this is about ten times faster than a general solver.

References
----------
Marquardt, D. W. (1963). An algorithm for least-squares estimation of nonlinear parameters. J. Soc.
Ind. Appl. Math. 11, 431-441.
Aitken, A. C. (1935). On least squares and linear combination of observations. Proc. R. Soc. Edinb.
55, 42-48.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Coarse, Regression
from winchkit.diagnosis.regression.hypothesis import Hypothesis

__all__ = ["CoarseProblem", "Fit", "Target", "fit", "fit_from", "starts_from_coarse_fits"]

_ITERATIONS = 15
_ITERATIONS_OF_PRODUCTS = 40
_LEAST_DECREASE = 0.02
_LEAST_EIGENVALUE = 1e-9
_FIRST_ITERATIONS = 8
_KEPT_STARTS = 2
_TOLERANCE = 1e-5
_DISTINCT = 0.02
_AMBIGUOUS = 4.0
_SHARE_LEFT = 0.1
_PER_UNKNOWN = 40.0


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes
    ----------
    hypothesis : Hypothesis
        Effects, nuisance parameters and initial states at their fitted values.
    vector : ndarray of shape (n_unknowns,)
        The same as a vector of unknowns.
    residual : ndarray of shape (n_rows,)
        Measured minus predicted, not whitened.
    jacobian : ndarray of shape (n_rows, n_unknowns)
        Derivative of the prediction, not whitened.
    chi_square : float
        Sum of squared whitened residuals.
    n_unknowns : int
        Number of unknowns.
    abandoned : bool
        Whether the fit was given up far from its target: then it has no Jacobian.
    """

    hypothesis: Hypothesis
    vector: Array
    residual: Array
    jacobian: Array
    chi_square: float
    n_unknowns: int
    abandoned: bool = False

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the effects."""
        return tuple(term.label for term in self.hypothesis.terms)


def fit(
    regression: Regression,
    start: Hypothesis,
    inverse_sigma: Array,
    most: int | None = None,
    tolerance: float = 0.0,
) -> Fit:
    """Fit all unknowns within their bounds.

    Parameters
    ----------
    regression
        The data and the model.
    start
        Hypothesis at the starting values.
    inverse_sigma
        1/σ of every row, shape (n_rows,).
    most
        Maximum number of iterations; by default 15, or 40 for an effect whose parameters act by
        their product.
    tolerance
        Share of χ² beyond the number of rows whose decrease ends the iteration, where that is more
        than 0.02: a model that misses by thousands is not fitted to the last hundredth.

    Returns
    -------
    Fit
        The best point reached; the fit has converged unless the number of iterations was the limit.
    """
    x = regression.vector(start)
    low, high = regression.bounds(start)
    x = np.clip(x, low, high)
    residual = regression.residual(regression.hypothesis(x, start))
    chi_square = _chi_square(residual, inverse_sigma)
    damping = 1e-6
    jacobian = regression.jacobian(x, start)
    for _ in range((_iterations(start) if most is None else most) if len(x) else 0):
        step, expected_decrease = _step(
            jacobian * inverse_sigma[:, None], residual * inverse_sigma, damping, x, (low, high)
        )
        least = max(_LEAST_DECREASE, tolerance * (chi_square - len(residual)))
        if expected_decrease < least:
            break
        trial = np.clip(x + step, low, high)
        residual_there = regression.residual(regression.hypothesis(trial, start))
        new = _chi_square(residual_there, inverse_sigma)
        if new < chi_square:
            decrease = chi_square - new
            x, residual, chi_square, damping = trial, residual_there, new, damping / 10
            jacobian = regression.jacobian(x, start)
            if decrease < least:
                break
        else:
            damping = max(damping * 100, 1e-4)
            if damping > 1e6:
                break
    fitted = regression.hypothesis(x, start)
    return Fit(fitted, x, residual, jacobian, chi_square, len(x))


@dataclass(frozen=True)
class Target:
    """A χ² that a fit has to reach to be of use."""

    chi_square: float
    before: float
    """χ² before the effect was added."""

    def is_out_of_reach(self, chi_square: float, n_unknowns: int) -> bool:
        """Whether a fit that starts at the optimum of the coarse regression is abandoned.

        It has to miss by more than a tenth of the χ² explained so far, and by 40 per unknown: the
        optimum of a twentieth of the data is off by a χ² of twenty per unknown on average.
        """
        gained = max(0.0, self.before - chi_square)
        return chi_square - self.chi_square > _SHARE_LEFT * gained + _PER_UNKNOWN * n_unknowns


@dataclass(frozen=True)
class CoarseProblem:
    """A coarse regression with its weights."""

    coarse: Coarse
    inverse_sigma: Array
    """1/σ of every row of the coarse regression."""


def starts_from_coarse_fits(
    regression: Regression,
    starts: Sequence[Hypothesis],
    inverse_sigma: Array,
    problem: CoarseProblem,
) -> list[Hypothesis] | None:
    """Optima of the coarse regression as starting values, best first, two at most.

    None where one of the given starting values has a smaller χ² on all samples.

    Parameters
    ----------
    regression
        The data and the model.
    starts
        Hypotheses of the same effects at several starting values.
    inverse_sigma
        1/σ of every row, shape (n_rows,).
    problem
        The coarse regression.
    """
    coarse = problem.coarse
    reduced = [coarse.reduced(start) for start in starts]
    fits = _first_fits(coarse.regression, reduced, problem.inverse_sigma, _ITERATIONS)
    best = fits[0]
    near = [
        fitted
        for fitted in fits[1:]
        if _DISTINCT < fitted.chi_square - best.chi_square < _AMBIGUOUS
    ]
    out = [coarse.extended(fitted.hypothesis) for fitted in (best, *near[:1])]

    def chi_square(hypothesis: Hypothesis) -> float:
        return _chi_square(regression.residual(hypothesis), inverse_sigma)

    return out if chi_square(out[0]) <= min(map(chi_square, starts)) else None


def fit_from(
    regression: Regression,
    starts: Sequence[Hypothesis],
    inverse_sigma: Array,
    problem: CoarseProblem | None = None,
    target: Target | None = None,
    *,
    optimum: bool = False,
) -> Fit:
    """Fit from several starting values and keep the smallest χ².

    Of more than two starts only the two best after eight iterations are fitted to the end.

    Parameters
    ----------
    regression
        The data and the model.
    starts
        Hypotheses of the same effects at several starting values.
    inverse_sigma
        1/σ of every row, shape (n_rows,).
    problem
        Coarse regression, on which the best starting values are found; None for none.
    target
        The fit is abandoned at the optimum of the coarse regression, or at starting values that are
        an optimum, if this χ² is out of reach; None: never.
    optimum
        Whether the only starting values are an optimum that was found before.
    """
    found = list(starts) if optimum else None
    if problem is not None:
        found = starts_from_coarse_fits(regression, starts, inverse_sigma, problem)
    if found is not None and target is not None:
        first = _at(regression, found[0], inverse_sigma)
        if target.is_out_of_reach(first.chi_square, first.n_unknowns):
            return first
    if found is not None and problem is not None:
        return _best(regression, found, inverse_sigma, _ITERATIONS)[0]
    return _first_fits(regression, starts, inverse_sigma)[0]


def _at(regression: Regression, hypothesis: Hypothesis, inverse_sigma: Array) -> Fit:
    """A hypothesis at its values, without Jacobian."""
    residual, vector = regression.residual(hypothesis), regression.vector(hypothesis)
    nothing = np.zeros((regression.n_rows, 0))
    chi_square = _chi_square(residual, inverse_sigma)
    return Fit(hypothesis, vector, residual, nothing, chi_square, len(vector), abandoned=True)


def _first_fits(
    regression: Regression,
    starts: Sequence[Hypothesis],
    inverse_sigma: Array,
    most: int | None = None,
) -> list[Fit]:
    """Fits from the best starting values, smallest χ² first."""
    if len(starts) > _KEPT_STARTS:
        first_fits = _best(regression, starts, inverse_sigma, _FIRST_ITERATIONS)
        starts = [fitted.hypothesis for fitted in first_fits[:_KEPT_STARTS]]
    return _best(regression, starts, inverse_sigma, most)


def _best(
    regression: Regression,
    starts: Sequence[Hypothesis],
    inverse_sigma: Array,
    most: int | None = None,
) -> list[Fit]:
    """Fits from every starting value, smallest χ² first."""
    fits = [fit(regression, start, inverse_sigma, most, _TOLERANCE) for start in starts]
    return sorted(fits, key=lambda fitted: fitted.chi_square)


def _iterations(start: Hypothesis) -> int:
    """Maximum number of iterations: more where the last effect's parameters act by their product.

    Such an effect has probes, since none of its parameters changes the prediction alone; χ² then
    has a curved valley along which the iteration is slow.
    """
    return _ITERATIONS_OF_PRODUCTS if start.terms and start.terms[-1].effect.probes else _ITERATIONS


def _chi_square(residual: Array, inverse_sigma: Array) -> float:
    whitened = residual * inverse_sigma
    return float(whitened @ whitened)


def _step(
    whitened: Array, residual: Array, damping: float, x: Array, bounds: tuple[Array, Array]
) -> tuple[Array, float]:
    """Damped Gauss-Newton step of the unknowns away from their bounds, and its expected Δχ²."""
    low, high = bounds
    gradient = whitened.T @ residual
    normal = whitened.T @ whitened
    at_bound = ((x <= low) & (gradient < 0)) | ((x >= high) & (gradient > 0))
    free = ~at_bound & (np.diag(normal) > 0)
    step = np.zeros_like(x)
    if not free.any():
        return step, 0.0
    inner = normal[np.ix_(free, free)]
    scale = np.sqrt(np.diag(inner))
    scaled = inner / np.outer(scale, scale)
    # Linearly dependent unknowns stay where they are: truncated eigenvalues.
    values, vectors = np.linalg.eigh(scaled)
    kept = values > _LEAST_EIGENVALUE * values[-1]
    along = vectors[:, kept].T @ (gradient[free] / scale)
    step[free] = (vectors[:, kept] @ (along / (values[kept] + damping))) / scale
    return step, float(np.sum(along**2 / (values[kept] + damping)))

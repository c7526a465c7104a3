"""Generalised least squares in a trust region (Levenberg-Marquardt), with bounds, several starts.

The fit minimises χ² = Σ (rᵢ/σᵢ)². The damping of a step follows from the radius within which the
linear model is trusted (Moré). Directions that the data do not determine are left out (truncated
eigenvalues of the scaled normal equations), and the iteration stops where it would reduce χ² by
less than 0.02. With 10⁵ rows and a handful of unknowns this is about ten times faster than a
general solver.

References
----------
Marquardt, D. W. (1963). An algorithm for least-squares estimation of nonlinear parameters. J. Soc.
Ind. Appl. Math. 11, 431-441.
Moré, J. J. (1978). The Levenberg-Marquardt algorithm: implementation and theory. Lecture Notes in
Mathematics 630, 105-116.
Aitken, A. C. (1935). On least squares and linear combination of observations. Proc. R. Soc. Edinb.
55, 42-48.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Coarse, Regression
from winchkit.diagnosis.regression.hypothesis import Hypothesis

_ITERATIONS = 15
"""Steps of a fit; measured: 6 of 296 fits ended there."""
_ITERATIONS_OF_PRODUCTS = 40
"""The same where unknowns act by their product; measured: 4 of 43 fits ended there;
half of these fits take 4 steps or fewer."""
_LEAST_DECREASE = 0.02
"""Promised or reached decrease of χ² at which a fit stops; theory: small beside every decision (the
smallest difference that decides is 2)."""
_LEAST_EIGENVALUE = 1e-9
"""Eigenvalues of the scaled normal matrix below this share of the largest are not solved for;
numerical; see Numerical accuracy."""
_LEAST_DAMPING = 1e-6
"""Damping of the first step, in units of the scaled eigenvalues; a tenth after each step that
succeeds; numerical: a step that the radius does not limit is a Gauss–Newton step."""
_ROWS = 16384
"""Rows that are whitened at once; memory."""
_FIRST_ITERATIONS = 8
"""Steps of a first look from several starts; computing cost, rule of thumb."""
_KEPT_STARTS = 2
"""Starts that are fitted to the end; computing cost, rule of thumb."""
_TOLERANCE = 1e-4
"""Share of χ² beyond the number of rows at which the fit of a trial stops, where that is more than
0.02; computing cost: the same share of the lack of fit decides nothing."""
_COARSE_TOLERANCE = 1e-3
"""The same on the coarse regression; computing cost: the fit on all samples begins there."""
_MOST_FAILURES = 6
"""Steps that fail one after another, at which a fit stops; computing cost: the last is below 2 % of
the first."""
_SETTLED = 4
"""Steps from which a fit is also judged by its latest decrease; screened."""
_DISTINCT = 0.02
"""Difference of χ² from which two optima of the coarse regression count as two; numerical:
`_LEAST_DECREASE`."""
_AMBIGUOUS = 4.0
"""Difference of χ² of the coarse regression up to which the second best optimum is also fitted on
all samples; theory: two standard deviations of one unknown."""
_SHARE_LEFT = 0.1
"""Share of the χ² explained at the coarse optimum that the fit on all samples may gain on top;
screened."""
_PER_UNKNOWN = 40.0
"""χ² per unknown that it may gain in any case; theory: twice the χ² of an optimum of a twentieth of
the rows."""
_STEPS_LEFT = 10.0
"""Decreases promised by the next step that a fit may gain altogether; screened."""
_SLACK_PER_UNKNOWN = 10.0
"""χ² per unknown that it may gain in any case; screened: three standard deviations of each
unknown."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted hypothesis, with the vector of its unknowns, (n_unknowns,)."""

    hypothesis: Hypothesis
    vector: Array
    residual: Array
    """Measured minus predicted, not whitened, (n_rows,)."""
    derivative: Callable[[], Array]
    chi_square: float
    n_unknowns: int
    abandoned: bool = False
    """Whether the fit was given up far from its target."""
    converged: bool = False
    """Whether the next step promised, or the last one brought, no decrease of χ² that counts."""
    iterations: int = 0
    """Number of steps that were tried."""
    rank: int = 0
    """Number of unknowns, less the directions that the last linearisation does not determine."""

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of the prediction, not whitened, (n_rows, n_unknowns), computed when first
        needed: of most rivals only χ² is compared."""
        return self.derivative()

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the effects."""
        return tuple(term.label for term in self.hypothesis.terms)


def fit(
    regression: Regression,
    start: Hypothesis,
    inverse_sigma: Array,
    most: int | None = None,
    *,
    tolerance: float = 0.0,
    aim: float = np.inf,
) -> Fit:
    """Fit all unknowns within their bounds, to the best point reached.

    ``inverse_sigma`` is 1/σ of every row. ``most`` is 15 iterations by default, or 40 for an
    effect whose parameters act by their product. ``tolerance`` is the share of χ² beyond the number
    of rows whose decrease ends the iteration, where that is more than 0.02: a model that misses by
    thousands is not fitted to the last hundredth. The iteration also ends where ten times the
    decrease that its next step promises, or twice the latest one in every step that is left, and
    ten per unknown would not reach the χ² ``aim``.

    Trust region in the unknowns scaled by the lengths of their columns. A step that does not reduce
    χ² is shortened to the minimum of the parabola through both values and the slope.
    """
    low, high = regression.bounds(start)
    x = np.clip(regression.vector(start), low, high)
    residual = regression.residual(regression.hypothesis(x, start))
    chi_square = _chi_square(residual, inverse_sigma)
    region = _TrustRegion()
    local: _LocalModel | None = None
    failures, latest = 0, np.inf
    limit = (_iterations(start) if most is None else most) if len(x) else 0
    converged, iterations, rank = not len(x), 0, 0
    for iteration in range(limit):
        if local is None:
            jacobian = regression.jacobian(x, start)
            local = _LocalModel(jacobian, residual, inverse_sigma, x, (low, high))
            rank = local.rank
            promised = _STEPS_LEFT * local.step(_TrustRegion()).decrease
            if iteration >= _SETTLED:
                promised = min(promised, 2 * (limit - iteration) * latest)
            if chi_square - promised - _SLACK_PER_UNKNOWN * len(x) > aim:
                break
        least = max(_LEAST_DECREASE, tolerance * (chi_square - len(residual)))
        step = local.step(region)
        if step.decrease < least:
            converged = True
            break
        iterations += 1
        trial = np.clip(x + step.change, low, high)
        residual_there = regression.residual(regression.hypothesis(trial, start))
        new = _chi_square(residual_there, inverse_sigma)
        region = region.after(step, chi_square - new)
        if not new < chi_square:
            failures += 1
            if failures == _MOST_FAILURES:
                break
        else:
            failures, latest = 0, chi_square - new
            x, residual, chi_square, local = trial, residual_there, new, None
            if latest < least:
                converged = True
                break
    fitted = regression.hypothesis(x, start)
    known = None if local is None else jacobian
    return Fit(
        fitted,
        x,
        residual,
        _derivative(regression, x, start, known),
        chi_square,
        len(x),
        converged=converged,
        iterations=iterations,
        rank=rank,
    )


def _derivative(
    regression: Regression, x: Array, like: Hypothesis, known: Array | None = None
) -> Callable[[], Array]:
    """Jacobian when it is needed, where it is not known already."""
    return (lambda: regression.jacobian(x, like)) if known is None else (lambda: known)


@dataclass(frozen=True)
class RequiredChiSquare:
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

    None where one of the given starting values has a smaller χ² on all samples: the coarse
    regression is then no guide to which of them leads to the smallest.
    """
    coarse = problem.coarse
    reduced = [coarse.reduced(start) for start in starts]
    fits = _first_fits(
        coarse.regression,
        reduced,
        problem.inverse_sigma,
        _ITERATIONS,
        tolerance=_COARSE_TOLERANCE,
    )
    best = fits[0]
    near = [
        fitted
        for fitted in fits[1:]
        if _DISTINCT < fitted.chi_square - best.chi_square < _AMBIGUOUS
    ]

    def chi_square(hypothesis: Hypothesis) -> float:
        return _chi_square(regression.residual(hypothesis), inverse_sigma)

    first = coarse.extended(best.hypothesis)
    if min(map(chi_square, starts)) < chi_square(first):
        return None
    return [first, *(coarse.extended(fitted.hypothesis) for fitted in near[:1])]


def fit_from(
    regression: Regression,
    starts: Sequence[Hypothesis],
    inverse_sigma: Array,
    problem: CoarseProblem | None = None,
    target: RequiredChiSquare | None = None,
    *,
    aim: float | None = None,
) -> Fit:
    """Fit from several starting values and keep the smallest χ².

    ``problem`` is the coarse regression on which the best starting values are found. Of more than
    two starts only the two best after eight iterations are fitted to the end. The fit is abandoned
    at the optimum of the coarse regression, and on the way, if the χ² ``target`` is out of reach;
    ``aim`` is the χ² that decides on the fit, by default the target's.
    """
    found = problem and starts_from_coarse_fits(regression, starts, inverse_sigma, problem)
    if found and target is not None:
        first = evaluated(regression, found[0], inverse_sigma)
        if target.is_out_of_reach(first.chi_square, first.n_unknowns):
            return first
    if aim is None:
        aim = np.inf if target is None else target.chi_square
    if found:
        best = _best(regression, found, inverse_sigma, _ITERATIONS, aim=aim)[0]
    else:
        best = _first_fits(regression, starts, inverse_sigma, aim=aim)[0]
    if target is None or not target.is_out_of_reach(best.chi_square, best.n_unknowns):
        return best
    return replace(best, abandoned=True)


def evaluated(regression: Regression, hypothesis: Hypothesis, inverse_sigma: Array) -> Fit:
    """A hypothesis at its values, not fitted."""
    residual, vector = regression.residual(hypothesis), regression.vector(hypothesis)
    derivative = _derivative(regression, vector, hypothesis)
    chi_square = _chi_square(residual, inverse_sigma)
    return Fit(hypothesis, vector, residual, derivative, chi_square, len(vector), abandoned=True)


def _first_fits(
    regression: Regression,
    starts: Sequence[Hypothesis],
    inverse_sigma: Array,
    most: int | None = None,
    *,
    aim: float = np.inf,
    tolerance: float = _TOLERANCE,
) -> list[Fit]:
    """Fits from the best starting values, smallest χ² first."""
    if len(starts) > _KEPT_STARTS:
        first_fits = _best(
            regression, starts, inverse_sigma, _FIRST_ITERATIONS, aim=aim, tolerance=tolerance
        )
        starts = [fitted.hypothesis for fitted in first_fits[:_KEPT_STARTS]]
    return _best(regression, starts, inverse_sigma, most, aim=aim, tolerance=tolerance)


def _best(
    regression: Regression,
    starts: Sequence[Hypothesis],
    inverse_sigma: Array,
    most: int | None = None,
    *,
    aim: float = np.inf,
    tolerance: float = _TOLERANCE,
) -> list[Fit]:
    """Fits from every starting value, smallest χ² first."""
    fits = [
        fit(regression, start, inverse_sigma, most, tolerance=tolerance, aim=aim)
        for start in starts
    ]
    return sorted(fits, key=lambda fitted: fitted.chi_square)


def _iterations(start: Hypothesis) -> int:
    """Maximum number of iterations: more where the last effect's parameters act by their product.

    Such an effect has probes, since none of its parameters changes the prediction alone; χ² then
    has a curved valley along which the iteration is slow.
    """
    return _ITERATIONS_OF_PRODUCTS if start.terms and start.terms[-1].effect.probes else _ITERATIONS


def _chi_square(residual: Array, inverse_sigma: Array) -> float:
    with np.errstate(over="ignore"):  # Infinite far from the minimum: the step has failed.
        whitened = residual * inverse_sigma
        return float(whitened @ whitened)


@dataclass(frozen=True)
class _UnknownsStep:
    """A step of the unknowns."""

    change: Array
    decrease: float
    """Decrease of χ² that the local model promises."""
    slope: float
    """Decrease of χ² per step at its beginning."""
    length: float
    """In the scaled unknowns."""


@dataclass(frozen=True)
class _TrustRegion:
    """Region in which the local model is trusted."""

    radius: float = np.inf
    damping: float = _LEAST_DAMPING
    """Least damping, of nearly dependent unknowns."""

    def after(self, step: _UnknownsStep, decrease: float) -> _TrustRegion:
        """Region after a step with a decrease of χ², which is negative where it failed."""
        if not decrease > 0.0:
            bend = step.slope - decrease
            share = step.slope / (2 * bend) if np.isfinite(bend) else 0.0
            return _TrustRegion(step.length * float(np.clip(share, 0.05, 0.5)), self.damping)
        ratio, radius = decrease / step.decrease, self.radius
        if ratio < 0.25:
            radius = step.length / 2
        elif ratio > 0.75:
            radius = np.inf if step.length < 0.9 * radius else 2 * step.length
        return _TrustRegion(radius, self.damping / 10)


class _LocalModel:
    """Linearised model about a point: Gauss-Newton steps of the unknowns away from their bounds."""

    def __init__(
        self,
        jacobian: Array,
        residual: Array,
        inverse_sigma: Array,
        x: Array,
        bounds: tuple[Array, Array],
    ) -> None:
        gradient, normal = _normal_equations(jacobian, residual, inverse_sigma)
        held = beyond_bounds(x, bounds, gradient)
        self._free = ~held & (np.diag(normal) > 0)
        inner = normal[np.ix_(self._free, self._free)]
        self._scale = np.sqrt(np.diag(inner))
        scaled = inner / np.outer(self._scale, self._scale)
        # Linearly dependent unknowns stay where they are: truncated eigenvalues.
        values, vectors = np.linalg.eigh(scaled) if len(scaled) else (np.zeros(0), scaled)
        kept = values > _LEAST_EIGENVALUE * np.max(values, initial=0.0)
        self.rank = int(np.count_nonzero(kept) + np.count_nonzero(held & (np.diag(normal) > 0)))
        self._values, self._vectors = values[kept], vectors[:, kept]
        self._along = self._vectors.T @ (gradient[self._free] / self._scale)

    def step(self, region: _TrustRegion) -> _UnknownsStep:
        """Step to the minimum of the local model within a region."""
        damping, along = self._damping(region), self._along
        damped = self._values + damping
        turned = along / damped
        change = np.zeros(len(self._free))
        change[self._free] = (self._vectors @ turned) / self._scale
        decrease = float(np.sum(along**2 * (damped + damping) / damped**2))
        length = float(np.sqrt(turned @ turned))
        return _UnknownsStep(change, decrease, 2 * float(along @ turned), length)

    def _damping(self, region: _TrustRegion) -> float:
        """Least damping with which the step ends within the region."""

        def length(damping: float) -> float:
            return float(np.linalg.norm(self._along / (self._values + damping)))

        if length(region.damping) <= region.radius:
            return region.damping
        low, high = region.damping, float(np.linalg.norm(self._along)) / region.radius
        while high > 1.05 * low:
            middle = np.sqrt(low * high)
            low, high = (middle, high) if length(middle) > region.radius else (low, middle)
        return high


def beyond_bounds(x: Array, bounds: tuple[Array, Array], gradient: Array) -> NDArray[np.bool_]:
    """Mask of the unknowns at a bound beyond which χ² would fall, (n_unknowns,): they stay there.

    ``gradient`` is that of the fit, Jacobianᵀ times residual, both whitened.
    """
    low, high = bounds
    return np.asarray(((x <= low) & (gradient < 0)) | ((x >= high) & (gradient > 0)))


def _normal_equations(
    jacobian: Array, residual: Array, inverse_sigma: Array
) -> tuple[Array, Array]:
    """Whitened gradient, (n_unknowns,), and normal matrix, without a whitened copy."""
    count = jacobian.shape[1]
    gradient, normal = np.zeros(count), np.zeros((count, count))
    for first in range(0, len(residual), _ROWS):
        rows = slice(first, first + _ROWS)
        whitened = jacobian[rows].T * inverse_sigma[rows]
        gradient += whitened @ (residual[rows] * inverse_sigma[rows])
        normal += whitened @ whitened.T
    return gradient, normal

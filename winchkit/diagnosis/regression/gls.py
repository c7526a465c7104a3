"""Generalised least squares: a hypothesis fitted to whitened residuals (Levenberg–Marquardt).

Own code, because a whitened residual of 10⁵ rows has a handful of unknowns: normal equations
with a tolerance in units of χ² are ten times quicker here than a general solver.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.hypothesis import Hypothesis

__all__ = ["Fit", "fit", "fit_from"]

_ITERATIONS = 15
_PATIENT = 40
_ENOUGH = 0.02
_FORGET = 1e-9
_LOOK = 8
_PROMISING = 2


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis with its whitened residual and derivative."""

    hypothesis: Hypothesis
    vector: Array
    residual: Array
    """Unwhitened, rows."""
    jacobian: Array
    """Of the prediction, unwhitened, (rows, unknowns)."""
    chi_square: float
    """Sum of whitened squares."""
    n_unknowns: int

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of its terms."""
        return tuple(term.label for term in self.hypothesis.terms)


def fit(
    regression: Regression, start: Hypothesis, inverse_sigma: Array, most: int | None = None
) -> Fit:
    """Fit all unknowns from ``start``; ``weight`` is 1/σ per row. Bounds are kept.

    ``most`` is how many steps it may take, by default as many as are worth walking.
    """
    x = regression.vector(start)
    low, high = regression.bounds(start)
    x = np.clip(x, low, high)
    residual = regression.residual(regression.hypothesis(x, start))
    chi_square = _chi_square(residual, inverse_sigma)
    damping = 1e-6
    jacobian = regression.jacobian(x, start)
    for _ in range((_iterations(start) if most is None else most) if len(x) else 0):
        step, promised = _step(
            jacobian * inverse_sigma[:, None], residual * inverse_sigma, damping, x, (low, high)
        )
        if promised < _ENOUGH:
            break
        trial = np.clip(x + step, low, high)
        there = regression.residual(regression.hypothesis(trial, start))
        new = _chi_square(there, inverse_sigma)
        if new < chi_square:
            gained = chi_square - new
            x, residual, chi_square, damping = trial, there, new, damping / 10
            jacobian = regression.jacobian(x, start)
            if gained < _ENOUGH:
                break
        else:
            damping = max(damping * 100, 1e-4)
            if damping > 1e6:
                break
    fitted = regression.hypothesis(x, start)
    return Fit(fitted, x, residual, jacobian, chi_square, len(x))


def fit_from(regression: Regression, starts: Sequence[Hypothesis], inverse_sigma: Array) -> Fit:
    """The best fit from several starts; after a first look only from the most promising ones."""
    if len(starts) > _PROMISING:
        looked = [fit(regression, start, inverse_sigma, _LOOK) for start in starts]
        looked.sort(key=lambda fitted: fitted.chi_square)
        starts = [fitted.hypothesis for fitted in looked[:_PROMISING]]
    return min(
        (fit(regression, start, inverse_sigma) for start in starts),
        key=lambda fitted: fitted.chi_square,
    )


def _iterations(start: Hypothesis) -> int:
    """How many steps a fit may take: more where the last term's unknowns act by their product.

    Such a term has probes, since none of its unknowns does anything alone, and its squares lie
    in a bent valley: walked slowly, worth walking when it is the one that is tried.
    """
    return _PATIENT if start.terms and start.terms[-1].effect.probes else _ITERATIONS


def _chi_square(residual: Array, inverse_sigma: Array) -> float:
    whitened = residual * inverse_sigma
    return float(whitened @ whitened)


def _step(
    whitened: Array, residual: Array, damping: float, x: Array, bounds: tuple[Array, Array]
) -> tuple[Array, float]:
    """Damped Gauss–Newton step among the unknowns that can move, and the χ² it promises."""
    low, high = bounds
    gradient = whitened.T @ residual
    normal = whitened.T @ whitened
    stuck = ((x <= low) & (gradient < 0)) | ((x >= high) & (gradient > 0))
    free = ~stuck & (np.diag(normal) > 0)
    step = np.zeros_like(x)
    if not free.any():
        return step, 0.0
    inner = normal[np.ix_(free, free)]
    scale = np.sqrt(np.diag(inner))
    scaled = inner / np.outer(scale, scale)
    # Unknowns that the data cannot tell apart are left where they are: a truncated solution.
    values, vectors = np.linalg.eigh(scaled)
    kept = values > _FORGET * values[-1]
    along = vectors[:, kept].T @ (gradient[free] / scale)
    step[free] = (vectors[:, kept] @ (along / (values[kept] + damping))) / scale
    return step, float(np.sum(along**2 / (values[kept] + damping)))

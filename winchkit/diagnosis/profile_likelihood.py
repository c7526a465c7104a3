"""Profile likelihood: how far one unknown may move before the rest can no longer make up for it.

Where a model is linear the ends are those of the covariance; a friction's shape, a lag or a gap
is not, and its interval is longer to one side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.problem import Problem

__all__ = ["profile_ends"]

Array = NDArray[np.float64]
_LINEAR = 0.15
_SEARCHES = 4
_FARTHEST = 4.0


def profile_ends(
    problem: Problem, fit: Fit, weight: Array, covariance: Array, reach: Array
) -> tuple[Array, Array]:
    """Where the whitened squares have risen by ``reach``² with all else refitted; two (unknowns,).

    ``weight`` is 1/σ per row, ``covariance`` (unknowns, unknowns) that of the linearised fit,
    ``reach`` (unknowns,) in its standard deviations. Only the coordinates of terms are moved:
    nuisances are linear, and nobody asks for the state in which a run began.
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    low, high = fit.vector - reach * deviation, fit.vector + reach * deviation
    bounds = problem.bounds(fit.hypothesis)
    first = problem.nuisance_columns.shape[1]
    states = sum(len(start) for start in fit.hypothesis.starts)
    for index in range(first, len(fit.vector) - states):
        if deviation[index] > 0.0:
            walk = _Walk(problem, fit, weight, covariance, index)
            low[index] = fit.vector[index] - walk.length(-1.0, reach[index])
            high[index] = fit.vector[index] + walk.length(1.0, reach[index])
    return np.clip(low, *bounds), np.clip(high, *bounds)


class _Walk:
    """Away from a fit along one unknown, the others following."""

    def __init__(
        self, problem: Problem, fit: Fit, weight: Array, covariance: Array, index: int
    ) -> None:
        self._problem, self._fit, self._weight, self._index = problem, fit, weight, index
        self._deviation = float(np.sqrt(covariance[index, index]))
        self._along = covariance[:, index] / covariance[index, index]
        others = np.arange(len(covariance)) != index
        whitened = fit.jacobian[:, others] * weight[:, None]
        normal = np.linalg.pinv(whitened.T @ whitened, rcond=1e-12, hermitian=True)
        self._others, self._whitened, self._normal = others, whitened, normal
        self._bounds = problem.bounds(fit.hypothesis)

    def length(self, side: float, reach: float) -> float:
        """How far one may go, in the unknown's coordinate."""
        usual = reach * self._deviation
        wanted, far = reach**2, usual
        for _ in range(_SEARCHES):
            risen = self._risen(side * far, wanted)
            if abs(risen / wanted - 1) < _LINEAR:
                break
            # Squares rise with the square of the way, or nearly so.
            far *= float(np.clip(np.sqrt(wanted / max(risen, 1e-9)), 0.3, 2.0))
            if far > _FARTHEST * usual:
                return _FARTHEST * usual
        return far

    def _risen(self, moved: float, wanted: float) -> float:
        """By how much the whitened squares rise, the others corrected once where it matters."""
        low, high = self._bounds
        vector = np.clip(self._fit.vector + moved * self._along, low, high)
        residual = self._residual(vector)
        risen = float(residual @ residual) - self._fit.cost
        if risen < (1 + _LINEAR) * wanted:
            return risen
        step = np.zeros_like(vector)
        step[self._others] = self._normal @ (self._whitened.T @ residual)
        corrected = self._residual(np.clip(vector + step, low, high))
        return min(risen, float(corrected @ corrected) - self._fit.cost)

    def _residual(self, vector: Array) -> Array:
        like = self._fit.hypothesis
        return self._problem.residual(self._problem.hypothesis(vector, like)) * self._weight

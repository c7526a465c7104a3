"""Partial pooling of one parameter over winches, and winches that differ from the others.

The value of winch w is μ + b + e with b ~ N(0, τ²) between winches and e of known variance. μ and
τ² are estimated by restricted maximum likelihood, the value of each winch by its best linear
unbiased prediction, beside its own estimate. A winch is tested against the others by a robust
variance between winches, so that odd winches do not hide themselves or each other.

References
----------
Patterson, H. D., Thompson, R. (1971). Recovery of inter-block information when block sizes are
unequal. Biometrika 58, 545-554.
Robinson, G. K. (1991). That BLUP is a good thing. Stat. Sci. 6, 15-32.
Prasad, N. G. N., Rao, J. N. K. (1990). The estimation of the mean squared error of small-area
estimators. J. Am. Stat. Assoc. 85, 163-171.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import stdtr

from winchkit.arrays import Array
from winchkit.diagnosis.fleet.robust_variance import robust_variance

__all__ = ["PartialPooling", "odd_p_values", "partial_pooling"]

LEAST_WINCHES = 4
"""Winches from which one can differ from a majority of the others."""
_GRID = 60
_NEAR = 3.0


@dataclass(frozen=True)
class PartialPooling:
    """Common value and winches of one parameter, SI."""

    common: float
    common_std: float
    between_std: float
    """Standard deviation between winches, REML."""
    pooled: Array
    """Best linear unbiased prediction of every winch, shape (n,)."""
    pooled_std: Array
    """Root mean squared error of it, that of the common value and of τ² included, shape (n,)."""


def partial_pooling(values: Array, stds: Array) -> PartialPooling:
    """Estimate the common value, the variance between winches and the pooled values.

    Parameters
    ----------
    values
        Own estimate of every winch, shape (n,).
    stds
        Their standard deviations, shape (n,), positive.

    Notes
    -----
    REML: minimum over τ² of Σ ln(v + τ²) + ln Σ 1/(v + τ²) + Σ (y − μ)²/(v + τ²). With equal
    variances v it is the larger of zero and S² − v, S² the sample variance. The mean squared error
    of a pooled value is g₁ + g₂ + 2 g₃ (Prasad and Rao): of known μ and τ², of μ, and of τ², whose
    REML estimate has the variance 2/Σ 1/(v + τ²)²; it is at most that of the own estimate.
    """
    own = stds**2
    between = _reml(values, own)
    weight = 1 / (own + between)
    variance = float(1 / weight.sum())
    common = float(weight @ values) * variance
    share = between * weight  # of the own estimate
    pooled = common + share * (values - common)
    of_between = own**2 * weight**3 * 2 / float(weight @ weight)
    error = share * own + (1 - share) ** 2 * variance + 2 * of_between
    return PartialPooling(
        common,
        float(np.sqrt(variance)),
        float(np.sqrt(between)),
        pooled,
        np.sqrt(np.minimum(error, own)),
    )


def odd_p_values(values: Array, stds: Array) -> Array:
    """P-value of every winch of being one of the others, shape (n,); NaN with fewer than four.

    The difference of a winch from the weighted mean of the others, over its standard deviation
    with the robust variance between the winches, is t distributed with the degrees of freedom of
    that variance.
    """
    n = len(values)
    if n < LEAST_WINCHES:
        return np.full(n, np.nan)
    out = np.empty(n)
    for index in range(n):
        rest = np.arange(n) != index
        median = float(np.median(values[rest]))
        between = robust_variance(values[rest] - median, stds[rest] ** 2)
        # The mean of the others is robust too: those far from the median have no weight.
        near = rest & (np.abs(values - median) <= _NEAR * np.sqrt(stds**2 + between.value))
        weight = 1 / (stds[near] ** 2 + between.value)
        mean, variance = float(np.average(values[near], weights=weight)), 1 / weight.sum()
        z = abs(values[index] - mean) / np.sqrt(stds[index] ** 2 + between.value + variance)
        out[index] = 2 * stdtr(between.dof, -z)
    return out


def _reml(values: Array, own: Array) -> float:
    """Variance between winches that maximises the restricted likelihood."""
    if len(values) < 2:
        return 0.0
    scale = float(np.var(values, ddof=1))

    def criterion(variance: float) -> float:
        total = own + variance
        weight = 1 / total
        mean = weight @ values / weight.sum()
        deviance = np.log(total).sum() + np.log(weight.sum()) + weight @ (values - mean) ** 2
        return float(deviance)

    # A likelihood in one unknown may have two maxima: the best of a grid is refined.
    high = 2 * len(values) * scale
    grid = np.concatenate([[0.0], np.geomspace(1e-6 * high, high, _GRID)]) if high else np.zeros(1)
    best = int(np.argmin([criterion(x) for x in grid]))
    if best == 0:
        return 0.0
    ends = grid[best - 1], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(
        criterion, bounds=ends, method="bounded", options={"xatol": 1e-9 * high}
    )
    return float(found.x)

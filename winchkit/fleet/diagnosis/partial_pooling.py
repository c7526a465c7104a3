"""Partial pooling of one parameter over winches, and winches that differ from the others.

The value of winch w is μ + b + e with b ~ N(0, τ²) between winches and e of known variance. μ and
τ² are estimated by restricted maximum likelihood, the value of each winch by its best linear
unbiased prediction, beside its own estimate. Winches are tested against the others one after
another, so that odd winches do not hide each other.

References
----------
Patterson, H. D., Thompson, R. (1971). Recovery of inter-block information when block sizes are
unequal. Biometrika 58, 545-554.
Rosner, B. (1983). Percentage points for a generalized ESD many-outlier procedure. Technometrics 25,
165-172.
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
from winchkit.fleet.diagnosis.meta_analysis import WINCHES_PER_OUTLYING

LEAST_WINCHES = 4
"""Winches from which one can differ from a majority of the others."""
_GRID = 60
"""Variances at which the restricted likelihood is first computed; numerical: a factor of 1.5
between neighbours."""


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

    REML: minimum over τ² of Σ ln(v + τ²) + ln Σ 1/(v + τ²) + Σ (y − μ)²/(v + τ²). The mean squared
    error of a pooled value is g₁ + g₂ + 2 g₃ (Prasad and Rao): of known μ and τ², of μ, and of τ²,
    whose REML estimate has the variance 2/Σ 1/(v + τ²)²; it is at most that of the own estimate.
    """
    own = stds**2
    between, common, variance = _common(values, own)
    weight = 1 / (own + between)
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

    The winch farthest from the common value in its standard deviations is left out, then the
    farthest of those that remain, for k = n // 4 winches. The difference of each from the common
    value of the m that remain, over its standard deviation with their τ², is t distributed with m −
    1 degrees of freedom. Its p-value is the smallest of its own and those of the winches left out
    later (Rosner 1983), times k (Bonferroni); that of the others is 1.
    """
    n = len(values)
    if n < LEAST_WINCHES:
        return np.full(n, np.nan)
    own, left = stds**2, np.arange(n)
    between, common, _ = _common(values, own)
    order, p_values = [], []
    for _ in range(n // WINCHES_PER_OUTLYING):
        distance = np.abs(values[left] - common) / np.sqrt(own[left] + between)
        winch = int(left[np.argmax(distance)])
        left = left[left != winch]
        between, common, variance = _common(values[left], own[left])
        z = abs(values[winch] - common) / np.sqrt(own[winch] + between + variance)
        order.append(winch)
        p_values.append(2 * float(stdtr(len(left) - 1, -z)))
    out = np.ones(n)
    smallest = np.minimum.accumulate(p_values[::-1])[::-1]
    out[order] = np.minimum(1.0, len(order) * smallest)
    return out


def _common(values: Array, own: Array) -> tuple[float, float, float]:
    """Variance between winches, their common value, and its variance."""
    between = _reml(values, own)
    weight = 1 / (own + between)
    variance = float(1 / weight.sum())
    return between, float(weight @ values) * variance, variance


def _reml(values: Array, own: Array) -> float:
    """Variance between winches that maximises the restricted likelihood."""
    if len(values) < 2:
        return 0.0
    scale = float(np.var(values, ddof=1))

    def criterion(variance: Array) -> Array:
        total = own + variance[..., None]
        weight = 1 / total
        mean = weight @ values / weight.sum(axis=-1)
        squares = np.sum(weight * (values - mean[..., None]) ** 2, axis=-1)
        deviance = np.log(total).sum(axis=-1) + np.log(weight.sum(axis=-1)) + squares
        return np.asarray(deviance)

    # A likelihood in one unknown may have two maxima: the best of a grid is refined.
    high = 2 * len(values) * scale
    grid = np.concatenate([[0.0], np.geomspace(1e-6 * high, high, _GRID)]) if high else np.zeros(1)
    best = int(np.argmin(criterion(grid)))
    if best == 0:
        return 0.0
    ends = grid[best - 1], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(
        lambda variance: float(criterion(np.asarray(variance))),
        bounds=ends,
        method="bounded",
        options={"xatol": 1e-9 * high},
    )
    return float(found.x)

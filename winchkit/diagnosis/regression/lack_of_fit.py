"""Lack-of-fit test: residual power of the replicate means against the pure-error power, by band.

The F test of Draper & Smith (Applied Regression Analysis, ch. 2) in every noise band, with
Bonferroni's correction for the number of bands, and of the whole power of an output.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.noise import BandNoise, replicate_contrasts, sums_per_band
from winchkit.diagnosis.regression.projection import orthonormal

BAND_LEVEL = 0.05
"""Level of the rejection of a band, Bonferroni over all bands."""
_DRAWS = 5000
"""Draws of the whole power of an output; computing cost: five beyond a level of 0.1 %."""


@dataclass(frozen=True)
class LackOfFitTest:
    """Result of a lack-of-fit test."""

    p_value: float
    """Smallest p-value of a band times the number of bands (Bonferroni); NaN without repeats."""
    rejected: NDArray[np.bool_]
    """Bands whose corrected p-value is below 5 %, (n_bands,)."""


def lack_of_fit_test(
    regression: Regression, residual: Array, jacobian: Array, noise: BandNoise
) -> LackOfFitTest:
    """F test of the mean of repeats against the pure error, in every band; NaN without repeats.

    In band b the statistic is F = (S_b/ν_b)/σ̂_b², where S_b is the residual sum of squares of the
    means and ν_b the number of means less the leverage of the fitted unknowns. Its null
    distribution is F(ν_b, ν̂_b) with the degrees of freedom ν̂_b of the smoothed variance.
    """
    count = len(regression.bands)
    if not noise.from_repeats:
        return LackOfFitTest(float("nan"), np.zeros(count, bool))
    _, _, p = _tested_means(regression, residual, jacobian, noise)
    tested = max(count, 1)
    worst = float(min(1.0, p.min() * tested)) if count else 1.0
    return LackOfFitTest(worst, p * tested < BAND_LEVEL)


def output_p_values(
    regression: Regression, residual: Array, jacobian: Array, noise: BandNoise
) -> dict[str, float]:
    """Probability of as large a misfit of each output by the noise alone, given its repeats.

    It is twice the smaller one of two p-values: that of the band with the largest F, and that of
    the sum of squares over all bands, σ̂_b² ν_b F(ν_b, ν̂_b). Coloured noise has most of its power
    in bands with few degrees of freedom: there the ratio of two rms values says little.
    """
    total, dof, p = _tested_means(regression, residual, jacobian, noise)
    out, size = {}, noise.power * dof
    for output in regression.outputs:
        own = np.array([band[0] == output for band in regression.bands])
        draws = np.random.default_rng(1).f(dof[own], noise.dof[own], (_DRAWS, own.sum()))
        beyond = float(np.mean(draws @ size[own] >= total[own].sum()))
        out[output] = min(1.0, 2 * min(float(p[own].min() * own.sum()), beyond))
    return out


def _tested_means(
    regression: Regression, residual: Array, jacobian: Array, noise: BandNoise
) -> tuple[Array, Array, Array]:
    """Sum of squares of the means of repeats, its degrees of freedom and its p-value, by band."""
    count = len(regression.bands)
    split = replicate_contrasts(regression, residual)
    total = sums_per_band(split.mean**2, split.mean_band, count)
    dof = sums_per_band(split.mean_share, split.mean_band, count)
    basis = orthonormal(jacobian * noise.inverse_sigma(regression)[:, None])
    # Each fitted unknown takes degrees of freedom in proportion to its leverage.
    taken = sums_per_band(np.sum(basis**2, axis=1), regression.band_of_row, count)
    dof = np.maximum(dof - taken, 1.0)
    return total, dof, np.asarray(fdtrc(dof, noise.dof, total / dof / noise.power))

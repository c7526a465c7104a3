"""Cross-validation: held-out errors of blocks and groups, and a paired rank test of two models.

Leave-block-out and leave-group-out predictions are linearised at the fit: leaving rows out changes
the unknowns by one linear solve, so that no model is fitted again.

References
----------
Stone, M. (1974). Cross-validatory choice and assessment of statistical predictions. J. R. Stat.
Soc. B 36, 111-147.
Wilcoxon, F. (1945). Individual comparisons by ranking methods. Biometrics Bulletin 1, 80-83.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Folds, Regression
from winchkit.diagnosis.regression.gls import Fit, beyond_bounds
from winchkit.diagnosis.regression.noise import BandNoise

_TOUCHED = 0.02
"""Blocks whose loss changes by less than this share of the largest change are not ranked;
screened."""
_AT_LEAST = 8
"""Blocks that are ranked at least; theory: below six blocks the smallest possible p-value, 2⁻ⁿ,
exceeds 2 %; eight instead of six is a rule of thumb."""
_MOST_EXACT = 50
"""Differences up to which the signed-rank distribution is exact; numerical: at 50 the normal
approximation is within 10⁻³ of it."""
AT_NOISE = 1.1
"""Largest ratio of an error to its noise at which nothing is missing: 20 % of its power."""
CERTAIN = 0.1
"""Share of what a step explains that may be left unexplained in its outputs where it is certain:
the tenth of the verdict ``explained``."""
_RIDGE = 1e-12
"""Ridge on scaled normal equations of an extrapolation; numerical."""


def extrapolation(regression: Regression, fit: Fit, noise: BandNoise, folds: Folds) -> float:
    """Largest variance of a fold's prediction from the other folds, relative to the noise variance.

    It is computed per output in its unit: noise that is strongest at low frequencies makes an
    offset or a drift less certain than the whitened rows show.
    """
    inverse_sigma = noise.inverse_sigma(regression)
    shared = _shared(regression, fit, inverse_sigma)
    columns = _in_time(regression, shared * inverse_sigma[:, None])
    plain = _in_time(regression, shared)
    fold = np.concatenate(folds.of)
    output = np.concatenate([np.full(s.band.count, s.output) for s in regression.segments])
    size = np.sqrt(np.maximum(np.sum(columns**2, axis=0), 1e-300))
    columns, plain = columns / size, plain / size
    whole = columns.T @ columns
    worst = 0.0
    for index in range(folds.count):
        own = fold == index
        rest = whole - columns[own].T @ columns[own] + _RIDGE * np.eye(len(whole))
        covariance = np.linalg.inv(rest)
        for name, rms in noise.rms.items():
            rows = plain[own & (output == name)]
            if len(rows):
                variance = float(np.sum(covariance * (rows.T @ rows))) / len(rows)
                worst = max(worst, variance / rms**2)
    return worst


def held_out(regression: Regression, fit: Fit, noise: BandNoise, folds: Folds) -> Array:
    """Held-out χ² of every fold, (n_folds,), its unknowns fitted to the other folds; initial states
    keep their own run's values, whatever is held out."""
    inverse_sigma = noise.inverse_sigma(regression)
    residual = np.concatenate(regression.in_time(fit.residual * inverse_sigma))
    shared = _shared(regression, fit, inverse_sigma)
    columns = _in_time(regression, shared * inverse_sigma[:, None])
    fold = np.concatenate(folds.of)
    left = _left_out(residual, columns, fold, folds.count)
    return np.asarray(np.bincount(fold, weights=left**2, minlength=folds.count), dtype=float)


def left_out_steps(regression: Regression, fit: Fit, noise: BandNoise, folds: Folds) -> Array:
    """Linearised change of the unknowns when each fold is left out, (n_folds, n_unknowns)."""
    inverse_sigma = noise.inverse_sigma(regression)
    residual = np.concatenate(regression.in_time(fit.residual * inverse_sigma))
    columns = _in_time(regression, fit.jacobian * inverse_sigma[:, None])
    return _steps(residual, columns, np.concatenate(folds.of), folds.count)


def held_out_samples(
    regression: Regression, fit: Fit, noise: BandNoise, folds: Folds
) -> list[Array]:
    """Held-out error of every sample, one array per segment, SI."""
    inverse_sigma = noise.inverse_sigma(regression)
    white = np.concatenate(regression.in_time(fit.residual * inverse_sigma))
    shared = _shared(regression, fit, inverse_sigma)
    columns = _in_time(regression, shared * inverse_sigma[:, None])
    steps = _steps(white, columns, np.concatenate(folds.of), folds.count)
    plain = np.concatenate(regression.in_time(fit.residual))
    plain_columns = _in_time(regression, shared)
    fold = np.concatenate(folds.of)
    left = plain - np.einsum("ij,ij->i", plain_columns, steps[fold])
    ends = np.cumsum([segment.band.count for segment in regression.segments])
    return np.split(left, ends[:-1])


def held_out_rms(
    regression: Regression, fit: Fit, noise: BandNoise, folds: Folds
) -> dict[str, float]:
    """Held-out rms error per output, SI."""
    squares = dict.fromkeys(regression.outputs, 0.0)
    parts = held_out_samples(regression, fit, noise, folds)
    for segment, part in zip(regression.segments, parts, strict=True):
        squares[segment.output] += float(part @ part)
    return {o: float(np.sqrt(total / regression.n_samples(o))) for o, total in squares.items()}


def excess(errors: Mapping[str, float], noise: Mapping[str, float | None]) -> float:
    """Sum over outputs of known noise of the mean square of an error beyond it, in its units."""
    return sum(
        max(0.0, (error / known) ** 2 - 1.0)
        for output, error in errors.items()
        if (known := noise[output])
    )


def signed_rank_p_value(before: Array, after: Array) -> float:
    """One-sided p-value of the Wilcoxon signed-rank test that the held-out χ² of folds decreased.

    It is one with fewer than eight folds or no change. Folds whose change is below 2 % of the
    largest count only where fewer than eight would remain: an effect may act in a few folds only.
    """
    change = before - after
    size = np.abs(change)
    if size.max() == 0 or len(size) < _AT_LEAST:
        return 1.0
    # With fewer folds the smallest p-value of the rank test would exceed the level.
    touched = change[size >= min(_TOUCHED * size.max(), np.sort(size)[-_AT_LEAST])]
    return _signed_rank_tail(touched)


def _signed_rank_tail(differences: Array) -> float:
    """Probability of a signed-rank sum at least as large under symmetry about zero.

    It is exact for at most 50 differences of different sizes, else the normal approximation with
    its correction for ties; zero differences take no part (Wilcoxon 1945).
    """
    different = differences[differences != 0.0]
    n = len(different)
    _, place, equal = np.unique(np.abs(different), return_inverse=True, return_counts=True)
    ranks = (np.cumsum(equal) - (equal - 1) / 2)[place]
    rank_sum = float(np.sum(ranks[different > 0]))
    if n <= _MOST_EXACT and len(equal) == n:
        ways = np.ones(1)
        for rank in range(1, n + 1):
            ways = np.pad(ways, (0, rank)) + np.pad(ways, (rank, 0))
        return float(np.sum(ways[round(rank_sum) :]) / 2.0**n)
    variance = n * (n + 1) * (2 * n + 1) / 24 - float(np.sum(equal**3 - equal)) / 48
    return float(ndtr((n * (n + 1) / 4 - rank_sum) / np.sqrt(variance)))


def _shared(regression: Regression, fit: Fit, inverse_sigma: Array) -> Array:
    """Derivatives by the unknowns of all runs, without offsets and states of single runs; zero by
    those at a bound, which stay there whatever is held out. Columns of a curve, which has no
    bounds, are between the unknowns of the effects and the states.
    """
    like, states = fit.hypothesis, sum(len(start) for start in fit.hypothesis.starts)
    shared = fit.jacobian[:, : fit.jacobian.shape[1] - states].copy()
    bounded = slice(len(fit.vector) - states)
    gradient = shared[:, bounded].T @ (fit.residual * inverse_sigma**2)
    low, high = (bound[bounded] for bound in regression.bounds(like))
    shared[:, bounded][:, beyond_bounds(fit.vector[bounded], (low, high), gradient)] = 0.0
    return shared[:, regression.n_run_offsets :]


def _in_time(regression: Regression, columns: Array) -> Array:
    """Columns transformed to samples, shape (n_samples, k)."""
    samples = sum(s.band.count for s in regression.segments)
    out = np.empty((columns.shape[1], samples)).T
    for index, column in enumerate(columns.T):
        out[:, index] = np.concatenate(regression.in_time(column))
    return out


def _left_out(residual: Array, columns: Array, fold: NDArray[np.intp], count: int) -> Array:
    steps = _steps(residual, columns, fold, count)
    return np.asarray(residual - np.einsum("ij,ij->i", columns, steps[fold]))


def _steps(residual: Array, columns: Array, fold: NDArray[np.intp], count: int) -> Array:
    """Change of the unknowns when a fold is left out, shape (n_folds, n_unknowns)."""
    k = columns.shape[1]
    normal, gradient = np.zeros((count, k, k)), np.zeros((count, k))
    order = np.argsort(fold, kind="stable")
    ends = np.searchsorted(fold[order], np.arange(count + 1))
    for index, (low, high) in enumerate(pairwise(ends.tolist())):
        inside = columns[order[low:high]]
        normal[index] = inside.T @ inside
        gradient[index] = inside.T @ residual[order[low:high]]
    whole, pull = normal.sum(axis=0), gradient.sum(axis=0)
    size = np.sqrt(np.maximum(np.diag(whole), 1e-300))
    out = np.empty((count, k))
    for index in range(count):
        rest = (whole - normal[index]) / np.outer(size, size)
        out[index] = (
            np.linalg.pinv(rest, rcond=1e-9, hermitian=True) @ ((pull - gradient[index]) / size)
        ) / size
    return out

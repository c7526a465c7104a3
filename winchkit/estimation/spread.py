"""How well fitted values are known, when the residuals of neighbouring samples are alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["correlation_time", "covariance_of"]

Array = NDArray[np.float64]
_SINGULAR = 1e-10


def covariance_of(residuals: Array, jacobian: Array, lengths: Sequence[int]) -> Array:
    """Covariance of least squares values, shape (p, p); residuals (n,), jacobian (n, p).

    The variance is that of the residuals times the time over which they stay alike, in samples,
    within each run of ``lengths``. NaN for values without any influence, and for those that only
    a direction shared with others moves.
    """
    rows, columns = jacobian.shape
    scale = np.sqrt(np.sum(jacobian**2, axis=0))
    used = scale > 0
    out = np.full((columns, columns), np.nan)
    freedom = max(1, rows - int(np.count_nonzero(used)))
    noise = float(np.sum(residuals**2)) / freedom * correlation_time(residuals, lengths)
    _, singular, rotation = np.linalg.svd(jacobian[:, used] / scale[used], full_matrices=False)
    known = singular > _SINGULAR * singular[:1].max(initial=0.0)
    inverse = (rotation[known].T / singular[known] ** 2) @ rotation[known]
    lost = np.any(np.abs(rotation[~known]) > np.sqrt(_SINGULAR), axis=0)
    block = noise * inverse / np.outer(scale[used], scale[used])
    block[lost, :] = block[:, lost] = np.nan
    out[np.ix_(used, used)] = block
    return out


def correlation_time(residuals: Array, lengths: Sequence[int]) -> float:
    """1 + 2 Σ ρ_k up to the first lag that is not positive, in samples, at least 1."""
    parts = np.split(residuals, np.cumsum(lengths)[:-1])
    size = max(len(part) for part in parts)
    padded = 2 ** int(np.ceil(np.log2(2 * size)))
    power = sum(np.abs(np.fft.rfft(part - part.mean(), padded)) ** 2 for part in parts if len(part))
    covariance = np.fft.irfft(power, padded)[:size]
    if not covariance[0] > 0:
        return 1.0
    rho = covariance[1:] / covariance[0]
    end = np.flatnonzero(rho <= 0)
    return float(1.0 + 2.0 * np.sum(rho[: end[0]] if end.size else rho))

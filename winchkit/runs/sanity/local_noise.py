"""Local noise of a channel: standard deviation of what neighbouring samples do not share.

Differences of order k remove a polynomial of degree k - 1; white noise of variance σ² leaves
C(2k, k) σ² in them (difference-based variance estimation).

References
----------
Hall, P., Kay, J. W., Titterington, D. M. (1990). Asymptotically optimal difference-based estimation
of variance in nonparametric regression. Biometrika 77, 521-528.
"""

from __future__ import annotations

from math import comb

import numpy as np

from winchkit.arrays import Array

_ORDERS = (1, 2, 3)
"""Orders of differences: higher ones hardly remove more of a smooth signal, and lose degrees of
freedom."""
_ROUNDING = 16.0
"""Differences below this many units in the last place are zero."""


def smallest_differences(values: Array) -> tuple[Array, float]:
    """Differences (m,) of the order in which values (n,) are smallest; their white noise gain."""
    known = values[np.isfinite(values)]
    best, gain, least = np.zeros(0), 1.0, np.inf
    tiny = _ROUNDING * np.finfo(np.float64).eps * (float(np.abs(known).max()) if len(known) else 0)
    for order in _ORDERS:
        differences = np.diff(values, order)
        differences = differences[np.isfinite(differences)]
        if len(differences) == 0:
            continue
        own = float(np.sqrt(comb(2 * order, order)))
        size = float(np.sqrt(np.mean(_trimmed(differences) ** 2))) / own
        if size < least:
            best, gain, least = np.where(np.abs(differences) <= tiny, 0.0, differences), own, size
    return best, gain


def local_noise(values: Array) -> float:
    """Standard deviation of white noise with the differences of a channel, in its unit."""
    differences, gain = smallest_differences(values)
    if len(differences) == 0:
        return 0.0
    return float(np.sqrt(np.mean(_trimmed(differences) ** 2))) / gain


def sorted_quantile(values: Array, share: float) -> float:
    """Quantile of sorted values by linear interpolation, as :func:`numpy.quantile` of any."""
    position = (len(values) - 1) * share
    below = int(position)
    above = min(below + 1, len(values) - 1)
    return float(values[below] + (position - below) * (values[above] - values[below]))


def _trimmed(differences: Array) -> Array:
    """Differences limited to their 99 % quantile, so that spikes have no weight."""
    high = sorted_quantile(np.sort(np.abs(differences)), 0.99)
    return np.clip(differences, -high, high) if high > 0 else differences

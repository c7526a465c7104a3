"""Missing samples and gaps in the time of a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array

__all__ = ["bridged", "gaps"]

_GAP = 2.5
"""Shortest gap in median sampling intervals (rule of thumb: one missing sample and jitter)."""


def bridged(values: Array) -> Array:
    """Interpolate missing values (NaN) linearly over the index.

    Parameters
    ----------
    values : (n,) array
        At least one of them finite.

    Returns
    -------
    (n,) array
        ``values`` itself where none is missing; the nearest value beyond the first and the last.
    """
    known = np.isfinite(values)
    if known.all():
        return values
    index = np.arange(len(values))
    return np.interp(index, index[known], values[known])


def gaps(time: Array) -> NDArray[np.intp]:
    """Indices of the last samples before gaps, (k,).

    Parameters
    ----------
    time : (n,) array
        s, increasing.
    """
    steps = np.diff(time)
    return np.flatnonzero(steps > _GAP * np.median(steps))

"""A signal as it was, or will be, a while away from each of its samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["shifted"]

Array = NDArray[np.float64]


def shifted(signal: Array, time: Array, later: float) -> Array:
    """The signal ``later`` seconds on, by cubic Hermite interpolation; held at the run's ends."""
    if later == 0.0 or len(time) < 2:
        return signal
    slope = np.gradient(signal, time)
    asked = np.clip(time + later, time[0], time[-1])
    left = np.clip(np.searchsorted(time, asked, side="right") - 1, 0, len(time) - 2)
    step = time[left + 1] - time[left]
    u = (asked - time[left]) / step
    rise = signal[left + 1] - signal[left]
    start, end = slope[left] * step - rise, rise - slope[left + 1] * step
    return np.asarray(signal[left] + u * rise + u * (1 - u) * ((1 - u) * start + u * end))

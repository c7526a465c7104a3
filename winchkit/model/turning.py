"""The points between samples at which a sampled motion turned around."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["with_turning_points"]

Array = NDArray[np.float64]


def with_turning_points(x: Array) -> tuple[Array, NDArray[np.intp]]:
    """Samples (n,) with the turning points between them, and where the samples stand in that.

    What turned between two samples went further than either, and a loop or a play remembers how
    far: parabolas through the three samples about a turn tell.
    """
    step = np.diff(x)
    turns = 1 + np.flatnonzero(step[:-1] * step[1:] < 0)
    slope, bend = (step[turns] + step[turns - 1]) / 2, step[turns] - step[turns - 1]
    at = -slope / bend
    where = turns + (at > 0)
    count = np.arange(len(x))
    own = count + np.searchsorted(where, count, side="right")
    return np.insert(x, where, x[turns] + slope * at / 2), own

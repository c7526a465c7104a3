"""Rows whose stamps are out of order, beside others that are in order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array

STILL = 0.01
"""Share of rows that are left out; with more of them the clock is at fault."""
_FEWEST = 20
"""Rows below which a time that goes back is no exception."""
_GAP = 2.5
"""Median intervals of a gap, as two lost samples are."""
_ALONE = (0.5, 2.5)
"""Intervals between the rows beside a single one: one of a row that was moved there, two of a row
with a wrong stamp."""


def rows_in_order(time: Array) -> NDArray[np.bool_]:
    """Mask of rows (n,) without the few single ones whose stamps are out of order.

    A row is out of order where the times before and after it are one or two intervals apart and it
    is not between them; a clock that is set back shifts all later rows as well.
    """
    kept = np.ones(len(time), dtype=bool)
    steps = np.diff(time)
    if len(steps) < _FEWEST or not np.any(steps < 0) or not np.all(np.isfinite(steps)):
        return kept
    usual = float(np.median(steps))
    for step in np.flatnonzero(steps < 0):
        for row in (int(step) + 1, int(step)):
            if 0 < row < len(time) - 1 and kept[row]:
                around = time[row + 1] - time[row - 1]
                if _ALONE[0] < around / usual < _ALONE[1]:
                    kept[row] = False
                    break
    is_few = np.count_nonzero(~kept) <= STILL * len(time)
    return kept if is_few and np.all(np.diff(time[kept]) >= 0) else np.ones(len(time), dtype=bool)


def after_gaps(time: Array) -> NDArray[np.bool_]:
    """Mask of the rows (n,) before which others are missing; none where times are not known."""
    steps = np.abs(np.diff(time))
    found = np.zeros(len(time), dtype=bool)
    if len(steps) and np.all(np.isfinite(steps)):
        found[1:] = steps > _GAP * np.median(steps)
    return found

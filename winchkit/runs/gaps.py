"""Gaps of a recording, as ``check``, ``log info``, an import and a run count them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.align import MAY_LACK, PATIENCE

LOST = 2.5
"""Shortest gap in median intervals, as in the comparison: one missing sample and jitter."""
_WHOLE = 0.05
"""Deviation of an interval from a whole number of usual ones up to which it has lost samples."""


def lost_samples(time: Array) -> NDArray[np.bool_]:
    """Intervals of ``time`` (n,) in which samples were lost, (n - 1,).

    They are longer than 2.5 median intervals, or a whole number of them to 5 %.
    """
    steps = np.diff(time)
    if not len(steps):
        return np.zeros(0, dtype=bool)
    steps = steps / np.median(steps)
    whole = np.round(steps)
    return np.asarray((steps > LOST) | ((whole > 1) & (np.abs(steps - whole) <= _WHOLE)))


def gap_lengths(
    time: Array,
    columns: Mapping[str, Array],
    span: tuple[float, float] | None = None,
    longest: float = 0.0,
) -> list[float]:
    """Lengths of the gaps of one source of samples, s; those that overlap are one.

    A gap is an interval in which samples were lost (:func:`lost_samples`), one from an end of the
    recording (``span``) to the nearest sample, unless at most ``longest``, and one in which a
    channel has no value for more than half a second and two intervals.
    """
    stamps = np.unique(time)
    span = span or ((float(stamps[0]), float(stamps[-1])) if len(stamps) else (np.nan, np.nan))
    usual = LOST * float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    lost = np.flatnonzero(lost_samples(stamps))
    found = set(zip(stamps[lost].tolist(), stamps[lost + 1].tolist(), strict=True))
    ends = [(span[0], float(stamps[0])), (float(stamps[-1]), span[1])] if len(stamps) else [span]
    found.update(item for item in ends if item[1] - item[0] > max(longest, usual))
    for name, values in columns.items():
        lacks = np.isnan(values)
        if not name or name.endswith(MAY_LACK) or not lacks.any():
            continue
        marks = np.concatenate([span[:1], time[~lacks], span[1:]])
        between = np.diff(np.searchsorted(time[lacks], marks)) > 0
        long = np.flatnonzero(between & (np.diff(marks) > max(PATIENCE, usual)))
        found |= set(zip(marks[long].tolist(), marks[long + 1].tolist(), strict=True))
    return _merged(found)


def _merged(intervals: Iterable[tuple[float, float]]) -> list[float]:
    """Lengths of intervals (begin, end), those that overlap joined to one."""
    joined: list[tuple[float, float]] = []
    for begin, end in sorted(intervals):
        if joined and begin < joined[-1][1]:
            joined[-1] = joined[-1][0], max(end, joined[-1][1])
        else:
            joined.append((begin, end))
    return [end - begin for begin, end in joined]

"""Signals with their own time stamps brought to common moments: the rows of a run.

A row stands at a sample of the slowest instrument; every other signal is interpolated there
between its own two neighbouring samples, and is NaN where it has none. A recorder that writes
rows and a reader of a log by channels use the same code.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.layout import Layout, RowRule, Source

__all__ = ["PATIENCE", "Aligner", "Moments", "Series", "values_at"]


PATIENCE = 0.5
"""A row waits no longer than this for a source that has gone silent, s."""
_MAY_LACK = "motor_torque"
"""Unknown while a drive is unpowered: a run may begin without it."""


def values_at(times: Array, values: Array, moments: Array, max_gap: float) -> Array:
    """Values of samples at other moments, linearly between the two neighbours.

    ``times`` (n,) rise strictly, ``values`` are (n, k), ``moments`` (m,); the result is (m, k), NaN
    where a neighbour is missing or they are further apart than ``max_gap`` (s).
    """
    found = np.full((len(moments), values.shape[1]), np.nan)
    if not len(times):
        return found
    after = np.searchsorted(times, moments)
    right = np.minimum(after, len(times) - 1)
    left = np.maximum(after - 1, 0)
    gap = times[right] - times[left]
    between = (after > 0) & (after < len(times)) & (gap <= max_gap)
    share = np.divide(moments - times[left], gap, out=np.zeros_like(gap), where=between)
    line = values[left] + (values[right] - values[left]) * share[:, None]
    found[between] = line[between]
    exact = times[right] == moments
    found[exact] = values[right[exact]]
    return found


class Moments:
    """Picks the moments of rows from the samples of the source that sets them."""

    def __init__(self, rule: RowRule) -> None:
        self._rule = rule
        self._last = -np.inf

    def of(self, times: Array) -> Array:
        """Those of ``times`` at which a row stands: each newer than the one before."""
        times = times[np.isfinite(times) & (times >= self._rule.opened)]
        kept = times[rising(times, self._last)]
        if self._rule.period > 0:
            kept = _spaced(kept, self._rule.period, self._last)
        self._last = kept[-1] if len(kept) else self._last
        return kept


def rising(times: Array, last: float) -> NDArray[np.bool_]:
    """Which of ``times`` are later than all before them and than ``last``."""
    before = np.concatenate([[last], times[:-1]])[: len(times)]
    later: NDArray[np.bool_] = times > np.maximum.accumulate(before)
    return later


def _spaced(times: Array, period: float, last: float) -> Array:
    kept = []
    for time in times.tolist():
        if time - last >= period:
            kept.append(time)
            last = time
    return np.array(kept)


class Series:
    """Samples of one source, remembered just long enough to interpolate them."""

    def __init__(self, max_gap: float, width: int = 1) -> None:
        """Samples further apart than ``max_gap`` (s) are not bridged; ``width`` values each."""
        self._max_gap = max_gap
        self._times: Array = np.empty(0)
        self._values: Array = np.empty((0, width))

    @property
    def last(self) -> float:
        """Time of the newest sample, s; minus infinity without any."""
        return float(self._times[-1]) if len(self._times) else -np.inf

    def append(self, times: Array, values: Array) -> None:
        """Add samples, values (n, width); those that are not newer than all before are left."""
        newer = rising(times, self.last)
        self._times = np.concatenate([self._times, times[newer]])
        self._values = np.concatenate([self._values, values[newer]])

    def reaches(self, time: float) -> bool:
        """Whether a sample at or after ``time`` is there."""
        return self.last >= time

    def at(self, moments: Array) -> Array:
        """Values at moments, shape (m, width); see :func:`values_at`."""
        return values_at(self._times, self._values, moments, self._max_gap)

    def forget(self, before: float) -> None:
        """Drop what no moment after ``before`` can need."""
        first = max(int(np.searchsorted(self._times, before, side="right")) - 1, 0)
        self._times, self._values = self._times[first:], self._values[first:]


class Aligner:
    """Makes rows of what comes from the sources, as soon as a row can be complete."""

    def __init__(self, layout: Layout) -> None:
        self.start = layout.rule.start
        """Moment of the first row, s; None before there is one."""
        self._opened, self._base = layout.rule.opened, layout.rule.topic
        self._picked = Moments(layout.rule)
        self._series = {
            source.topic: Series(source.max_gap, len(_columns(source))) for source in layout.sources
        }
        self._used = {source.topic: _columns(source) for source in layout.sources}
        gap = next(item.max_gap for item in layout.sources if item.topic == self._base)
        self._slower = {item.topic for item in layout.sources if item.max_gap > gap}
        names = [name for name, _ in layout.columns()[1:]]
        self._needed = np.array([not name.endswith(_MAY_LACK) for name in names], dtype=bool)
        self._moments: Array = np.empty(0)

    def add(self, topic: str, times: Array, values: Array) -> None:
        """Take samples of a source, values (n, signals); what is not newer than before is left."""
        known = np.isfinite(times)
        self._series[topic].append(times[known], values[known][:, self._used[topic]])
        if topic == self._base:
            self._moments = np.concatenate([self._moments, self._picked.of(times)])

    def rows(self, now: float, *, ends: bool = False) -> Array:
        """Rows that have become complete, time first, shape (n, columns).

        A row waits for every source that has given something within the last half second; where
        the log ``ends``, for none that is slower than the rows: it comes no more, and is NaN.
        The first row is the first that lacks nothing, or the first after half a second.
        """
        left = self._slower if ends else ()
        awaited = [
            item.last
            for topic, item in self._series.items()
            if topic not in left and item.reaches(now - PATIENCE)
        ]
        ready = self._moments <= min(awaited, default=np.inf)
        moments, self._moments = self._moments[ready], self._moments[~ready]
        if not len(moments):
            return np.empty((0, 1 + len(self._needed)))
        values = np.hstack([series.at(moments) for series in self._series.values()])
        for series in self._series.values():
            series.forget(moments[-1])
        if self.start is None:
            lacks = np.isnan(values[:, self._needed]).any(axis=1)
            may_begin = ~lacks | (moments >= self._opened + PATIENCE)
            first = int(np.argmax(may_begin)) if may_begin.any() else len(moments)
            moments, values = moments[first:], values[first:]
            self.start = float(moments[0]) if len(moments) else None
        return np.column_stack([moments - (self.start or 0.0), values])


def _columns(source: Source) -> list[int]:
    """Which of a source's signals are columns of the run."""
    return [n for n, signal in enumerate(source.signals) if signal.column]

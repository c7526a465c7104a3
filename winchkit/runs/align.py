"""Interpolation of signals with separate time stamps at common times: the rows of a run.

A row is at a sample of the slowest instrument; every other signal is interpolated there between its
two neighbouring samples, and is NaN without them. A recorder of rows and a reader of a log by
channels use the same code.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.layout import Layout, RowRule, Source

__all__ = ["PATIENCE", "Aligner", "Moments", "Series", "values_at"]


PATIENCE = 0.5
"""Longest wait of a row for a source that sends no samples, s."""
_MAY_LACK = "motor_torque"
"""Channel that is unknown while a drive is unpowered: a run may start without it."""


def values_at(times: Array, values: Array, moments: Array, max_gap: float) -> Array:
    """Linear interpolation of samples.

    Parameters
    ----------
    times : (n,) array
        Strictly increasing times, s.
    values : (n, k) array
        Samples.
    moments : (m,) array
        Times of the result, s.
    max_gap : float
        Longest interval over which samples are interpolated, s.

    Returns
    -------
    (m, k) array
        NaN where a neighbouring sample is missing or the interval is longer.
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
    """Selects the times of rows from the samples of the source that determines them."""

    def __init__(self, rule: RowRule) -> None:
        self._rule = rule
        self._last = -np.inf

    def of(self, times: Array) -> Array:
        """The elements of ``times`` that are times of rows, strictly increasing."""
        times = times[np.isfinite(times) & (times >= self._rule.opened)]
        kept = times[rising(times, self._last)]
        if self._rule.period > 0:
            kept = _spaced(kept, self._rule.period, self._last)
        self._last = kept[-1] if len(kept) else self._last
        return kept


def rising(times: Array, last: float) -> NDArray[np.bool_]:
    """Mask of ``times`` that are later than all earlier elements and than ``last``."""
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
    """Samples of one source, kept as long as the interpolation needs them."""

    def __init__(self, max_gap: float, width: int = 1) -> None:
        """``width`` values per sample; intervals above ``max_gap`` (s) are gaps."""
        self._max_gap = max_gap
        self._times: Array = np.empty(0)
        self._values: Array = np.empty((0, width))

    @property
    def max_gap(self) -> float:
        """Longest interval over which samples are interpolated, s."""
        return self._max_gap

    @property
    def last(self) -> float:
        """Time of the newest sample, s; minus infinity without any."""
        return float(self._times[-1]) if len(self._times) else -np.inf

    def append(self, times: Array, values: Array) -> None:
        """Add samples, values (n, width); samples not newer than all before are skipped."""
        newer = rising(times, self.last)
        self._times = np.concatenate([self._times, times[newer]])
        self._values = np.concatenate([self._values, values[newer]])

    def reaches(self, time: float) -> bool:
        """Whether there is a sample at or after ``time``."""
        return self.last >= time

    def at(self, moments: Array) -> Array:
        """Values at times, shape (m, width); see :func:`values_at`."""
        return values_at(self._times, self._values, moments, self._max_gap)

    def forget(self, before: float) -> None:
        """Drop samples that no time after ``before`` needs."""
        first = max(int(np.searchsorted(self._times, before, side="right")) - 1, 0)
        self._times, self._values = self._times[first:], self._values[first:]


class Aligner:
    """Makes rows of the sources' samples as soon as a row is complete."""

    def __init__(self, layout: Layout) -> None:
        self.start = layout.rule.start
        """Time of the first row, s; None before it."""
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
        """Take samples of a source, values (n, signals); older ones are skipped."""
        known = np.isfinite(times)
        self._series[topic].append(times[known], values[known][:, self._used[topic]])
        if topic == self._base:
            self._moments = np.concatenate([self._moments, self._picked.of(times)])

    def rows(self, now: float, *, ends: bool = False) -> Array:
        """Rows that are complete by ``now``, time first, shape (n, columns).

        A row waits for every source with a sample within the last half second. Where the log
        ``ends``, it waits neither for sources slower than the rows nor for one that has been
        silent for longer than is interpolated; their values are then NaN. The first row is the
        first complete one, or the first after half a second.
        """
        left = self._slower if ends else ()
        awaited = [
            item.last
            for topic, item in self._series.items()
            if topic not in left
            and item.reaches(now - (min(PATIENCE, item.max_gap) if ends else PATIENCE))
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
    """Indices of a source's signals that are columns of the run."""
    return [n for n, signal in enumerate(source.signals) if signal.column]

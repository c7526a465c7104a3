"""Interpolation of signals with separate time stamps at common times: the rows of a run.

A row is at a sample of the slowest instrument; every other signal is interpolated there between its
two neighbouring samples, and is NaN without them. While that instrument is silent rows are at the
samples of the other sources.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.layout import Layout, SignalSource

PATIENCE = 0.5
"""Longest wait of a row for a source that sends no samples, s."""
MAY_LACK = "motor_torque"
"""Channel that is unknown while a drive is unpowered: a run may start without it."""


def values_at(times: Array, values: Array, moments: Array, max_gap: float) -> Array:
    """Samples (n, k) interpolated at ``moments`` (m,); NaN across more than ``max_gap`` (s)."""
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


def longest_wait(source: SignalSource) -> float:
    """Time without a sample after which a source counts as silent, s."""
    return max(PATIENCE, source.max_gap)


class Moments:
    """Selects the times of rows: the samples of one source, or of any other while it is silent."""

    def __init__(self, layout: Layout) -> None:
        self._rule = layout.rule
        base = next(source for source in layout.sources if source.topic == self._rule.topic)
        self._wait = longest_wait(base)
        self._last = -np.inf
        self._picked: Array = np.empty(0)
        """Samples of the source that are not taken yet."""
        self._others: Array = np.empty(0)
        self._newest = -np.inf
        self._since: float | None = None
        """From when on that source is awaited, s; None before any sample of the log."""

    def add(self, topic: str, times: Array) -> None:
        """Take the sample times of a source."""
        times = times[np.isfinite(times) & (times >= self._rule.opened)]
        if len(times) and self._since is None:
            first = self._rule.start is None and np.isfinite(self._rule.opened)
            self._since = self._rule.opened if first else float(times.min())
        self._newest = max(self._newest, float(times.max(initial=-np.inf)))
        if topic == self._rule.topic:
            before = self._picked[-1] if len(self._picked) else self._last
            self._picked = np.concatenate([self._picked, times[rising(times, before)]])
        else:
            self._others = np.concatenate([self._others, times])

    def take(self, now: float, *, ends: bool = False) -> Array:
        """Times of rows that are known at ``now`` (s): all where the log ``ends``."""
        known = self._newest if ends else now - PATIENCE
        found: list[Array] = []
        while len(self._picked):
            awaited = self._awaited
            apart = np.diff(self._picked, prepend=min(awaited, self._picked[0])) > self._wait
            near = int(np.argmax(apart)) if apart.any() else len(apart)
            if near:
                found.append(self._kept(self._picked[:near]))
                self._picked = self._picked[near:]
            elif self._picked[0] <= known:
                found.append(self._between(awaited, self._picked[0], inclusive=False))
                self._since = self._last = float(self._picked[0])
                found.append(self._picked[:1])
                self._picked = self._picked[1:]
            else:
                break
        if not len(self._picked) and known - self._awaited > self._wait:
            found.append(self._between(self._awaited, known, inclusive=True))
        self._others = self._others[self._others > self._awaited]
        return np.concatenate([np.empty(0), *found])

    @property
    def _awaited(self) -> float:
        """Newest sample of the source that was taken, or the beginning of the log, s."""
        return np.inf if self._since is None else self._since

    def _kept(self, times: Array) -> Array:
        """Those of the source's samples that are far enough apart."""
        self._since = float(times[-1])
        if self._rule.period > 0:
            times = _spaced(times, self._rule.period, self._last)
        self._last = float(times[-1]) if len(times) else self._last
        return times

    def _between(self, begin: float, end: float, *, inclusive: bool) -> Array:
        """Samples of the other sources within an interval, as far apart as rows are."""
        inner = (self._others > begin) & (self._others <= end if inclusive else self._others < end)
        times = np.sort(self._others[inner])
        found = _spaced(times, max(self._rule.period, self._rule.spacing), self._last)
        self._last = float(found[-1]) if len(found) else self._last
        return found


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


class SourceSeries:
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
        self._opened = layout.rule.opened
        self._picked = Moments(layout)
        self._series = {
            source.topic: SourceSeries(source.max_gap, len(_columns(source)))
            for source in layout.sources
        }
        self._used = {source.topic: _columns(source) for source in layout.sources}
        gap = next(item.max_gap for item in layout.sources if item.topic == layout.rule.topic)
        self._slower = {item.topic for item in layout.sources if item.max_gap > gap}
        names = [name for name, _ in layout.columns()[1:]]
        self._needed = np.array([not name.endswith(MAY_LACK) for name in names], dtype=bool)
        self._moments: Array = np.empty(0)

    def add(self, topic: str, times: Array, values: Array) -> None:
        """Take samples of a source, values (n, signals); older ones are skipped."""
        known = np.isfinite(times)
        self._series[topic].append(times[known], values[known][:, self._used[topic]])
        self._picked.add(topic, times)

    def rows(self, now: float, *, ends: bool = False) -> Array:
        """Rows that are complete by ``now``, time first, shape (n, columns).

        A row waits for every source with a sample within the last half second. Where the log
        ``ends``, it waits neither for sources slower than the rows nor for one that has been
        silent for longer than is interpolated. The first row is the first complete one, or the
        first after half a second.
        """
        self._moments = np.concatenate([self._moments, self._picked.take(now, ends=ends)])
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


def _columns(source: SignalSource) -> list[int]:
    """Indices of a source's signals that are columns of the run."""
    return [n for n, signal in enumerate(source.signals) if signal.column]

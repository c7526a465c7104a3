"""Counters of an instrument's line, and its response times."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, fields
from math import ceil, log10, nan

_FIRST = 1e-5
"""s: upper end of the first bin, below every bus's latency."""
_PER_DECADE = 10
"""Bins; see `_BINS`."""
_BINS = 70
"""From 10 us to 100 s, ten bins a decade: a percentile is right within 26 %."""
_WINDOW = 64
"""Readings whose mean period is the rate: a jitter of a whole period changes it by 1.6 % (1/63)."""
_IDLE = 4.0
"""Mean periods without a reading (at least 1 s) after which the rate is zero: two lost answers are
no end (rule of thumb)."""


@dataclass(frozen=True, slots=True)
class Latency:
    """Times from request to answer, s; NaN before the first."""

    p50: float = nan
    p99: float = nan
    worst: float = nan


@dataclass(frozen=True, slots=True)
class Counters:
    """What happened since the start; a snapshot."""

    readings: int = 0
    duplicates: int = 0
    drops: int = 0
    """Readings that were due and did not come."""
    timeouts: int = 0
    """Requests that nothing answered in time."""
    crc: int = 0
    """Answers with a wrong check sum."""
    malformed: int = 0
    """Answers that were whole and not what was asked for: short, echoed, of another unit."""
    late: int = 0
    """Answers that came after their time and were thrown away."""
    resynchronised: int = 0
    """Bytes skipped to find a frame's beginning."""
    exceptions: int = 0
    """Answers that refuse."""
    reconnects: int = 0
    rate: float = nan
    """Readings a second lately; zero when they have ceased."""
    latency: Latency = Latency()


COUNTED = tuple(item.name for item in fields(Counters) if item.type == "int")
"""Names of the counts, without rate and latency."""


@dataclass(slots=True)
class Tally:
    """Counts of one instrument, written by one thread; others read :meth:`counters`."""

    readings: int = 0
    duplicates: int = 0
    drops: int = 0
    timeouts: int = 0
    crc: int = 0
    malformed: int = 0
    late: int = 0
    resynchronised: int = 0
    exceptions: int = 0
    reconnects: int = 0
    _times: deque[float] = field(default_factory=lambda: deque(maxlen=_WINDOW))
    _latencies: list[int] = field(default_factory=lambda: [0] * _BINS)
    _worst: float = nan

    def reading(self, now: float, latency: float = nan) -> None:
        """Count a reading that came ``now``, ``latency`` after its request (s)."""
        self.readings += 1
        self._times.append(now)
        if latency >= 0:
            self._worst = latency if self._worst != self._worst else max(self._worst, latency)
            self._latencies[_bin(latency)] += 1

    def counters(self, now: float) -> Counters:
        """The snapshot at a moment."""
        return Counters(
            **{name: getattr(self, name) for name in COUNTED},
            rate=self._rate(now),
            latency=Latency(self._percentile(0.50), self._percentile(0.99), self._worst),
        )

    def _rate(self, now: float) -> float:
        times = tuple(self._times)
        if len(times) < 2 or times[-1] <= times[0]:
            return nan
        mean = (times[-1] - times[0]) / (len(times) - 1)
        return 0.0 if now - times[-1] > max(1.0, _IDLE * mean) else 1 / mean

    def _percentile(self, share: float) -> float:
        """Upper end of the bin that holds it, never above the worst."""
        left = ceil(share * sum(self._latencies))
        if left == 0:
            return nan
        for index, count in enumerate(self._latencies):
            left -= count
            if left <= 0:
                return min(self._worst, _FIRST * 10 ** ((index + 1) / _PER_DECADE))
        return self._worst


def _bin(latency: float) -> int:
    if latency <= _FIRST:
        return 0
    return min(_BINS - 1, int(_PER_DECADE * log10(latency / _FIRST)))

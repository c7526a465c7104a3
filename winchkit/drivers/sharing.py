"""Scheduling of the instruments on a line: order of polling, and rates (max-min fair share)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from math import inf
from statistics import median
from typing import Protocol, TypeVar

from winchkit.drivers.reading import Sensor

QUICK_RETRIES = 2
"""Failures in a row after which an instrument is polled at once again; a further one makes it rare,
so that others on the line keep their rates."""
RETRY = 0.5
"""s between attempts then: a cable that is plugged in again is noticed without a wait, and a
time-out of 0.1 s takes at most a fifth of the line."""
RECONNECT = 0.3
"""s between attempts to open a port or a connection."""
STALE_TIMEOUTS = 2
"""One lost answer is no reason to stop a winch, two are."""
LATE = 0.02
"""s from request to answer, beyond its time on the wire, above which the time of the sample is
uncertain by more than the cell's response (flag ``LATE``); rule of thumb, 1 mm of motion at 0.05
m/s."""

_USE = 0.95
"""Of a line: the rest is for commands, retries and the machine's own jitter."""
_TICK = 1e-6
"""Resolution of the clocks, s."""
_WATCHED = 32
"""Readings of an instrument whose median is what one takes: a machine that stood still is none."""


class Polled(Protocol):
    """An instrument that is asked for its readings."""

    due: float
    """When it wants to be asked next, s."""
    asked: float
    """When it was asked last, s."""


P = TypeVar("P", bound=Polled)


def next_of(instruments: Sequence[P], now: float, due: Callable[[P], float]) -> P:
    """Of the instruments that are due the one that has waited longest, as for fair rates."""
    waiting = [item for item in instruments if due(item) <= now]
    if waiting:
        return min(waiting, key=lambda item: item.asked)
    return min(instruments, key=due)


class LineShare:
    """Rates that a line allows its instruments, by the measured times of their readings."""

    def __init__(
        self, wanted: Sequence[float], times: Sequence[float], least: float = _TICK
    ) -> None:
        """Take wanted rates (1/s), likely times (s) of a reading, and the shortest time (s)."""
        self._wanted, self._least = tuple(wanted), least
        self._times = [max(time, least) for time in times]
        self._seen = [deque[float](maxlen=_WATCHED) for _ in times]
        self._fresh = 0

    @property
    def rates(self) -> tuple[float, ...]:
        """The rate that is to be expected of each, 1/s."""
        return fair_rates(self._wanted, self._times)

    @property
    def limits(self) -> tuple[float, ...]:
        """The rate at which each may be asked at most, 1/s."""
        return fair_rates(self._wanted, [self._least] * len(self._wanted))

    def took(self, index: int, time: float) -> bool:
        """Note how long a reading has kept the line busy (s); whether the rates are others now."""
        self._seen[index].append(time)
        self._fresh += 1
        if self._fresh < _WATCHED:
            return False
        self._fresh = 0
        for number, seen in enumerate(self._seen):
            if seen:
                self._times[number] = max(median(seen), self._least)
        return True

    def room_for(self, index: int) -> float:
        """Rate that the line has room for, whatever rate the instrument wants, 1/s."""
        wanted = [inf if k == index else rate for k, rate in enumerate(self._wanted)]
        return fair_rates(wanted, self._times)[index]

    def time_of(self, index: int) -> float:
        """How long a reading keeps the line busy, s."""
        return self._times[index]


class SharedLine:
    """A line that shares its time out among its instruments."""

    sensors: Sequence[Sensor]
    _share: LineShare

    def room_for(self, sensor: Sensor) -> float:
        """Rate that the line has room for, whatever rate the instrument wants, 1/s."""
        return self._share.room_for(self._place(sensor))

    def time_of(self, sensor: Sensor) -> float:
        """How long a reading of an instrument keeps the line busy, s."""
        return self._share.time_of(self._place(sensor))

    def _place(self, sensor: Sensor) -> int:
        return next(k for k, item in enumerate(self.sensors) if item is sensor)


def fair_rates(wanted: Sequence[float], times: Sequence[float]) -> tuple[float, ...]:
    """Max-min fair rates (1/s) of instruments on one line that take ``times`` s for a reading."""
    rates = [0.0] * len(wanted)
    free, left = _USE, sorted(range(len(wanted)), key=lambda k: wanted[k])
    while left:
        share = free / sum(times[k] for k in left)
        first = left.pop(0)
        rates[first] = min(wanted[first], share)
        free -= rates[first] * times[first]
    return tuple(rates)

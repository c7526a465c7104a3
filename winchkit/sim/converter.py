"""The analogue half of a simulated instrument: samples at its rate, filters, notices motion."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, nan

__all__ = ["Converted", "Converter"]

_FAST, _SLOW = 0.05, 0.5
"""Time constants of the averages whose difference is motion, s."""


@dataclass(frozen=True, slots=True)
class Converted:
    """One conversion, in the unit of the device."""

    due: float
    """When it has passed the filter, s."""
    value: float
    """NaN where nothing could be measured."""
    overload: bool = False
    broken: bool = False


class Converter:
    """Samples ``measure`` at the instants of :attr:`next_conversion`, and at no others.

    The filter delays and does not smooth, since a lag would be an effect of its own.
    """

    def __init__(
        self, measure: Callable[[], float], rate: float, filter_delay: float, *, now: float
    ) -> None:
        self.next_conversion = now
        self._measure = measure
        self._step = 1.0 / rate
        self._delay = filter_delay
        self._pipeline: deque[Converted] = deque()
        self._fast: float | None = None
        self._slow: float | None = None
        self._last = nan
        """What was measured last; one that is frozen says it again."""

    def deviate(self, share: float) -> None:
        """Let its clock run slower by a share of the declared period."""
        self._step *= 1.0 + share

    def convert(self, faults: set[str]) -> None:
        """Sample at the instant ``next_conversion``, which then moves on by one period."""
        now = self.next_conversion
        self.next_conversion = now + self._step
        value = self._last if "frozen" in faults else self._measure()
        self._last = value
        broken = "sensor break" in faults or not isfinite(value)
        seen = nan if broken else value
        self._pipeline.append(Converted(now + self._delay, seen, "overload" in faults, broken))
        if not broken:
            self._average(value)

    def take(self, now: float) -> list[Converted]:
        """Conversions that have come through the filter by ``now``, each once."""
        found = []
        while self._pipeline and self._pipeline[0].due <= now:
            found.append(self._pipeline.popleft())
        return found

    @property
    def motion(self) -> float:
        """How far a fast and a slow average are apart, in the unit of the device."""
        if self._fast is None or self._slow is None:
            return 0.0
        return abs(self._fast - self._slow)

    def _average(self, value: float) -> None:
        if self._fast is None or self._slow is None:
            self._fast = self._slow = value
            return
        self._fast += (value - self._fast) * min(1.0, self._step / _FAST)
        self._slow += (value - self._slow) * min(1.0, self._step / _SLOW)

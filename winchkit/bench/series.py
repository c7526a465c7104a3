"""A signal remembered just long enough to interpolate it at another signal's moments."""

from __future__ import annotations

import math
from collections import deque

__all__ = ["Series"]


class Series:
    """Samples in order of time; one thread appends, one thread reads with rising time."""

    def __init__(self, max_gap: float) -> None:
        """Samples further apart than ``max_gap`` (s) are not bridged."""
        self._samples: deque[tuple[float, float]] = deque()
        self._max_gap = max_gap

    def append(self, time: float, value: float) -> None:
        """Add a sample; one that is not newer than the last is dropped."""
        if not self._samples or time > self._samples[-1][0]:
            self._samples.append((time, value))

    def reaches(self, time: float) -> bool:
        """Whether a sample at or after ``time`` is there."""
        return bool(self._samples) and self._samples[-1][0] >= time

    def at(self, time: float) -> float:
        """Value at ``time``, linearly between its two neighbours; NaN where one is missing.

        Samples before the neighbours are forgotten.
        """
        samples = self._samples
        while len(samples) >= 2 and samples[1][0] <= time:
            samples.popleft()
        if not samples or samples[0][0] > time:
            return math.nan
        (t0, y0) = samples[0]
        if t0 == time:
            return y0
        if len(samples) < 2 or samples[1][0] - t0 > self._max_gap:
            return math.nan
        (t1, y1) = samples[1]
        return y0 + (y1 - y0) * (time - t0) / (t1 - t0)

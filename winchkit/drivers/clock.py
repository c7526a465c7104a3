"""Clock protocol: time is an argument, so that timeouts and faults are tested in simulated time."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """A steady clock."""

    def now(self) -> float:
        """Seconds since an arbitrary start."""

    def sleep(self, duration: float) -> None:
        """Return after ``duration`` seconds; at once when it is not positive."""


class MonotonicClock:
    """The machine's steady clock, the same in every process of it."""

    def now(self) -> float:
        """Seconds since an arbitrary start."""
        return time.monotonic()

    def sleep(self, duration: float) -> None:
        """Return after ``duration`` seconds; at once when it is not positive."""
        if duration > 0:
            time.sleep(duration)

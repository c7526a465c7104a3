"""Lets several winches start in one and the same cycle."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

__all__ = ["StartGate"]


class StartGate:
    """Opens for all members at once, in the first cycle in which each of them is ready.

    The members ask one after another within a cycle while feedback keeps coming in; they are all
    told what the first of them was told.
    """

    def __init__(self, ready: Sequence[Callable[[], bool]]) -> None:
        self._ready = ready
        self._asked = -math.inf
        self._open = False

    def open(self, time: float) -> bool:
        """Whether to start in the cycle of this time of motion (s)."""
        if not self._open and time != self._asked:
            self._asked = time
            self._open = all(ready() for ready in self._ready)
        return self._open

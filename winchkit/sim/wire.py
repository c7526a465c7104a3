"""The cable of a simulated CAN bus: what it loses, what it delays, and what it has carried."""

from __future__ import annotations

import threading
from collections.abc import Callable, Container
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count
from random import Random

from winchkit.errors import UsageError

__all__ = ["Carried", "Wire"]


@dataclass(frozen=True, slots=True)
class Carried:
    """A frame between the simulated drives and everybody else."""

    time: float
    """On the simulation's clock, s."""
    identifier: int
    data: bytes
    from_drive: bool
    lost: bool = False
    """Whether it never arrived."""


@dataclass(frozen=True)
class _Trouble:
    identifiers: Container[int]
    share: float
    delay: float | None
    """s; None loses the frame."""


class Wire:
    """Between the simulated drives and everybody else on one bus.

    ``taps`` are called with every frame, in the order of their arrival at the other end. Safe to
    use from several threads.
    """

    def __init__(self, clock: Callable[[], float], *, seed: int | str = 0) -> None:
        self.taps: list[Callable[[Carried], None]] = []
        self._clock, self._random = clock, Random(f"wire/{seed}")
        self._lock = threading.Lock()
        self._troubles: list[_Trouble] = []
        self._late: dict[bool, list[tuple[float, int, int, bytes]]] = {False: [], True: []}
        self._order = count()

    def disturb(
        self, identifiers: Container[int], *, share: float = 1.0, delay: float | None = None
    ) -> Callable[[], None]:
        """Lose a share of these frames, or let them come ``delay`` s late.

        Returns a function that ends it. Raises UsageError for a share or a delay that cannot be.
        """
        if not 0 < share <= 1 or not (delay is None or delay > 0):
            raise UsageError(
                f"a wire cannot disturb a share of {share:g} of its frames by {delay} s; "
                "a share is above 0 and at most 1, a delay above 0 s"
            )
        trouble = _Trouble(identifiers, share, delay)
        with self._lock:
            self._troubles.append(trouble)

        def end() -> None:
            with self._lock:
                self._troubles = [one for one in self._troubles if one is not trouble]

        return end

    def carry(self, identifier: int, data: bytes, *, from_drive: bool) -> bool:
        """Take a frame; True where it goes through at once, else it is lost or comes ``due``."""
        with self._lock:
            if not self.taps and not self._troubles:
                return True
            now = self._clock()
            trouble = self._trouble_of(identifier)
            if trouble is not None and trouble.delay is not None:
                late = (now + trouble.delay, next(self._order), identifier, data)
                heappush(self._late[from_drive], late)
                return False
            self._tell(Carried(now, identifier, data, from_drive, trouble is not None))
            return trouble is None

    def due(self, *, from_drive: bool) -> tuple[int, bytes] | None:
        """Next late frame whose time has come, of one direction."""
        with self._lock:
            late = self._late[from_drive]
            if not late:
                return None
            now = self._clock()
            if late[0][0] > now:
                return None
            _, _, identifier, data = heappop(late)
            self._tell(Carried(now, identifier, data, from_drive))
            return identifier, data

    def _trouble_of(self, identifier: int) -> _Trouble | None:
        for trouble in self._troubles:
            if identifier in trouble.identifiers and self._random.random() < trouble.share:
                return trouble
        return None

    def _tell(self, carried: Carried) -> None:
        for tap in self.taps:
            tap(carried)

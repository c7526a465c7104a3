"""A clock for a bench and its simulation in one process, on a machine that is busy elsewhere."""

from __future__ import annotations

import threading
import time

__all__ = ["PacedClock"]

_SLACK = 0.008
_PATIENCE = 1.0
_NAP = 1e-3


class PacedClock:
    """A steady clock that stands still while one of those who must keep pace does not.

    Whoever must keep pace beats. The clock never runs further than ``slack`` ahead of the beat
    that is oldest, so that a stall of the process looks to everybody as if it had not been: no
    drive coasts on for a tenth of a second because another program took the processor. One who
    has not beaten for a second is taken to have ended.
    """

    def __init__(self, slack: float = _SLACK) -> None:
        self._slack = slack
        self._lock = threading.Lock()
        self._wall = time.monotonic()
        self._time = self._wall
        self._beats: dict[str, tuple[float, float]] = {}
        self.stood_still = 0.0
        """How much time was left out so far, s."""

    def now(self) -> float:
        """Seconds since an arbitrary start."""
        with self._lock:
            return self._advance()

    def sleep(self, duration: float) -> None:
        """Return after ``duration`` seconds of this clock; at once when it is not positive."""
        end = self.now() + duration
        while (left := end - self.now()) > 0:
            time.sleep(min(left, _NAP))

    def beat(self, who: str) -> float:
        """Keep pace; returns the time."""
        with self._lock:
            self._beats[who] = self._advance(), self._wall
            return self._time

    def simulation(self) -> float:
        """Beat as the simulation: the clock to hand to a ``LiveBench``."""
        return self.beat("simulation")

    def control(self, _snapshot: object) -> None:
        """Beat as the control loop: the callback to hand to ``Bench.on_cycle``."""
        self.beat("control")

    def _advance(self) -> float:
        wall = time.monotonic()
        wanted = self._time + wall - self._wall
        waiting = [at for at, seen in self._beats.values() if wall - seen < _PATIENCE]
        allowed = min((at + self._slack for at in waiting), default=wanted)
        reached = max(self._time, min(wanted, allowed))
        self.stood_still += wanted - reached
        self._time, self._wall = reached, wall
        return reached

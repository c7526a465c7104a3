"""A clock for a bench and its simulation in one process on a busy computer."""

from __future__ import annotations

import threading
import time

_SLACK = 0.008
"""s: two cycles of 4 ms; a drive then reacts to the host's silence as late as a real one would."""
_TIMEOUT = 1.0
"""s: a participant without a report is ended; a suspension by the scheduler is shorter."""
_NAP = 1e-3
"""s: resolution of the sleeps."""


class PacedClock:
    """A steady clock that stands still while one of its participants is suspended.

    Every participant reports at each of its cycles (:meth:`beat`). The clock runs at most ``slack``
    ahead of the oldest report, so that a suspension of the process has no effect on the simulation:
    otherwise a drive would run on while another program has the processor. A participant without a
    report for a second counts as ended.
    """

    def __init__(self, slack: float = _SLACK) -> None:
        self._slack = slack
        self._lock = threading.Lock()
        self._wall = time.monotonic()
        self._time = self._wall
        self._beats: dict[str, tuple[float, float]] = {}

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
        """Report a cycle of a participant; returns the time."""
        with self._lock:
            self._beats[who] = self._advance(), self._wall
            return self._time

    def simulation(self) -> float:
        """Report of the simulation: the clock for a ``LiveBench``."""
        return self.beat("simulation")

    def control(self, _snapshot: object) -> None:
        """Report of the control loop: the callback for ``Bench.on_cycle``."""
        self.beat("control")

    def _advance(self) -> float:
        wall = time.monotonic()
        wanted = self._time + wall - self._wall
        waiting = [at for at, seen in self._beats.values() if wall - seen < _TIMEOUT]
        allowed = min((at + self._slack for at in waiting), default=wanted)
        reached = max(self._time, min(wanted, allowed))
        self._time, self._wall = reached, wall
        return reached

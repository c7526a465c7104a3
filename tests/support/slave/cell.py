"""A load cell that says what the test says, read ten times a second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from slave.rig import Rig
from winchkit.bench.bench import Bench
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.errors import ConnectionLost


@dataclass
class Cell:
    """A sensor as the bench sees one."""

    rig: Rig
    tension: Callable[[], float] = field(default=lambda: 100.0)
    name: str = "A.cell"
    period: float = 0.02
    max_age: float = 0.3
    latest: InstrumentReading | None = None
    problem: ConnectionLost | None = None
    tared: bool | None = None
    _next: float = 0.0

    def fit(self, bench: Bench, winch: str = "A") -> Cell:
        """Become the load cell of a winch."""
        bench.loop.winches[winch].sensors = {"cell": self}
        self.rig.each.insert(0, self._sample)
        self._sample()
        return self

    def _sample(self) -> None:
        now = self.rig.time
        if now < self._next:
            return
        self._next = now + self.period
        value = self.tension()
        self.latest = InstrumentReading(value, value, value, Quality.GOOD, now, now, now, 1e-3)

"""What a drive may do: judged by its own state and the motor's true speed, at every step of 1 ms.

It may be enabled while a command stands that was given after the last trip: a jog until its
dead-man has expired and the winch has ramped down, a move until it was to be over. What the drive
does unasked (a fault that enables it) must be ended within the time of a first stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from slave.power import State
from slave.slave import Slave

FIRST_STOP = 0.15
"""From the first sign to quick stop, s."""
ESCALATED = 0.5
"""Where quick stop is refused and the drive's own watchdog has to do it, s."""
_BRAKES = 0.5
"""From the loss of torque, or the beginning of a quick stop, to rest, s."""
_TURNS = 0.5
"""rad/s."""


@dataclass
class Oracle:
    """Watches one slave; the test reports commands, trips and faults to it."""

    slave: Slave
    allowed: float = -math.inf
    """Until when it may be enabled, in the slave's time."""
    excused: bool = False
    """A fault makes it turn or receive nothing, which no command can end."""
    wrongs: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.slave.watch = self._look

    @property
    def time(self) -> float:
        """The slave's own time, s."""
        return self.slave.time

    def command(self, duration: float) -> None:
        """A command was accepted that lasts this long."""
        self.allowed = max(self.allowed, self.time + duration)

    def trip(self, within: float = FIRST_STOP) -> None:
        """Whatever was commanded counts no more."""
        self.allowed = min(self.allowed, self.time + within)

    def unasked(self, within: float = FIRST_STOP) -> None:
        """It is enabled by somebody else now; that may last no longer than this."""
        self.allowed = max(self.allowed, self.time + within)

    def _look(self, slave: Slave) -> None:
        if self.excused or slave.time <= self.allowed:
            return
        late = slave.time - self.allowed
        if slave.power.state is State.ENABLED:
            self._note(f"enabled {late:.3f} s after the last command had ended")
        elif abs(slave.motor.velocity) > _TURNS and late > _BRAKES:
            self._note(f"turns at {slave.motor.velocity:.2f} rad/s {late:.3f} s after that")

    def _note(self, words: str) -> None:
        if not self.wrongs:
            self.wrongs.append(words)

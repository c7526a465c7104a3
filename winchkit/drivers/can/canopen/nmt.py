"""NMT of CiA 301: commands and states in words, heartbeat consumer and producer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar


class NmtState(IntEnum):
    """NMT state, as the state byte of a heartbeat has it."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127

    def __str__(self) -> str:
        return self.name.lower().replace("_", "-")


NMT_STATES = frozenset(int(state) for state in NmtState)
"""State bytes of CiA 301."""


class NmtCommand(IntEnum):
    """NMT command specifier."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


_WORDS = {
    int(command): command.name.lower().replace("_", " ").replace("pre ", "pre-")
    for command in NmtCommand
}


def state_text(state: int) -> str:
    """NMT state of a heartbeat in words; the number of one that CiA 301 does not have."""
    return str(NmtState(state)) if state in NMT_STATES else f"state {state:02X}h"


def command_text(command: int) -> str:
    """NMT command specifier in words; the number of one that CiA 301 does not have."""
    return _WORDS.get(command, f"unknown ({command:02X}h)")


@dataclass
class HeartbeatConsumer:
    """Heartbeat consumer of one node; as in CiA 301, monitoring begins with the first heartbeat."""

    timeout: float
    """s."""
    missing: ClassVar[str] = "the drive's heartbeat is gone; check its power and the bus"
    """Cause and remedy where it is lost."""
    state: int | None = None
    boot_ups: int = 0
    last: float | None = None

    def receive(self, data: bytes, now: float) -> None:
        """Take a frame of 700h + node."""
        if not data:
            return
        self.state = data[0] & 0x7F
        self.last = now
        if self.state == NmtState.BOOT_UP:
            self.boot_ups += 1

    def forget(self) -> None:
        """Discard what was received so far; monitoring begins again."""
        self.last = self.state = None

    def age(self, now: float) -> float | None:
        """Seconds since the last heartbeat; None before the first."""
        return None if self.last is None else now - self.last

    def lost(self, now: float, since: float = -math.inf) -> bool:
        """Whether an armed watch has waited longer than its timeout, from ``since`` (s) on."""
        last = self.last  # read once: `forget` may run on another thread
        return last is not None and now - (last if last > since else since) > self.timeout


@dataclass
class HeartbeatProducer:
    """Times of the host's heartbeat, asked for by the control loop so that it ends with that."""

    period: float
    """s."""
    last: float = float("nan")
    """When it was due last, s; NaN before the first time."""
    _next: float = float("-inf")

    def due(self, now: float) -> bool:
        """Whether to send one now; then counts on to the next."""
        if now < self._next:
            return False
        self.last = now
        self._next = (
            now + self.period if now - self._next > self.period else self._next + self.period
        )
        return True

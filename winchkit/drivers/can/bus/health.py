"""Error state and counts of a CAN bus, from its error frames."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

_CONTROLLER, _BUS_OFF, _RESTARTED = 0x004, 0x040, 0x100
"""Classes of an error frame (linux/can/error.h: CAN_ERR_CRTL, CAN_ERR_BUSOFF, CAN_ERR_RESTARTED).
"""
_OVERFLOW = 0x01
"""Data byte 1: CAN_ERR_CRTL_RX_OVERFLOW."""
_WARNING, _PASSIVE, _ACTIVE = 0x0C, 0x30, 0x40
"""Data byte 1: receive and transmit bits of CAN_ERR_CRTL warning and passive, and
CAN_ERR_CRTL_ACTIVE."""


class BusState(Enum):
    """Error state of the CAN controller (ISO 11898-1)."""

    ACTIVE = "error active"
    WARNING = "error warning"
    PASSIVE = "error passive"
    OFF = "bus off"
    DOWN = "down"
    """The interface cannot be read any more."""


@dataclass(frozen=True, slots=True)
class BusHealth:
    """State and counts of a bus since it was opened; a snapshot."""

    state: BusState = BusState.ACTIVE
    received: int = 0
    sent: int = 0
    error_frames: int = 0
    """And frames that could not be read."""
    bus_off: int = 0
    """Times that the controller left the bus."""
    error_passive: int = 0
    overruns: int = 0
    """Frames that the controller or its driver lost because they were not read in time."""
    dropped: int = 0
    """Frames that the socket's queue had no room for."""
    unsent: int = 0
    """Frames that could not be sent."""
    reopened: int = 0
    foreign_syncs: int = 0
    """SYNC frames that another producer sent."""
    fault: str = ""
    """Why it cannot be used; empty while it can."""

    @property
    def lossless(self) -> bool:
        """Whether nothing is known to be lost."""
        return not (self.overruns or self.dropped or self.unsent)

    def __str__(self) -> str:
        counts = {
            "received": self.received,
            "sent": self.sent,
            "error frames": self.error_frames,
            "bus off": self.bus_off,
            "error passive": self.error_passive,
            "overruns": self.overruns,
            "dropped": self.dropped,
            "not sent": self.unsent,
            "reopened": self.reopened,
            "SYNC of another producer": self.foreign_syncs,
        }
        words = ", ".join(f"{name} {count}" for name, count in counts.items() if count)
        return f"{self.state.value}: {words or 'nothing yet'}" + (
            f"; {self.fault}" if self.fault else ""
        )


@dataclass
class ErrorTally:
    """Reads error frames in the layout of SocketCAN, which python-can hands on."""

    state: BusState = BusState.ACTIVE
    frames: int = 0
    bus_off: int = 0
    error_passive: int = 0
    overruns: int = 0

    def take(self, identifier: int, data: bytes) -> None:
        """Count an error frame: its identifier holds classes, its second byte the controller's."""
        self.frames += 1
        if identifier & _CONTROLLER and len(data) > 1:
            self._controller(data[1])
        if identifier & _BUS_OFF:
            self.enter(BusState.OFF)
        elif identifier & _RESTARTED:
            self.enter(BusState.ACTIVE)

    def _controller(self, detail: int) -> None:
        if detail & _OVERFLOW:
            self.overruns += 1
        if detail & _PASSIVE:
            self.enter(BusState.PASSIVE)
        elif detail & _WARNING:
            self.enter(BusState.WARNING)
        elif detail & _ACTIVE:
            self.enter(BusState.ACTIVE)

    def enter(self, state: BusState) -> None:
        """Take a state of the controller."""
        if state is self.state:
            return
        self.state = state
        self.bus_off += state is BusState.OFF
        self.error_passive += state is BusState.PASSIVE

"""Listens on a virtual CAN bus to what the host sends."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Self

import can

from winchkit.cli.dry_run import Frame
from winchkit.drivers.clock import Clock

if TYPE_CHECKING:
    from winchkit.schema.bench import BusSpec

__all__ = ["FrameTap"]

_WAIT = 0.02
_FROM_HOST = (0x000, 0x200, 0x300, 0x400, 0x500, 0x600)
"""Identifiers, less the node number, that a host sends; and its SYNC, heartbeat and LSS."""
_SYNC, _HEARTBEAT, _LSS = 0x080, 0x700, 0x7E5


class FrameTap:
    """Collects what the host sends for as long as its ``with`` block lasts."""

    def __init__(self, name: str, bus: BusSpec, clock: Clock, frames: list[Frame]) -> None:
        """Append to ``frames``; times count from now."""
        self._name, self._clock, self._begun = name, clock, clock.now()
        self._host = (_SYNC, _HEARTBEAT + bus.node, _LSS)
        self._frames = frames
        self._bus = can.Bus(interface="virtual", channel=bus.channel)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._listen, name=f"tap-{name}", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        self._bus.shutdown()

    def _listen(self) -> None:
        """Take every frame that there is, also those that wait when it is to end."""
        while True:
            message = self._bus.recv(0.0 if self._stopping.is_set() else _WAIT)
            if message is None:
                if self._stopping.is_set():
                    return
                continue
            identifier = message.arbitration_id
            if identifier in self._host or identifier & ~0x7F in _FROM_HOST:
                time = self._clock.now() - self._begun
                self._frames.append(Frame(time, self._name, identifier, bytes(message.data)))

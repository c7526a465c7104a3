"""The stop by SDO from the control loop: what one stop leaves for the next."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.sdo_stop import SdoStop

_ABORT = bytes.fromhex("8040600022000008")
_WROTE = bytes.fromhex("6040600000000000")


class Bus:
    """Takes frames, and gives replies to whoever listens."""

    def __init__(self) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.handlers: dict[int, Callable[[bytes, float], None]] = {}

    def on(self, identifier: int, handler: Callable[[bytes, float], None]) -> None:
        self.handlers[identifier] = handler

    def off(self, identifier: int) -> None:
        del self.handlers[identifier]

    def send(self, identifier: int, data: bytes) -> None:
        self.sent.append((identifier, data))

    def pass_on(self, *_: Any) -> None:
        raise AssertionError("it is a reply to the stop")


def test_a_refusal_is_forgotten_with_the_stop_that_was_refused() -> None:
    """The next stop begins before its first SDO frame, and must not count as refused."""
    bus = Bus()
    stop = SdoStop(cast(CanBus, bus), 5)
    stop.send()
    bus.handlers[0x585](_ABORT, 0.0)
    assert stop.refused
    stop.end()
    assert not stop.refused
    stop.send()
    bus.handlers[0x585](_WROTE, 0.0)
    assert (stop.taken, stop.refused) == (True, False)

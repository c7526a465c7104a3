"""Frames for somebody who watches: sent and received ones, until the tap expires."""

from __future__ import annotations

import math

from waiting import until
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.bus.frame_tap import FrameTap
from winchkit.drivers.clock import MonotonicClock
from winchkit.schema.bench import BusSpec


def test_sent_and_received_frames_are_collected_until_the_tap_expires() -> None:
    spec = BusSpec("can", interface="virtual", channel="frame tap")
    here, there = (CanBus(spec, name, MonotonicClock()) for name in ("here", "there"))
    tap = here.tap = FrameTap(math.inf)

    def receive(count: int) -> None:
        until(lambda: here.received >= count)
        assert here.received == count

    try:
        for number in range(3):
            here.send(0x201, bytes((number,)))
            there.send(0x181, bytes((number,)))
            receive(number + 1)
        assert [(count, frame.identifier, frame.data) for count, frame in tap.newest] == [
            (3, 0x201, b"\x02"),
            (3, 0x181, b"\x02"),
        ]
        assert [frame.identifier for frame in tap.last] == [0x201, 0x181] * 3
        tap.expires = 0.0
        there.send(0x181, b"")
        receive(4)
        here.send(0x201, b"")
        assert here.tap is None
        assert len(tap.last) == 6
    finally:
        here.close()
        there.close()

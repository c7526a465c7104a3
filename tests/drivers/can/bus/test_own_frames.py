"""Frames seen on a bus: for somebody who watches, and never taken for somebody else's."""

from __future__ import annotations

import math
import threading
import time
from typing import Any

import can
import pytest

from sim_process import free_port
from waiting import run_together, until
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.bus.frame_tap import FrameTap
from winchkit.drivers.can.bus.interface import _Library
from winchkit.drivers.clock import MonotonicClock
from winchkit.schema.bench import BusSpec

_GROUP = "239.74.163.2"
_RPDO, _SDO, _NMT = 0x201, 0x601, 0x000


@pytest.fixture
def group() -> BusSpec:
    return BusSpec("can", interface="udp_multicast", channel=_GROUP, port=free_port(_GROUP))


def test_over_multicast_only_foreign_frames_are_received(group: BusSpec) -> None:
    """Frames of the loop, of the SDO client and NMT from three threads, and one of another host."""
    bus, heard, seen = CanBus(group, "can", MonotonicClock()), list[bytes](), list[int]()
    stranger = can.Bus(interface="udp_multicast", channel=_GROUP, port=group.port)
    try:
        for identifier in (_RPDO, _SDO, _NMT):
            bus.on_foreign(identifier, lambda data, _now: heard.append(data))
            bus.on_foreign(identifier, lambda _data, _now: None)
        bus.on(0x702, lambda _data, _now: seen.append(1))
        sends = (
            lambda number: bus.send(_RPDO, bytes((number % 7, 0x0F))),
            lambda number: bus.network.send_message(_SDO, bytearray((0x2B, number % 3))),
            lambda number: bus.nmt(number % 2, 1),
        )

        def run(send: Any) -> None:
            for number in range(300):
                send(number)
                time.sleep(0.001)

        threads = [threading.Thread(target=run, args=(send,)) for send in sends]
        run_together(threads)
        stranger.send(can.Message(arbitration_id=_RPDO, data=b"\x06\0", is_extended_id=False))
        stranger.send(can.Message(arbitration_id=0x702, data=b"\x05", is_extended_id=False))
        until(lambda: bool(seen))
        assert bus.received == 2, "what was sent does not come back"
        assert heard == [b"\x06\0"]
    finally:
        stranger.shutdown()
        bus.close()


def test_a_confirmation_of_what_was_sent_is_no_frame() -> None:
    """As of gs_usb, and of any interface whose receive_own_messages somebody has configured."""
    channel = f"confirmed {time.monotonic()}"
    port = _Library(
        can.Bus(interface="virtual", channel=channel, receive_own_messages=True), stamped=False
    )
    other = can.Bus(interface="virtual", channel=channel)
    try:
        port.send(_RPDO, b"ours")
        other.send(can.Message(arbitration_id=_RPDO, data=b"theirs", is_extended_id=False))
        frames = [*port.receive(0.1), *port.receive(0.1)]
        assert [frame.data for frame in frames] == [b"theirs"]
    finally:
        other.shutdown()
        port.close()


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

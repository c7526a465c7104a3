"""What only a real CAN socket can show: run in the machine by ``suite.py``, on an interface of
its own, with can-utils and iproute2 as the other side.
"""

from __future__ import annotations

import socket
import struct
import subprocess
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.bus.health import BusState
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec

CHANNEL = "vcan1"
SPEC = BusSpec("can", interface="socketcan", channel=CHANNEL)
HEARD = 0x123
PACKED = struct.Struct("=IB3x8s")
HELD_UP = 0.015
"""s; a delay above 20 ms counts as a clock that was set."""


def until(condition: Callable[[], bool], within: float = 10.0) -> None:
    deadline = time.monotonic() + within
    while not condition():
        assert time.monotonic() < deadline, "it did not come to that"
        time.sleep(0.01)


def cansend(frame: str) -> None:
    subprocess.run(["cansend", CHANNEL, frame], check=True)


def link(state: str) -> None:
    subprocess.run(["ip", "link", "set", CHANNEL, state], check=True)


def other_side() -> socket.socket:
    """A raw socket of the kernel's own, without python-can."""
    found = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    found.bind((CHANNEL,))
    return found


@pytest.fixture
def bus() -> Iterator[CanBus]:
    opened = CanBus(SPEC, "can", MonotonicClock())
    yield opened
    opened.close()


def test_frames_come_and_go(bus: CanBus) -> None:
    heard: list[bytes] = []
    bus.on(HEARD, lambda data, _time: heard.append(data))
    cansend(f"{HEARD:03X}#DEADBEEF")
    until(lambda: heard == [b"\xde\xad\xbe\xef"])
    with subprocess.Popen(
        ["candump", "-L", "-n", "1", CHANNEL], stdout=subprocess.PIPE, text=True
    ) as witness:
        assert witness.stdout is not None
        time.sleep(0.3)
        bus.send(0x201, b"\x0f\x00")
        assert witness.stdout.readline().split()[-1] == "201#0F00"


def test_remote_frames_are_sent_and_are_no_data(bus: CanBus) -> None:
    heard: list[bytes] = []
    bus.on(HEARD, lambda data, _time: heard.append(data))
    cansend(f"{HEARD:03X}#R")
    cansend(f"{HEARD:03X}#02")
    until(lambda: heard == [b"\x02"])
    with other_side() as other:
        bus.remote(0x705)
        identifier, length, _ = PACKED.unpack(other.recv(PACKED.size))
    assert (identifier, length) == (0x705 | socket.CAN_RTR_FLAG, 1)


def test_times_are_the_kernels_and_not_those_of_the_reading(bus: CanBus) -> None:
    """A receive thread that is held up must not make a frame look younger than it is."""
    times: list[float] = []
    held, go_on = threading.Event(), threading.Event()

    def hold_up(_data: bytes, _time: float) -> None:
        held.set()
        go_on.wait(10.0)

    bus.on(0x100, hold_up)
    bus.on(HEARD, lambda _data, at: times.append(at))
    with other_side() as other:
        other.send(PACKED.pack(0x100, 0, bytes(8)))
        assert held.wait(10.0)
        before = bus.clock.now()
        other.send(PACKED.pack(HEARD, 0, bytes(8)))
        sent = bus.clock.now()
        time.sleep(HELD_UP)
        go_on.set()
        until(lambda: bool(times))
    read = bus.clock.now()
    assert read - sent >= HELD_UP
    # The first frame gave the offset between the clocks, and was itself read a little late.
    assert before - HELD_UP / 2 <= times[0] <= sent + HELD_UP / 2


@pytest.mark.parametrize(
    ("frame", "state", "count"),
    [
        ("20000004#0008000000000000", BusState.WARNING, "error_frames"),
        ("20000004#0020000000000000", BusState.PASSIVE, "error_passive"),
        ("20000004#0001000000000000", BusState.ACTIVE, "overruns"),
        ("20000040#0000000000000000", BusState.OFF, "bus_off"),
    ],
)
def test_error_frames_are_counted_and_reported(
    bus: CanBus, frame: str, state: BusState, count: str
) -> None:
    cansend(frame)
    until(lambda: bus.health.error_frames == 1)
    assert bus.health.state is state
    assert getattr(bus.health, count) == 1
    assert bool(bus.fault) is (state is BusState.OFF)
    assert bus.health.received == 0


def test_frames_that_the_socket_had_no_room_for_are_counted_one_by_one(bus: CanBus) -> None:
    """Read plus dropped is exactly what was sent."""
    held, go_on = threading.Event(), threading.Event()
    count = 0

    def first(_data: bytes, _time: float) -> None:
        held.set()
        go_on.wait(60.0)

    def heard(_data: bytes, _time: float) -> None:
        nonlocal count
        count += 1

    bus.on(0x100, first)
    bus.on(HEARD, heard)
    cansend("100#")
    assert held.wait(10.0)
    total = 12_000
    with other_side() as flood:
        for _ in range(total):
            flood.send(PACKED.pack(HEARD, 8, bytes(8)))
    go_on.set()
    # The count of drops comes with the next frame that finds room.
    until(lambda: count > 0 and bus.health.received == count + 1)
    time.sleep(0.5)
    cansend(f"{HEARD:03X}#")
    until(lambda: count + bus.health.dropped == total + 1)
    assert bus.health.dropped > 0
    assert not bus.health.lossless


def test_an_interface_that_goes_down_is_a_fault_and_comes_back_by_reopening(bus: CanBus) -> None:
    heard: list[bytes] = []
    bus.on(HEARD, lambda data, _time: heard.append(data))
    link("down")
    try:
        until(lambda: bus.health.state is BusState.DOWN)
        assert "cannot receive" in (bus.fault or "")
        with pytest.raises(ConnectionLost, match="cannot send"):
            bus.sync()
    finally:
        link("up")
    bus.reopen()
    assert bus.fault is None
    cansend(f"{HEARD:03X}#01")
    until(lambda: heard == [b"\x01"])
    assert bus.health.reopened >= 1


def test_an_interface_that_does_not_exist_is_reported(bus: CanBus) -> None:
    nowhere = BusSpec("can", interface="socketcan", channel="vcan9")
    with pytest.raises(ConnectionLost, match="vcan9"):
        CanBus(nowhere, "can", bus.clock)

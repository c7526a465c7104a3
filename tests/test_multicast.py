"""Frames by UDP multicast, against python-can's own interface."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing

import can
import pytest

from winchkit.multicast import MulticastPort
from winchkit.schema.bench import BusSpec
from winchkit.sim.live.buses import wired

Ports = tuple[MulticastPort, MulticastPort, can.BusABC]


@pytest.fixture
def ports() -> Iterator[Ports]:
    bus = wired(BusSpec("can"), "test", "udp_multicast")
    group, port = str(bus.channel), int(bus.port or 0)
    with ExitStack() as opened:
        try:
            mine, other = (opened.enter_context(closing(MulticastPort(group, port))) for _ in "ab")
            mine.send(0x7FF, b"")
            library = can.Bus(interface="udp_multicast", channel=group, port=port)
        except OSError as error:
            pytest.skip(f"no multicast on this machine: {error}")
        with library:
            other.receive(0.5)
            yield mine, other, library


def test_a_frame_reaches_all_but_its_sender(ports: Ports) -> None:
    mine, other, library = ports
    mine.send(0x181, b"12345678")
    assert other.receive(1.0) == (0x181, b"12345678")
    heard = library.recv(1.0)
    assert heard is not None
    assert (heard.arbitration_id, bytes(heard.data), heard.is_extended_id) == (
        0x181, b"12345678", False,
    )  # fmt: skip
    assert mine.receive(0.01) is None


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's time stamps are those of Linux")
def test_a_frame_has_the_time_of_its_arrival_however_late_it_is_taken(ports: Ports) -> None:
    mine, other, _ = ports
    before = time.time()
    mine.send(0x181, b"")
    after = time.time()
    time.sleep(0.05)
    assert other.receive(1.0) == (0x181, b"")
    assert before - 1e-3 <= other.arrived <= after + 1e-3


def test_frames_of_the_library_are_received_but_for_extended_ones(ports: Ports) -> None:
    mine, _, library = ports
    library.send(can.Message(arbitration_id=0x18FF0001, data=b"x", is_extended_id=True))
    library.send(can.Message(arbitration_id=0x80, data=b"", is_extended_id=False))
    assert [mine.receive(1.0), mine.receive(1.0)] == [None, (0x80, b"")]

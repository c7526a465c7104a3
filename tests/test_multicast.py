"""Frames by UDP multicast, against python-can's own interface."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing

import can
import pytest

from command_line import own_process
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


_TWO_INTERFACES = """
ip link set lo up
ip link add net0 type veth peer name net1
ip link set net0 up
ip link set net1 up
ip address add 192.0.2.2/24 dev net0
ip route add default via 192.0.2.1
ip route add 239.0.0.0/8 dev lo
"""
_EXCHANGE = """
import sys
from winchkit.multicast import MulticastPort
import can
mine, other = (MulticastPort("239.74.163.2", 43113) for _ in "ab")
with can.Bus(interface="udp_multicast", channel="239.74.163.2", port=43113) as library:
    mine.send(0x181, b"1")
    assert other.receive(1.0) == (0x181, b"1")
    assert library.recv(1.0).arbitration_id == 0x181
    library.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    assert mine.receive(1.0) == (0x80, b"")
    assert mine.receive(0.05) is None, "what it has sent itself"
"""


@pytest.mark.skipif(sys.platform != "linux", reason="network namespaces are those of Linux")
def test_a_group_on_the_loopback_is_reached_beside_a_network() -> None:
    """The route to the group decides where frames go, not that to everything else."""
    if shutil.which("unshare") is None or shutil.which("ip") is None:
        pytest.skip("no unshare or no ip here")
    made = own_process(
        "unshare",
        "-rn",
        "sh",
        "-ec",
        f"{_TWO_INTERFACES}exec {sys.executable} -c 'pass'",
        code=None,
    )
    if made.returncode:
        pytest.skip(f"no second network here: {made.stderr.strip()}")
    script = f'{_TWO_INTERFACES}exec "$0" -c "$1"'
    own_process("unshare", "-rn", "sh", "-ec", script, sys.executable, _EXCHANGE)

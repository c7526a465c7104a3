"""An independent CANopen implementation, npm's ``canopen``, on the bus with ours."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from can_bridge import Bridge
from npm_install import install
from waiting import until
from winchkit import catalog
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer, NmtState
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import DeviceRefused, NoReply
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_simbench
from winchkit.schema.simbench import NoiseSpec
from winchkit.sim.drive.object_dictionary import Entry, ObjectDictionary
from winchkit.sim.live.bench import LiveBench

pytestmark = pytest.mark.realtime

PACKAGE = "canopen@6.2.1"
PEER = Path(__file__).with_name("peer.cjs")
MASTER, SLAVE, DRIVE = 100, 5, 1


@pytest.fixture(scope="session")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package installed by npm."""
    return install(tmp_path_factory.mktemp("npm"), PACKAGE)


class Peer:
    """The other implementation's process; its requests are methods."""

    def __init__(self, modules: Path, channel: str) -> None:
        self._bridge = Bridge(channel)
        self._process = subprocess.Popen(
            ["node", str(PEER), str(self._bridge.port)],
            env={**os.environ, "NODE_PATH": str(modules)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._bridge.admit()
        assert self._answer() == "ready"

    def ask(self, *request: Any) -> Any:
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def number(self, node: int, index: int, sub: int = 0) -> bytes:
        """Bytes of an object, read by the peer's SDO client."""
        answer = self.ask("read", node, index, sub)
        assert "hex" in answer, f"{index:04X}h:{sub}: {answer}"
        return bytes.fromhex(answer["hex"])

    def last(self, kind: str) -> Any:
        """What the peer has seen last of a kind; None before the first."""
        return next(reversed(self.ask("seen")[kind]), None)

    def close(self) -> None:
        self._bridge.close()
        self._process.communicate(timeout=10)

    def _answer(self) -> Any:
        line = self._process.stdout.readline()
        assert line, "the peer has ended"
        return json.loads(line)


# The peer is the master, our simulated drive the slave.


@pytest.fixture(scope="module")
def live() -> Iterator[LiveBench]:
    declared = replace(read_simbench(catalog.find("sim", "spiral-bench")), noise=NoiseSpec())
    with LiveBench(declared) as running:
        yield running


@pytest.fixture(scope="module")
def master(live: LiveBench, modules: Path) -> Iterator[Peer]:
    channel = live.bench_spec.bus["can"].channel
    assert channel is not None
    peer = Peer(modules, channel)
    peer.ask("master", MASTER, DRIVE, 400)
    yield peer
    peer.close()


@pytest.fixture
def objects(live: LiveBench) -> ObjectDictionary:
    return live.winches["A"].drive.objects


def test_the_peer_reads_the_whole_dictionary(
    live: LiveBench, master: Peer, objects: ObjectDictionary
) -> None:
    """Expedited and segmented, each object with the bytes that the drive has inside."""
    lengths = set()
    for index, sub in list(objects):
        entry = objects.entry((index, sub))
        assert isinstance(entry, Entry)
        if not entry.readable:
            answer = master.ask("read", DRIVE, index, sub)
            assert answer["abort"] == 0x06010001, answer
            continue
        found = master.number(DRIVE, index, sub)
        with live.up_to_date():
            inside = objects.read((index, sub))
        assert isinstance(inside, bytes)
        assert found == inside, f"{index:04X}h:{sub}"
        lengths.add(len(found))
    assert min(lengths) <= 4 < max(lengths), "some of it came in segments"


def test_the_peer_writes_and_reads_back(
    live: LiveBench, master: Peer, objects: ObjectDictionary
) -> None:
    assert "hex" in master.ask(
        "write", DRIVE, 0x60FF, 0, (-77).to_bytes(4, "little", signed=True).hex()
    )
    assert objects.number(0x60FF) == -77
    assert master.number(DRIVE, 0x60FF) == b"\xb3\xff\xff\xff"
    master.ask("write", DRIVE, 0x60FF, 0, "00000000")


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        (("read", DRIVE, 0x5FFF, 0), 0x06020000),
        (("read", DRIVE, 0x1018, 9), 0x06090011),
        (("write", DRIVE, 0x6041, 0, "0100"), 0x06010002),
        (("write", DRIVE, 0x6060, 0, "63"), 0x06090030),
        (("write", DRIVE, 0x60FF, 0, "01"), 0x06070010),
    ],
)
def test_the_peer_sees_aborts(master: Peer, request_: tuple[Any, ...], code: int) -> None:
    assert master.ask(*request_)["abort"] == code


def test_the_peer_starts_and_stops_the_drive(live: LiveBench, master: Peer) -> None:
    drive = live.winches["A"].drive
    master.ask("write", DRIVE, 0x1017, 0, (50).to_bytes(2, "little").hex())
    for command, state in (
        ("startNode", NmtState.OPERATIONAL),
        ("stopNode", NmtState.STOPPED),
        ("enterPreOperational", NmtState.PRE_OPERATIONAL),
    ):
        master.ask("nmt", command, DRIVE)
        until(partial(lambda wanted: drive.nmt == wanted, state))
        until(partial(lambda wanted: master.last("heartbeat") == [DRIVE, wanted], state))


def test_the_peer_sees_emergencies_and_a_heartbeat_that_ends(live: LiveBench, master: Peer) -> None:
    # A stall during an earlier test may have ended the heartbeat for this peer before.
    before = master.ask("seen")["timeout"]
    live.inject("A.servo", "over-current")
    until(lambda: bool(master.ask("seen")["emergency"]))
    assert master.ask("seen")["emergency"][0][:2] == [0x80 + DRIVE, 0x2310]
    assert master.ask("seen")["timeout"] == before
    live.inject("A.servo", "heartbeat stop")
    until(lambda: master.ask("seen")["timeout"] == [*before, DRIVE])
    live.inject("A.servo", "recover")


# Our driver is the master, the peer's node the slave.


@pytest.fixture
def slave(modules: Path, tmp_path: Path) -> Iterator[tuple[Peer, CanBus, SdoNode]]:
    channel = f"peer-{os.getpid()}-{os.urandom(3).hex()}"
    peer = Peer(modules, channel)
    eds = tmp_path / "peer.eds"
    peer.ask("slave", SLAVE, str(eds), 50)
    bus = CanBus(BusSpec("can", interface="virtual", channel=channel), "can", MonotonicClock())
    try:
        yield peer, bus, SdoNode(bus, SLAVE, eds)
    finally:
        bus.close()
        peer.close()


def test_we_read_and_write_a_foreign_node(slave: tuple[Peer, CanBus, SdoNode]) -> None:
    peer, _, node = slave
    assert node.read(0x2000) == 17
    assert node.read(0x2001) == -1234
    assert node.read(0x2002) == 0xDEADBEEF
    node.write_verified(0x2001, 0, -2)
    assert peer.ask("value", 0x2001) == "-2"
    assert node.read(0x1018, 1) == 0x1234


def test_we_transfer_segments_with_a_foreign_node(slave: tuple[Peer, CanBus, SdoNode]) -> None:
    peer, _, node = slave
    assert node.read(0x2003) == 0x1122334455667788
    node.write_verified(0x2003, 0, 0x0102030405060708)
    assert peer.ask("value", 0x2003) == str(0x0102030405060708)


def test_we_report_what_a_foreign_node_refuses(slave: tuple[Peer, CanBus, SdoNode]) -> None:
    _, _, node = slave
    with pytest.raises(DeviceRefused, match="0x06010002"):
        node.write(0x2002, 0, 1)
    with pytest.raises(DeviceRefused, match="0x06090031"):
        node.write(0x2004, 0, 101)
    with pytest.raises(DeviceRefused, match="0x06010001"):
        node.read(0x2005)
    assert node.read_if_there(0x2FFF) is None


def test_we_start_stop_and_receive_a_foreign_node(slave: tuple[Peer, CanBus, SdoNode]) -> None:
    peer, bus, node = slave
    watch = HeartbeatConsumer(0.4)
    bus.on(0x700 + SLAVE, watch.receive)
    until(lambda: watch.state == NmtState.PRE_OPERATIONAL)
    for command, state in ((0x01, NmtState.OPERATIONAL), (0x80, NmtState.PRE_OPERATIONAL)):
        bus.nmt(command, SLAVE)
        until(partial(lambda wanted: watch.state == wanted, state))
        assert peer.last("state") == state
    bus.nmt(0x02, SLAVE)
    until(lambda: watch.state == NmtState.STOPPED)
    with pytest.raises(NoReply):
        node.read(0x2000)

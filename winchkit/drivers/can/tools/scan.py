"""Scan of a CAN bus: nodes that answer, their identity objects, and their heartbeats."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import can
import canopen

from winchkit.drivers.can.bus.bus import SDO_SIZE, CanBus
from winchkit.drivers.can.canopen.identity import Identity, fitting_device
from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer, NmtState, state_text
from winchkit.drivers.can.canopen.node import ABSENT, ObjectPort, sdo_client
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.clock import Clock
from winchkit.errors import DeviceRefused, NoReply
from winchkit.schema.bench import BenchSpec, BusSpec

NODES = range(1, 128)
_DEVICE_TYPE, _SERIAL = b"\x00\x10\x00", b"\x18\x10\x04"
"""Index and sub-index of 1000h and 1018h:4 as SDO carries them."""
_UPLOAD_DEVICE_TYPE, _UPLOAD_SERIAL = (b"\x40" + key + bytes(4) for key in (_DEVICE_TYPE, _SERIAL))
_DUPLICATE_TIME = 0.05
"""For a second answer to one request, s."""
_TOO_MANY = 1.5
"""Times the heartbeats that 1017h makes."""
_SDO_REQUEST, _SDO_REPLY, _HEARTBEAT = 0x600, 0x580, 0x700
_PACE_BITS = 1000
"""Of bus time from one question to the next, so that no adapter's queue overflows."""
_LISTEN = 1.1
"""For heartbeats, whose period is a second at most where they are of use, s."""
_TIMEOUT = 0.3
"""s: shorter than that of a known drive, as most of the 127 node ids do not exist."""
_DICTIONARY: Any = canopen.ObjectDictionary


@dataclass(frozen=True)
class ScannedNode:
    """A node of a bus."""

    bus: str
    node: int
    identity: Identity
    device_type: int | None
    """1000h; None where it does not answer SDO and is known by its heartbeat only."""
    name: str
    """1008h."""
    heartbeat: str
    """NMT state of its heartbeat, in words."""
    device: str
    """Shipped device file that fits; empty where none does."""
    winch: str = ""
    """The winch of the bench file that it drives."""
    problem: str = ""
    """What is wrong with it, e.g. that two nodes have this number; empty where nothing is."""


class RawNode:
    """A node of which only the node id is known."""

    def __init__(self, bus: CanBus, node: int) -> None:
        self._place = f"bus '{bus.name}' node {node}"
        remote = canopen.RemoteNode(node, _DICTIONARY())
        bus.network.add_node(remote)
        self._sdo = sdo_client(remote, bus.clock)
        self._sdo.RESPONSE_TIMEOUT = _TIMEOUT

    def upload_if_there(self, index: int, sub: int = 0) -> bytes | None:
        """Bytes of an object; None where the device has none. Raises NoReply, DeviceRefused."""
        try:
            return bytes(self._sdo.upload(index, sub))
        except canopen.SdoAbortedError as error:
            if error.code in ABSENT:
                return None
            raise DeviceRefused(f"{self._place} {index:04X}h:{sub}: {error}") from error
        except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
            raise NoReply(
                f"{self._place} {index:04X}h:{sub}: no answer within {_TIMEOUT:g} s ({error})"
            ) from error
        except Exception as error:
            # Whatever canopen makes of bytes that are no SDO.
            raise DeviceRefused(
                f"{self._place} {index:04X}h:{sub}: its answer cannot be read ({error!r})"
            ) from error

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Refuse: an unknown node is not written to."""
        raise DeviceRefused(f"{self._place} {index:04X}h:{sub}: not written, its type is unknown")


def scan(
    bus: CanBus,
    spec: BusSpec,
    clock: Clock,
    own: Mapping[int, Cia402Axis] | None = None,
    listen: float = _LISTEN,
) -> list[ScannedNode]:
    """Ask every node number for its device type and listen for ``listen`` s.

    Reads only. A node that refuses, falls silent or answers what cannot be read is reported with
    what is known of it. The host's own number is left out, since its heartbeat may come back. The
    nodes of ``own`` are asked through their axes, since two SDO clients of one node would take each
    other's answers. Raises ConnectionLost.
    """
    own = own or {}
    listeners = {node: _NodeListener(bus, node, clock, listen) for node in NODES if node not in own}
    for node, listener in listeners.items():
        bus.on(_HEARTBEAT + node, listener.beat)
        bus.on(_SDO_REPLY + node, listener.reply)
        bus.send(_SDO_REQUEST + node, _UPLOAD_DEVICE_TYPE)
        clock.sleep(_PACE_BITS / spec.bitrate)
    clock.sleep(listen)
    there = {node for node, listener in listeners.items() if listener.answered}
    found = []
    for node in sorted((there | set(own)) - {spec.node}):
        if node in own:
            asked = _ask(bus, node, own[node].objects)
            found.append(replace(asked, heartbeat=_words(own[node].heartbeat)))
        else:
            found.append(_reported(listeners[node]))
    for node in listeners:
        bus.off(_HEARTBEAT + node)
        bus.off(_SDO_REPLY + node)
    return found


class _NodeListener:
    """Frames of one node id during the scan."""

    def __init__(self, bus: CanBus, node: int, clock: Clock, listen: float) -> None:
        self.bus, self.node, self.clock = bus, node, clock
        self.start = clock.now()
        self.watch = HeartbeatConsumer(listen)
        self.beats = 0
        self.replies: Counter[bytes] = Counter()
        """Replies by their index and sub-index."""

    @property
    def answered(self) -> bool:
        """Whether any frame of the node was received."""
        return bool(self.replies) or self.watch.last is not None

    def beat(self, data: bytes, now: float) -> None:
        """Take a heartbeat."""
        self.beats += 1
        self.watch.receive(data, now)

    def reply(self, data: bytes, now: float) -> None:
        """Take an SDO reply, and hand it on to whoever asked."""
        self.replies[bytes(data[1:4])] += 1
        if len(data) == SDO_SIZE:
            self.bus.pass_on(_SDO_REPLY + self.node, data, now)


def _reported(listener: _NodeListener) -> ScannedNode:
    """A node that this host does not drive, with what is wrong with it."""
    if not listener.replies:
        # It may have been booting when it was asked.
        listener.bus.send(_SDO_REQUEST + listener.node, _UPLOAD_DEVICE_TYPE)
        listener.clock.sleep(_DUPLICATE_TIME)
    answers = listener.replies[_DEVICE_TYPE]
    port = RawNode(listener.bus, listener.node) if listener.replies else None
    found = replace(_ask(listener.bus, listener.node, port), heartbeat=_words(listener.watch))
    if port is None:
        stopped = listener.watch.state == NmtState.STOPPED
        said = "it is NMT stopped, which ends SDO" if stopped else "it answers no SDO"
        return replace(found, problem=said)
    duplicates = _duplicates(listener, port, answers)
    return replace(found, problem="; ".join(filter(None, (duplicates, found.problem))))


def _duplicates(listener: _NodeListener, port: ObjectPort, answers: int) -> str:
    """Evidence that two nodes have this node id; empty where there is none.

    One request has one reply: two nodes both answer. Nodes that answer in the same instant with the
    same bytes are one frame on the wire, so the serial number is asked for too, and twice. Two
    heartbeats are more than 1017h says.
    """
    said = ""
    if answers > 1:
        said = f"{answers} answers to one request (1000h)"
    listener.replies.clear()
    listener.bus.send(_SDO_REQUEST + listener.node, _UPLOAD_SERIAL)
    listener.clock.sleep(_DUPLICATE_TIME)
    if not said and listener.replies[_SERIAL] > 1:
        said = f"{listener.replies[_SERIAL]} answers to one request (1018h:4)"
    if not said and (period := _safely(port, 0x1017) or 0):
        due = (listener.clock.now() - listener.start) * 1e3 / period
        if listener.beats > _TOO_MANY * due + 2:
            said = f"{listener.beats} heartbeats where 1017h ({period} ms) makes {due:.0f}"
    return f"two nodes have this number: {said}; switch one off and give it another" if said else ""


def _safely(port: ObjectPort, index: int, sub: int = 0) -> int | None:
    try:
        return _number(port, index, sub)
    except (NoReply, DeviceRefused):
        return None


def named_after(spec: BenchSpec, found: list[ScannedNode]) -> list[ScannedNode]:
    """The same with the winches of a bench file."""
    winches = {(one.servo.bus, one.servo.node): name for name, one in spec.winch.items()}
    return [replace(item, winch=winches.get((item.bus, item.node), "")) for item in found]


def _ask(bus: CanBus, node: int, port: ObjectPort | None) -> ScannedNode:
    """Device type, identity and name of a node, as far as it answers."""
    found = ScannedNode(bus.name, node, Identity(), None, "", "", "")
    if port is None:
        return found
    try:
        found = replace(found, device_type=_number(port, 0x1000))
        identity = identity_of(port)
        found = replace(
            found, identity=identity, device=fitting_device(identity, found.device_type)
        )
        text = (port.upload_if_there(0x1008) or b"").split(b"\0")[0]
        found = replace(found, name=text.decode("ascii", "replace"))
        again = identity_of(port)
    except (NoReply, DeviceRefused) as error:
        return replace(found, problem=str(error))
    if again != identity:
        said = f"its identity changes from one reading to the next ({identity}, then {again})"
        found = replace(found, problem=f"two nodes have this number: {said}")
    return found


def identity_of(port: ObjectPort) -> Identity:
    """Object 1018h of a node; raises NoReply, DeviceRefused."""
    return Identity(*(_number(port, 0x1018, sub) or 0 for sub in range(1, 5)))


def _number(port: ObjectPort, index: int, sub: int = 0) -> int | None:
    data = port.upload_if_there(index, sub)
    return None if data is None else int.from_bytes(data, "little")


def _words(watch: HeartbeatConsumer) -> str:
    if watch.state is None:
        return "no heartbeat"
    return state_text(watch.state)

"""Who is on a CAN bus: every node that answers, its identity, and what its heartbeat says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import can
import canopen

from winchkit.drivers.can.axis import Cia402Axis
from winchkit.drivers.can.bus import CanBus
from winchkit.drivers.can.fitting import Identity, fitting_device
from winchkit.drivers.can.heartbeat import HeartbeatWatch, NmtState
from winchkit.drivers.can.objects import ObjectPort
from winchkit.drivers.clock import Clock
from winchkit.errors import DeviceRefused, NoReply
from winchkit.schema.bench import BenchSpec, BusSpec

__all__ = ["Found", "RawNode", "identity_of", "named_after", "scan"]

NODES = range(1, 128)
_UPLOAD_DEVICE_TYPE = bytes((0x40, 0x00, 0x10, 0, 0, 0, 0, 0))
_SDO_REQUEST, _SDO_REPLY, _HEARTBEAT = 0x600, 0x580, 0x700
_PACE_BITS = 1000
"""Of bus time from one question to the next, so that no adapter's queue overflows."""
_TIMEOUT = 0.3
_ABSENT = {0x06020000, 0x06090011}
_DICTIONARY: Any = canopen.ObjectDictionary


@dataclass(frozen=True)
class Found:
    """A node of a bus."""

    bus: str
    node: int
    identity: Identity
    device_type: int | None
    """1000h; None where it does not answer SDO and is known by its heartbeat only."""
    name: str
    """1008h."""
    heartbeat: str
    """What its heartbeat says, in words."""
    device: str
    """Shipped device file that fits; empty where none does."""
    winch: str = ""
    """The winch of the wiring file that it drives."""


class RawNode:
    """A node of which nothing but its number is known."""

    def __init__(self, bus: CanBus, node: int) -> None:
        self._place = f"bus '{bus.name}' node {node}"
        remote = canopen.RemoteNode(node, _DICTIONARY())
        bus.network.add_node(remote)
        self._sdo = remote.sdo
        self._sdo.RESPONSE_TIMEOUT = _TIMEOUT

    def upload_if_there(self, index: int, sub: int = 0) -> bytes | None:
        """Bytes of an object; None where the device has none. Raises NoReply, DeviceRefused."""
        try:
            return bytes(self._sdo.upload(index, sub))
        except canopen.SdoAbortedError as error:
            if error.code in _ABSENT:
                return None
            raise DeviceRefused(f"{self._place} {index:04X}h:{sub}: {error}") from error
        except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
            raise NoReply(f"{self._place}: no answer within {_TIMEOUT:g} s ({error})") from error

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Refuse: what is not known is not written to."""
        raise DeviceRefused(f"{self._place} {index:04X}h:{sub}: not written, its type is unknown")


def scan(
    bus: CanBus,
    spec: BusSpec,
    clock: Clock,
    listen: float,
    own: Mapping[int, Cia402Axis] | None = None,
) -> list[Found]:
    """Ask every node number for its device type and listen for ``listen`` s.

    Reads only. The host's own number is left out, since its heartbeat may come back. The nodes
    of ``own`` are asked through their axes, since two SDO clients of one node would take each
    other's answers. Raises ConnectionLost.
    """
    own = own or {}
    answered: set[int] = set()
    beats = {node: own[node].heartbeat if node in own else HeartbeatWatch(listen) for node in NODES}
    for node in NODES:
        if node not in own:
            bus.on(_HEARTBEAT + node, beats[node].receive)
            bus.on(_SDO_REPLY + node, partial(_note, bus, node, answered))
            bus.send(_SDO_REQUEST + node, _UPLOAD_DEVICE_TYPE)
            clock.sleep(_PACE_BITS / spec.bitrate)
    clock.sleep(listen)
    heard = {node for node, watch in beats.items() if watch.last is not None}
    found = []
    for node in sorted((answered | heard | set(own)) - {spec.node}):
        port: ObjectPort = own[node].objects if node in own else RawNode(bus, node)
        asked = _ask(bus, node, port if node in answered or node in own else None)
        found.append(replace(asked, heartbeat=_words(beats[node])))
    for node in NODES:
        if node not in own:
            bus.off(_HEARTBEAT + node)
            bus.off(_SDO_REPLY + node)
    return found


def named_after(spec: BenchSpec, found: list[Found]) -> list[Found]:
    """The same with the winches of a wiring file."""
    winches = {(one.servo.bus, one.servo.node): name for name, one in spec.winch.items()}
    return [replace(item, winch=winches.get((item.bus, item.node), "")) for item in found]


def _note(bus: CanBus, node: int, answered: set[int], data: bytes, now: float) -> None:
    """Note that a node answers, and hand its answer on to whoever asked."""
    answered.add(node)
    bus.network.notify(_SDO_REPLY + node, bytearray(data), now)


def _ask(bus: CanBus, node: int, port: ObjectPort | None) -> Found:
    if port is None:
        return Found(bus.name, node, Identity(), None, "", "", "")
    device_type = _number(port, 0x1000)
    identity = identity_of(port)
    name = (port.upload_if_there(0x1008) or b"").split(b"\0")[0].decode("ascii", "replace")
    device = fitting_device(identity, device_type)
    return Found(bus.name, node, identity, device_type, name, "", device)


def identity_of(port: ObjectPort) -> Identity:
    """Object 1018h of a node; raises NoReply, DeviceRefused."""
    return Identity(*(_number(port, 0x1018, sub) or 0 for sub in range(1, 5)))


def _number(port: ObjectPort, index: int, sub: int = 0) -> int | None:
    data = port.upload_if_there(index, sub)
    return None if data is None else int.from_bytes(data, "little")


def _words(watch: HeartbeatWatch) -> str:
    if watch.state is None:
        return "no heartbeat"
    known = {state.value: state.name.lower().replace("_", "-") for state in NmtState}
    return known.get(watch.state, f"state {watch.state:02X}h")

"""One drive's objects, or a whole CAN bus: through the bench's owner, else on the bus itself."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from winchkit.bench.cells.instruments import device_of, eds_of
from winchkit.bench.ownership import Ownership
from winchkit.bench.remote.client import RemoteStation, attach
from winchkit.bench.remote.handover import own
from winchkit.bench.remote.identity import client_name
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.identity import fitting_device
from winchkit.drivers.can.canopen.node import Objects, SdoNode, read_dictionary
from winchkit.drivers.can.tools.scan import RawNode, ScannedNode, identity_of, named_after, scan
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import DeviceRefused, NotPermitted, UsageError, suggest
from winchkit.schema.bench import BenchSpec, BusSpec, WinchWiring
from winchkit.schema.devices.device import DeviceSpec


@dataclass(frozen=True)
class Node:
    """A drive whose objects can be reached."""

    name: str
    """``winch A``, or ``node 5``."""
    node: int
    bitrate: int
    device: DeviceSpec
    objects: Objects
    wiring: WinchWiring | None
    """Of the winch; None for a node that the bench file does not name."""

    @property
    def eds(self) -> Path:
        """Its EDS file."""
        return eds_of(self.device)


def bus_only(interface: str, channel: str, bitrate: int, port: int | None) -> BenchSpec:
    """A wiring of nothing but a CAN bus."""
    spec = BusSpec("can", interface=interface, channel=channel, bitrate=bitrate, port=port)
    return BenchSpec(f"{interface} {channel}", {}, {"can": spec})


def nodes_on(spec: BenchSpec) -> list[ScannedNode]:
    """Scan every CAN bus of a bench, by its owner where there is one; raises ConnectionLost."""
    remote = attach(spec)
    if remote is not None:
        with remote:
            return remote.scan()
    found = []
    with _owning(spec):
        for name in _can_buses(spec):
            with _open(spec, name) as bus:
                found += scan(bus, spec.bus[name], bus.clock)
    return named_after(spec, found)


@contextmanager
def drive_at(
    spec: BenchSpec,
    who: str | None,
    *,
    writes: bool = False,
    device: str | None = None,
) -> Iterator[Node]:
    """A drive by its winch's name or its node number (the only winch where ``who`` is None).

    Reads go through the bench's owner where there is one; writes are refused beside an owner,
    which has checked its drives as they were. ``device`` is the device file of a node that the
    wiring does not name; else the shipped one that fits what it says of itself.
    Raises UsageError, FileError, ConnectionLost, NotPermitted.
    """
    bus_name, node, winch = _chosen(spec, who)
    wiring = spec.winch[winch] if winch else None
    bitrate = spec.bus[bus_name].bitrate
    name = f"winch {winch}" if winch else f"node {node}"
    remote = attach(spec)
    if remote is not None and writes and remote.lends:
        # A bench process ends for whoever wants to own the bench, unless somebody works there.
        remote.close()
        remote = None
    if remote is None:
        with _owning(spec), _open(spec, bus_name) as bus:
            found = device_of(spec, wiring.servo) if wiring else _recognised(bus, node, device)
            port = SdoNode(bus, node, eds_of(found))
            objects = Objects(port, port.dictionary)
            yield Node(name, node, bitrate, found, objects, wiring)
        return
    with remote:
        if wiring is None:
            raise UsageError(f"node {node} is no winch of the bench that another process owns")
        _check_reading(spec, writes)
        found = device_of(spec, wiring.servo)
        objects = Objects(_RemotePort(remote, winch), read_dictionary(eds_of(found), node))
        yield Node(name, node, bitrate, found, objects, wiring)


def _check_reading(spec: BenchSpec, writes: bool) -> None:
    if writes:
        raise NotPermitted(
            f"bench '{spec.name}' is owned by another process, which has checked its drives as "
            "they are; end it before they are changed"
        )


@dataclass(frozen=True)
class DeclaredDrive:
    """A drive as the files know it, without its bus."""

    bus: str
    node: int
    dictionary: Any


def declared_drive(spec: BenchSpec, who: str | None) -> DeclaredDrive:
    """Facts on a drive that need no communication; raises UsageError, FileError."""
    bus, node, winch = _chosen(spec, who)
    if not winch:
        raise UsageError(f"node {node}: which drive this is can only be known by asking it")
    device = device_of(spec, spec.winch[winch].servo)
    return DeclaredDrive(bus, node, read_dictionary(eds_of(device), node))


@contextmanager
def free_bus(spec: BenchSpec) -> Iterator[CanBus]:
    """The only CAN bus of a bench without owner; raises NotPermitted where it has one."""
    names = _can_buses(spec)
    if len(names) != 1:
        raise UsageError(
            f"'{spec.name}' has {len(names)} CAN buses; name one by --interface and --channel"
        )
    with _owning(spec), _open(spec, names[0]) as bus:
        yield bus


class _RemotePort:
    """Objects of a winch's drive through the owner; reads only."""

    def __init__(self, station: RemoteStation, winch: str) -> None:
        self._station, self._winch = station, winch

    def upload_if_there(self, index: int, sub: int = 0) -> bytes | None:
        """Bytes of an object; None where the device has none."""
        return self._station.upload(self._winch, index, sub)

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Refuse."""
        raise NotPermitted(f"{index:04X}h:{sub} is not written while another process owns it")


def _recognised(bus: CanBus, node: int, device: str | None) -> DeviceSpec:
    """The named device file, else the shipped one that fits the identity of a node."""
    from winchkit import catalog
    from winchkit.schema.read import read_device

    name = device or _fitting(bus, node)
    found = read_device(catalog.find("devices", name))
    if found.servo is None:
        raise UsageError(f"'{name}' is no servo drive; node {node} is read as one")
    return found


def _fitting(bus: CanBus, node: int) -> str:
    port = RawNode(bus, node)
    device_type = port.upload_if_there(0x1000)
    number = None if device_type is None else int.from_bytes(device_type, "little")
    identity = identity_of(port)
    name = fitting_device(identity, number)
    if not name:
        raise DeviceRefused(
            f"bus '{bus.name}' node {node} ({identity}): no device file fits it, it is no CiA 402 "
            "drive; name one by --device, or the node in a bench file"
        )
    return name


def _chosen(spec: BenchSpec, who: str | None) -> tuple[str, int, str]:
    """Bus, node and winch; the winch is empty for a node that is none."""
    if who is None and len(spec.winch) == 1:
        who = next(iter(spec.winch))
    if who is not None and who in spec.winch:
        servo = spec.winch[who].servo
        return servo.bus, servo.node or 1, who
    if who is not None and who.isdecimal() and 1 <= int(who) <= 127:
        return _by_number(spec, int(who))
    known = list(spec.winch)
    what = f"no winch '{who}'" if who else "no winch and no node is given"
    there = f"there is {', '.join(known)}, or" if known else "give"
    raise UsageError(f"{what}; {there} a node number from 1 to 127{suggest(who or '', known)}")


def _by_number(spec: BenchSpec, node: int) -> tuple[str, int, str]:
    for name, winch in spec.winch.items():
        if winch.servo.node == node:
            return winch.servo.bus, node, name
    names = _can_buses(spec)
    if len(names) != 1:
        raise UsageError(f"node {node}: on which of the buses {', '.join(names)}? name its winch")
    return names[0], node, ""


def _can_buses(spec: BenchSpec) -> list[str]:
    return [name for name, bus in spec.bus.items() if bus.kind == "can"]


def _owning(spec: BenchSpec) -> closing[Ownership]:
    return closing(own(spec, client_name()))


def _open(spec: BenchSpec, name: str) -> closing[CanBus]:
    return closing(CanBus(spec.bus[name], name, MonotonicClock()))

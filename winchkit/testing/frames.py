"""CAN frames as a reader of a test wants them: who, what, and with which values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from winchkit.drivers.can.canopen.emergency import parse_emergency
from winchkit.drivers.can.tools.decode import KnownNode, decode, known_node
from winchkit.schema.devices.device import DeviceSpec
from winchkit.sim.live.buses import Carried

_NMT, _SYNC = 0x000, 0x080
_EMCY, _SDO_REPLY, _SDO_REQUEST, _HEARTBEAT = 0x080, 0x580, 0x600, 0x700


@dataclass(frozen=True)
class CarriedFrame:
    """One frame as it was carried, or lost."""

    time: float
    """On the bench's clock, s."""
    identifier: int
    data: bytes
    name: str
    """``sync``, ``nmt``, ``host.heartbeat``, ``A.rpdo1``, ``A.tpdo2``, ``A.sdo``,
    ``A.emergency``, ``A.heartbeat``; empty where it is not declared."""
    words: str
    """What it says."""
    values: Mapping[str, int] = field(default_factory=dict)
    """Objects of a PDO, ``6040h``, in the drive's units; ``code`` of an emergency."""
    from_drive: bool = False
    lost: bool = False

    def __str__(self) -> str:
        raw = f"{self.identifier:03X}#{self.data.hex().upper()}"
        mark = " (lost)" if self.lost else ""
        return f"{self.time:.4f} {raw:<20} {self.words}{mark}"


class FrameNames:
    """Names of the frames on one bus: their identifiers, and how to read them."""

    def __init__(self, host: int) -> None:
        """Begin with what belongs to no drive; ``host`` is the node id of the host."""
        self._names = {_NMT: "nmt", _SYNC: "sync", _HEARTBEAT + host: "host.heartbeat"}
        self._from_host = set(self._names)
        self._nodes = {host: KnownNode("host")}

    def add(self, winch: str, node: int, device: DeviceSpec) -> None:
        """Learn the frames of a winch's drive."""
        known = self._nodes[node] = known_node(winch, device, node)
        for first, kind in (
            (_EMCY, "emergency"),
            (_SDO_REPLY, "sdo"),
            (_SDO_REQUEST, "sdo"),
            (_HEARTBEAT, "heartbeat"),
        ):
            self._names[first + node] = f"{winch}.{kind}"
        for identifier, pdo in known.pdos.items():
            self._names[identifier] = f"{winch}.{pdo.kind.lower()}{pdo.number}"
        commands = {number for number, pdo in known.pdos.items() if pdo.kind == "RPDO"}
        self._from_host |= {_SDO_REQUEST + node, *commands}

    @property
    def all(self) -> set[str]:
        """Every name."""
        return set(self._names.values())

    def identifiers(self, what: str | int) -> frozenset[int]:
        """Identifiers of frames by name: ``A.tpdo1``, ``A.tpdo`` for all of them, ``A`` for every
        frame of its drive, ``host`` for all that the host sends; a number stands for itself.
        """
        if isinstance(what, int):
            return frozenset({what})
        if what == "host":
            return frozenset(self._from_host)
        return frozenset(
            identifier
            for identifier, name in self._names.items()
            if what in (name, name.rstrip("0123456789"), name.partition(".")[0])
        )

    def frame(self, carried: Carried) -> CarriedFrame:
        """Read a frame."""
        said = decode(carried.identifier, carried.data, self._nodes)
        values = {name: int(value) for name, value in said.values.items()}
        if said.kind == "EMCY":
            emergency = parse_emergency(carried.data, carried.time)
            values |= {} if emergency is None else {"code": emergency.code}
        return CarriedFrame(
            carried.time,
            carried.identifier,
            carried.data,
            self._names.get(carried.identifier, ""),
            said.text,
            values,
            carried.from_drive,
            carried.lost,
        )

"""Frames of a recorded trace in words, with what the frames before them set up.

The PDO mapping of a node is that of its EDS (default values, or a DCF's own) or of its device file,
until SDO writes in the trace change it; a boot-up restores what the node began with, or what it
stored by 1010h (CiA 301).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from winchkit.can_trace import TraceFrame
from winchkit.drivers.can.canopen.declared import configured_value
from winchkit.drivers.can.canopen.node import object_name, read_dictionary, variables
from winchkit.drivers.can.canopen.pdo import Key, parse_object
from winchkit.drivers.can.canopen.pdo_parameters import (
    COMMUNICATION,
    IDENTIFIER,
    INVALID,
    MAPPING,
    MOST_PDOS,
    PREDEFINED,
    Direction,
    cob_id,
)
from winchkit.drivers.can.cia402.modes import mode_named
from winchkit.drivers.can.cia402.units import CountScale, scale_of, units_by
from winchkit.drivers.can.tools.decode import (
    DecodedFrame,
    KnownNode,
    MappedPdo,
    content_text,
    declared_pdos,
    decode,
    expedited,
    number_of,
    place_of,
)
from winchkit.errors import Fault, FileError
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.eds.eds import SUFFIXES
from winchkit.schema.read import read_device

_DIRECTIONS: tuple[Direction, Direction] = ("tpdo", "rpdo")
_REQUEST, _REPLY, _HEARTBEAT, _EMERGENCY = 0x600, 0x580, 0x700, 0x080
_STORE, _MODE = 0x1010, (0x6061, 0)
_IDENTITY = ((0x1018, 1, "vendor"), (0x1018, 2, "product"))


@dataclass(frozen=True)
class Description:
    """A device file, or the EDS of a device."""

    path: str
    device: DeviceSpec | None = None
    """None for an EDS alone."""

    @property
    def name(self) -> str:
        """Name of the device, or of the file."""
        return Path(self.path).name if self.device is None else self.device.name

    @property
    def eds(self) -> Path:
        """The description of its objects."""
        spec = None if self.device is None else self.device.servo or self.device.process
        return Path(self.path) if spec is None else Path(self.path).parent / spec.eds


def read_description(path: str) -> Description:
    """A device file by path or name, or an EDS, DCF, XDD or XDC; raises FileError."""
    if Path(path).suffix.lower() in SUFFIXES:
        read_dictionary(Path(path), 1)
        return Description(path)
    device = read_device(path)
    if device.servo is None and device.process is None:
        message = f"is an instrument of [{device.kind}], which sends no CANopen frames"
        raise FileError(Fault(message, device.path))
    return Description(device.path, device)


@dataclass
class _TracedTransfer:
    """An SDO transfer under way."""

    key: Key
    is_write: bool
    content: bytes = b""
    is_whole: bool = False
    block_of: str = ""
    """``request`` or ``reply``: which side's next frames are segments of a block."""


class TracedNode:
    """A node of a trace: its objects as far as they are known."""

    def __init__(self, node: int, description: Description | None) -> None:
        self.node = node
        self.description = description
        dictionary = None if description is None else read_dictionary(description.eds, node)
        self._initial = _configured(dictionary)
        if description is not None and description.device is not None:
            self._initial |= _set_up(description.device, dictionary, node)
        self.values = dict(self._initial)
        self.seen: dict[Key, float] = {}
        """Values that the trace itself has, by SDO."""
        self.misfits: Counter[tuple[MappedPdo, int]] = Counter()
        """Frames of another length than their mapping, by PDO and bytes."""
        self.known = KnownNode(f"node {node}", dictionary, _pdos(self.values, node))
        self._transfer: _TracedTransfer | None = None

    def restart(self) -> None:
        """Forget what was set up, as a node does at its boot-up."""
        self.values = dict(self._initial)
        self._transfer = None
        self.known = replace(self.known, pdos=_pdos(self.values, self.node), mode="")

    def follow(self, data: bytes, *, is_request: bool) -> tuple[str, dict[str, float]]:
        """Take a frame of the SDO server or client.

        Returns: words on a whole content that the frame itself does not have, and values read.
        """
        side = "request" if is_request else "reply"
        transfer = self._transfer
        if transfer is not None and transfer.block_of == side:
            transfer.is_whole = bool(data[0] & 0x80)
            transfer.block_of = "" if transfer.is_whole else side
            return f"block segment {data[0] & 0x7F} of {object_name(*transfer.key)}", {}
        command = data[0] >> 5
        if command == 4:
            self._transfer = None
        elif is_request and command in (1, 2):
            content = expedited(data) if command == 1 else None
            self._transfer = _TracedTransfer(
                place_of(data), command == 1, content or b"", content is not None
            )
        elif command in (5, 6):
            return self._follow_block(data, is_request=is_request), {}
        elif transfer is not None:
            return self._follow_content(transfer, data, is_request=is_request)
        return "", {}

    def _follow_content(
        self, transfer: _TracedTransfer, data: bytes, *, is_request: bool
    ) -> tuple[str, dict[str, float]]:
        command, is_source = data[0] >> 5, is_request == transfer.is_write
        words = ""
        if is_source and command == 0:
            transfer.content += data[1 : 8 - (data[0] >> 1 & 7)]
            transfer.is_whole = bool(data[0] & 1)
            if transfer.is_whole:
                text = content_text(transfer.content, transfer.key, self.known)
                words = f"last segment, {object_name(*transfer.key)} is {text}"
        elif is_source and command == 2 and (content := expedited(data)) is not None:
            transfer.content, transfer.is_whole = content, True
        is_end = not is_request and transfer.is_whole
        return words, self._keep(transfer) if is_end else {}

    def _follow_block(self, data: bytes, *, is_request: bool) -> str:
        """Take a frame of a block transfer that is no segment; returns words on it."""
        command = data[0] >> 5
        kind = data[0] & (1 if command == 6 else 3)
        if is_request and kind == 0:
            self._transfer = _TracedTransfer(place_of(data), command == 6)
            return ""
        if (transfer := self._transfer) is None:
            return "block transfer"
        if command == 5 and kind != 1 and not transfer.is_whole:
            transfer.block_of = "request" if transfer.is_write else "reply"
        if kind == 1 and command == 5:
            self._transfer = None
        return f"block transfer of {object_name(*transfer.key)}" + (", end" if kind == 1 else "")

    def _keep(self, transfer: _TracedTransfer) -> dict[str, float]:
        """Store a value that was written and confirmed, or read."""
        self._transfer = None
        key, size = transfer.key, 8 * len(transfer.content)
        if not 0 < size <= 64:
            return {}
        bits = int.from_bytes(transfer.content, "little")
        value = number_of(bits, size, *key, self.known.dictionary)
        self.values[key] = self.seen[key] = value
        if key[0] == _STORE and transfer.is_write:
            self._initial = dict(self.values)
        if key[0] in _PDO_RECORDS:
            self.known = replace(self.known, pdos=_pdos(self.values, self.node))
        if key == _MODE:
            self.known = replace(self.known, mode=mode_named(int(value)))
        return {} if transfer.is_write else {object_name(*key): value}

    def scale(self) -> CountScale | None:
        """SI value of a count by a device file of a drive, and by what the trace has of its units.

        None without such a file. Raises NotPermitted for a scale that no encoder has.
        """
        servo = None
        if self.description is not None and self.description.device is not None:
            servo = self.description.device.servo
        if servo is None:
            return None

        def seen(index: int, sub: int) -> int | None:
            return None if (index, sub) not in self.seen else int(self.seen[index, sub])

        return scale_of(units_by(seen), servo)

    def process_value(self) -> tuple[str, str, float] | None:
        """Name of the object of an instrument's value, its unit, and the value of a count in it."""
        device = None if self.description is None else self.description.device
        if device is None or device.process is None:
            return None
        spec = device.process
        return object_name(*parse_object(spec.value)), spec.unit, spec.scale

    def notes(self) -> Iterator[str]:
        """What contradicts the description."""
        by = "" if self.description is None else f" by {self.description.name}"
        for (pdo, size), count in self.misfits.items():
            yield (
                f"{self.known.name}: {pdo.kind} {pdo.number} has {size} bytes in {count} frames, "
                f"and its mapping{by} {pdo.size}: the node has another mapping; give its DCF, or a "
                "trace with the SDO writes that set it up"
            )
        for index, sub, what in _IDENTITY:
            told, declared = self.seen.get((index, sub)), self._identity(index, sub)
            if told is not None and declared and int(told) != declared:
                yield (
                    f"{self.known.name}: is of {what} {int(told):X}h, and {declared:X}h{by}: "
                    "the description is of another device"
                )

    def _identity(self, index: int, sub: int) -> int | None:
        info = getattr(self.known.dictionary, "device_information", None)
        number = getattr(info, "vendor_number" if sub == 1 else "product_number", None)
        return number or None


@dataclass
class TraceDecoder:
    """Decoder of the frames of one bus, in their order."""

    default: Description | None = None
    """Of the nodes that ``by_node`` does not have."""
    by_node: Mapping[int, Description] = field(default_factory=dict)
    nodes: dict[int, TracedNode] = field(default_factory=dict)
    """Nodes that the trace has, by number."""
    _assumed: dict[int, TracedNode] = field(default_factory=dict)
    """Nodes of which there are only frames that look like their PDOs."""

    def __post_init__(self) -> None:
        for node in self.by_node:
            self._hear(node)

    def decode(self, frame: TraceFrame) -> DecodedFrame:
        """Meaning of a frame; raises FileError for an EDS that does not fit a node's number."""
        identifier, data = frame.identifier, frame.data
        node, base = identifier & 0x7F, identifier & ~0x7F
        if identifier > IDENTIFIER:
            return DecodedFrame("other", 0, data.hex(" "))
        if base in (_REQUEST, _REPLY, _HEARTBEAT, _EMERGENCY) and node:
            return self._of_service(base, data, self._hear(node), frame)
        nodes = {number: one.known for number, one in self.nodes.items()}
        if not any(identifier in one.pdos for one in nodes.values()) and 0x180 <= base < 0x580:
            if node and node not in self.nodes and node not in self._assumed:
                self._assumed[node] = self._new(node)
            nodes |= {number: one.known for number, one in self._assumed.items()}
        found = decode(identifier, data, nodes)
        owner = self.nodes.get(found.node) or self._assumed.get(found.node)
        if owner is not None and found.kind in ("TPDO", "RPDO"):
            pdo = owner.known.pdos.get(identifier)
            if pdo is not None and len(data) != pdo.size:
                owner.misfits[pdo, len(data)] += 1
            if (mode := found.values.get(object_name(*_MODE))) is not None:
                owner.known = replace(owner.known, mode=mode_named(int(mode)))
        return found

    @property
    def all_nodes(self) -> dict[int, TracedNode]:
        """Nodes of the trace by number, those with PDOs only included."""
        return {**self._assumed, **self.nodes}

    def _of_service(
        self, base: int, data: bytes, one: TracedNode, frame: TraceFrame
    ) -> DecodedFrame:
        if base == _HEARTBEAT and data[:1] == b"\0":
            one.restart()
        nodes = {one.node: one.known}
        found = decode(frame.identifier, data, nodes)
        if base in (_REQUEST, _REPLY) and len(data) == 8:
            words, values = one.follow(data, is_request=base == _REQUEST)
            text = f"{one.known.name}: {words}" if words else found.text
            return replace(found, text=text, values=values)
        return found

    def _hear(self, node: int) -> TracedNode:
        if node not in self.nodes:
            known = node in self._assumed
            self.nodes[node] = self._assumed.pop(node) if known else self._new(node)
        return self.nodes[node]

    def _new(self, node: int) -> TracedNode:
        return TracedNode(node, self.by_node.get(node, self.default))


_PDO_RECORDS = range(0x1400, 0x1C00)
"""Communication and mapping records of all PDOs (CiA 301)."""


def _configured(dictionary: Any) -> dict[Key, float]:
    """Default values of the PDO records of an EDS, or a DCF's own."""
    if dictionary is None:
        return {}
    found: dict[Key, float] = {}
    for variable in variables(dictionary):
        if variable.index in _PDO_RECORDS and (value := configured_value(variable)) is not None:
            found[variable.index, variable.subindex] = value
    for direction in _DIRECTIONS:
        for number in PREDEFINED:
            record = COMMUNICATION[direction] + number - 1
            if record in dictionary and dictionary.node_id is not None:
                found.setdefault((record, 1), cob_id(direction, number, dictionary.node_id))
    return found


def _set_up(device: DeviceSpec, dictionary: Any, node: int) -> dict[Key, float]:
    """PDO records as the bench writes them by a device file: its own PDOs, and no others."""
    off = {(COMMUNICATION[way] + n, 1): INVALID for way in _DIRECTIONS for n in range(MOST_PDOS)}
    found: dict[Key, float] = dict(off)
    for identifier, pdo in declared_pdos(device, dictionary, node).items():
        direction: Direction = "tpdo" if pdo.kind == "TPDO" else "rpdo"
        mapping = MAPPING[direction] + pdo.number - 1
        found[COMMUNICATION[direction] + pdo.number - 1, 1] = identifier
        found[mapping, 0] = len(pdo.objects)
        for place, ((index, sub), size) in enumerate(
            zip(pdo.objects, pdo.sizes, strict=True), start=1
        ):
            found[mapping, place] = index << 16 | sub << 8 | size
    return found


def _pdos(values: Mapping[Key, float], node: int) -> dict[int, MappedPdo]:
    """PDOs in use by the values of their records, by identifier."""
    found = {}
    for direction in _DIRECTIONS:
        for number in range(1, MOST_PDOS + 1):
            default = cob_id(direction, number, node) if number in PREDEFINED else INVALID
            identifier = int(values.get((COMMUNICATION[direction] + number - 1, 1), default))
            mapping = MAPPING[direction] + number - 1
            count = int(values.get((mapping, 0), 0))
            entries = [int(values.get((mapping, sub), 0)) for sub in range(1, count + 1)]
            if identifier & INVALID or not entries or not all(entries):
                continue
            keys = tuple((entry >> 16, entry >> 8 & 0xFF) for entry in entries)
            sizes = tuple(entry & 0xFF for entry in entries)
            found[identifier & IDENTIFIER] = MappedPdo(direction.upper(), number, keys, sizes)
    return found

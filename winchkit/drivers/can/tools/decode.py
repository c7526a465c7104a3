"""CAN frames in words, of a bus or of a dry run."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import canopen
from canopen.objectdictionary import datatypes

from winchkit.drivers.can.canopen.emergency import error_text, parse_emergency
from winchkit.drivers.can.canopen.nmt import command_text, state_text
from winchkit.drivers.can.canopen.node import is_signed, object_name, read_dictionary
from winchkit.drivers.can.canopen.pdo import Key, parse_object
from winchkit.drivers.can.canopen.pdo_parameters import Direction, cob_id
from winchkit.drivers.can.cia402.modes import mode_named, status_words
from winchkit.drivers.can.cia402.state_machine import FAULT_RESET, HALT, state_of
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.servo import PdoSpec

_CONTROL = {
    0x00: "disable voltage",
    0x02: "quick stop",
    0x06: "shutdown",
    0x07: "switch on",
    0x0F: "enable operation",
}
_LSS = {
    0x04: "switch all to state {1}",
    0x11: "set node id {1}",
    0x13: "set bit rate index {2}",
    0x15: "activate bit rate",
    0x17: "store",
    0x40: "select vendor {n:X}h",
    0x41: "select product {n:X}h",
    0x42: "select revision {n:X}h",
    0x43: "select serial {n}",
    0x44: "selected",
    0x4F: "identified",
    0x51: "fast scan",
    0x5A: "ask for the vendor",
    0x5B: "ask for the product",
    0x5C: "ask for the revision",
    0x5D: "ask for the serial number",
    0x5E: "ask for the node id",
}
_PDOS = dict.fromkeys((384, 640, 896, 1152), "TPDO")
_PDOS |= dict.fromkeys((512, 768, 1024, 1280), "RPDO")
"""Kinds of the predefined connection set (CiA 301)."""
_TRANSFERS = {2: "read", 5: "block transfer of", 6: "block transfer of"}
"""Command specifiers of the other SDO transfers (CiA 301)."""
_MODE = (0x6061, 0)
_WORDED = (0x6040, 0x6041, 0x6060, 0x6061, 0x603F)
_FIRST_OBJECT = 0x1000
"""Lower indices are data types: gaps in a mapping (CiA 301)."""
_SDO_REQUEST, _SDO_REPLY, _HEARTBEAT = 0x600, 0x580, 0x700
_SEGMENT = 7
"""Data bytes in a segment of an SDO transfer (CiA 301)."""


@dataclass(frozen=True)
class MappedPdo:
    """A PDO whose mapping is known."""

    kind: str
    """TPDO or RPDO."""
    number: int
    objects: tuple[Key, ...]
    sizes: tuple[int, ...]
    """bits."""

    @property
    def size(self) -> int:
        """Bytes of its frame."""
        return (sum(self.sizes) + 7) // 8

    def values(self, data: bytes, dictionary: Any) -> dict[Key, float]:
        """Values of the objects that a frame, which may be short, has whole."""
        bits, place = int.from_bytes(data, "little"), 0
        found: dict[Key, float] = {}
        for key, size in zip(self.objects, self.sizes, strict=True):
            if place + size > 8 * len(data):
                break
            if key[0] >= _FIRST_OBJECT:
                found[key] = number_of(bits >> place & (1 << size) - 1, size, *key, dictionary)
            place += size
        return found


@dataclass(frozen=True)
class KnownNode:
    """Known facts on a node: its name and, where it is a declared device, its objects."""

    name: str
    dictionary: Any = None
    pdos: Mapping[int, MappedPdo] = field(default_factory=dict)
    """By identifier."""
    mode: str = ""
    """Mode of operation, where it is known; bits of the status word depend on it."""


@dataclass(frozen=True)
class DecodedFrame:
    """A frame in words."""

    kind: str
    """NMT, SYNC, EMCY, TPDO, RPDO, SDO, heartbeat, LSS or other."""
    node: int
    """0 where it concerns no single node."""
    text: str
    values: Mapping[str, float] = field(default_factory=dict)
    """Of a PDO whose mapping is known, by object, in the device's units."""


def known_node(name: str, device: DeviceSpec, node: int) -> KnownNode:
    """A drive or CANopen instrument as its device file declares it; raises FileError."""
    spec = device.servo or device.process
    assert spec is not None, "the reader has checked it"
    dictionary = read_dictionary(Path(device.path).parent / spec.eds, node)
    return KnownNode(name, dictionary, declared_pdos(device, dictionary, node))


def declared_pdos(device: DeviceSpec, dictionary: Any, node: int) -> dict[int, MappedPdo]:
    """PDOs that a device file sets up, by identifier."""
    spec = device.servo or device.process
    assert spec is not None, "the reader has checked it"
    directions: tuple[tuple[Direction, tuple[PdoSpec, ...]], ...]
    directions = (("tpdo", spec.tpdo), ("rpdo", getattr(spec, "rpdo", ())))
    found = {}
    for direction, pdos in directions:
        for pdo in pdos:
            keys = tuple(map(parse_object, pdo.objects))
            sizes = tuple(len(dictionary.get_variable(*key)) for key in keys)
            mapped = MappedPdo(direction.upper(), pdo.number, keys, sizes)
            found[cob_id(direction, pdo.number, node)] = mapped
    return found


def number_of(bits: int, size: int, index: int, sub: int, dictionary: Any) -> float:
    """Number of an object's bits, by its type in a dictionary; unsigned where it is not known."""
    variable = None if dictionary is None else dictionary.get_variable(index, sub)
    if variable is not None and variable.data_type in datatypes.FLOAT_TYPES and size in (32, 64):
        layout = "<f" if size == 32 else "<d"
        return float(struct.unpack(layout, bits.to_bytes(size // 8, "little"))[0])
    is_negative = is_signed(variable) and bits >> size - 1 & 1
    return bits - (1 << size) if is_negative else bits


def decode(identifier: int, data: bytes, nodes: Mapping[int, KnownNode]) -> DecodedFrame:
    """Meaning of a frame; one that is not understood is shown as bytes."""
    if identifier == 0x000 and len(data) == 2:
        return _nmt(data, nodes)
    if identifier == 0x080:
        return DecodedFrame("SYNC", 0, "SYNC")
    if identifier in (0x7E4, 0x7E5) and len(data) == 8:
        return DecodedFrame("LSS", 0, _lss(data, reply=identifier == 0x7E4))
    node = identifier & 0x7F
    known = nodes.get(node, KnownNode(f"node {node}"))
    for number, one in nodes.items():
        if (pdo := one.pdos.get(identifier)) is not None:
            return _pdo(pdo, number, one, data)
    base = identifier & ~0x7F
    raw = data.hex(" ") or "no bytes"
    if base in _PDOS and node:
        return DecodedFrame(_PDOS[base], node, f"{known.name}: {raw}")
    kind, words = _of_node(base, data, known) if node else ("other", "")
    return (
        DecodedFrame(kind, node, f"{known.name}: {words}") if words else DecodedFrame(kind, 0, raw)
    )


def _pdo(pdo: MappedPdo, node: int, known: KnownNode, data: bytes) -> DecodedFrame:
    """A PDO in words; one of another length has words and no values."""
    values = pdo.values(data, known.dictionary)
    words = _mapped(values, known) or data.hex(" ")
    if len(data) != pdo.size:
        words += f" ({len(data)} bytes; its mapping has {pdo.size})"
        values = {}
    plain = {object_name(*key): value for key, value in values.items()}
    return DecodedFrame(pdo.kind, node, f"{known.name}: {words}", plain)


def _nmt(data: bytes, nodes: Mapping[int, KnownNode]) -> DecodedFrame:
    command, node = data
    who = nodes[node].name if node in nodes else f"node {node}" if node else "all nodes"
    return DecodedFrame("NMT", node, f"{who}: {command_text(command)}")


def _of_node(base: int, data: bytes, known: KnownNode) -> tuple[str, str]:
    """Kind and words of a frame of a node's services; no words for another frame."""
    raw = data.hex(" ") or "no bytes"
    if base == 0x080:
        return "EMCY", str(parse_emergency(data, 0.0) or raw)
    if base == _HEARTBEAT:
        return "heartbeat", state_text(data[0] & 0x7F) if data else raw
    if base in (_SDO_REQUEST, _SDO_REPLY) and len(data) == 8:
        words = _request if base == _SDO_REQUEST else _reply
        return "SDO", words(data, known)
    return "other", ""


def write_frames(node: int, index: int, sub: int, data: bytes) -> list[tuple[int, bytes]]:
    """Frames of an SDO client that writes an object: expedited up to 4 bytes, else segmented."""
    head = struct.pack("<HB", index, sub)
    identifier = _SDO_REQUEST + node
    if 0 < len(data) <= 4:
        command = 0x23 | (4 - len(data)) << 2
        return [(identifier, bytes((command,)) + head + data.ljust(4, b"\0"))]
    frames = [(identifier, b"\x21" + head + struct.pack("<I", len(data)))]
    for start in range(0, len(data), _SEGMENT):
        part = data[start : start + _SEGMENT]
        toggle = (start // _SEGMENT & 1) << 4
        last = start + _SEGMENT >= len(data)
        command = toggle | (_SEGMENT - len(part)) << 1 | last
        frames.append((identifier, bytes((command,)) + part.ljust(_SEGMENT, b"\0")))
    return frames


def _mapped(values: Mapping[Key, float], known: KnownNode) -> str:
    mode = mode_named(int(values[_MODE])) if _MODE in values else known.mode
    return ", ".join(
        f"{_named(*key, known.dictionary)} {_in_words(key[0], value, mode) or f'{value:.9g}'}"
        for key, value in values.items()
    )


def _in_words(index: int, value: float, mode: str) -> str:
    """A value in words where CiA 402 has them, else empty."""
    word = int(value) if index in _WORDED else 0
    if index == 0x6040:
        return f"{word:02X}h {_control(word)}"
    if index == 0x6041:
        return f"{word:04X}h {', '.join((str(state_of(word)), *status_words(mode, word)))}"
    if index in (0x6060, 0x6061):
        return f"{word} {mode_named(word)}"
    return f"{word:04X}h {error_text(word)}" if index == 0x603F else ""


def _control(word: int) -> str:
    if word & FAULT_RESET:
        return "fault reset"
    plain = _CONTROL.get(word & 0x0F, f"{word:04X}h")
    return f"{plain} + halt" if word & HALT else plain


def named(name: str, dictionary: Any) -> str:
    """``6064h Position actual value`` of ``6064h``; the same where a dictionary lacks it."""
    index, _, sub = name.partition("h:")
    return _named(int(index.removesuffix("h"), 16), int(sub or "0"), dictionary)


def _named(index: int, sub: int, dictionary: Any) -> str:
    """``6040h Control word``; a sub-object with its record's name."""
    number = object_name(index, sub)
    variable = dictionary.get_variable(index, sub) if dictionary is not None else None
    return f"{number} {variable.name}" if variable is not None else number


def place_of(data: bytes) -> Key:
    """Object of the first frame of an SDO transfer."""
    index, sub = struct.unpack_from("<HB", data, 1)
    return index, sub


def expedited(data: bytes) -> bytes | None:
    """Content of an expedited transfer; None where it is not expedited."""
    if not data[0] & 0x02:
        return None
    size = 4 - (data[0] >> 2 & 3) if data[0] & 0x01 else 4
    return data[4 : 4 + size]


def content_text(content: bytes, key: Key, known: KnownNode) -> str:
    """Content of an SDO transfer, by the type of its object."""
    variable = None if known.dictionary is None else known.dictionary.get_variable(*key)
    if variable is not None and variable.data_type in datatypes.DATA_TYPES:
        text = content.split(b"\0")[0].decode("ascii", errors="replace")
        return repr(text) if text.isprintable() else content.hex(" ")
    if not 0 < len(content) <= 8:
        return content.hex(" ")
    bits = int.from_bytes(content, "little")
    value = number_of(bits, 8 * len(content), *key, known.dictionary)
    words = _in_words(key[0], value, known.mode)
    return words or (f"{value} ({bits:X}h)" if isinstance(value, int) else f"{value:.9g}")


def _content(data: bytes, key: Key, known: KnownNode) -> str:
    """Content of a transfer, or its length where the content follows in segments."""
    content = expedited(data)
    if content is None:
        return f"{int.from_bytes(data[4:8], 'little')} bytes"
    return content_text(content, key, known)


def _request(data: bytes, known: KnownNode) -> str:
    command = data[0] >> 5
    if command in (0, 3):
        return f"segment {data[1:].hex(' ')}" if command == 0 else "next segment"
    key = place_of(data)
    name = _named(*key, known.dictionary)
    if command == 4:
        return f"abort {name}: {_abort(data)}"
    if command == 1:
        return f"write {name} = {_content(data, key, known)}"
    return f"{_TRANSFERS.get(command, f'command {command} of')} {name}"


def _reply(data: bytes, known: KnownNode) -> str:
    command = data[0] >> 5
    if command in (0, 1):
        return f"segment {data[1:].hex(' ')}" if command == 0 else "segment taken"
    key = place_of(data)
    name = _named(*key, known.dictionary)
    if command == 4:
        return f"{name} refused: {_abort(data)}"
    if command == 3:
        return f"{name} written"
    if command == 2:
        return f"{name} is {_content(data, key, known)}"
    return f"{_TRANSFERS.get(command, f'command {command} of')} {name}"


def _abort(data: bytes) -> str:
    return str(canopen.SdoAbortedError(int.from_bytes(data[4:8], "little")))


def _lss(data: bytes, *, reply: bool) -> str:
    words = _LSS.get(data[0], f"command {data[0]:02X}h")
    number = int.from_bytes(data[1:5], "little")
    return ("answer: " if reply else "") + words.format(*data, n=number)

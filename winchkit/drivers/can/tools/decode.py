"""CAN frames in words, of a bus or of a dry run."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import canopen

from winchkit.drivers.can.canopen.emergency import parse_emergency
from winchkit.drivers.can.canopen.nmt import command_text, state_text
from winchkit.drivers.can.canopen.node import is_signed, object_name, read_dictionary
from winchkit.drivers.can.canopen.pdo import MappedObject, PdoCodec, parse_object
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
_TPDO = {0x180: 1, 0x280: 2, 0x380: 3, 0x480: 4}
_RPDO = {0x200: 1, 0x300: 2, 0x400: 3, 0x500: 4}
_SDO_REQUEST, _SDO_REPLY, _HEARTBEAT = 0x600, 0x580, 0x700
_SEGMENT = 7
"""Data bytes in a segment of an SDO transfer (CiA 301)."""


@dataclass(frozen=True)
class KnownNode:
    """Known facts on a node: its name and, where it is a declared drive, its objects."""

    name: str
    dictionary: Any = None
    tpdo: Mapping[int, PdoCodec] = field(default_factory=dict)
    rpdo: Mapping[int, PdoCodec] = field(default_factory=dict)


@dataclass(frozen=True)
class Decoded:
    """A frame in words."""

    kind: str
    """NMT, SYNC, EMCY, TPDO, RPDO, SDO, heartbeat, LSS or other."""
    node: int
    """0 where it concerns no single node."""
    text: str
    values: Mapping[str, int] = field(default_factory=dict)
    """Of a PDO whose mapping is known, by object, in the drive's units."""


def known_node(name: str, device: DeviceSpec, node: int) -> KnownNode:
    """A drive as its device file declares it; raises FileError."""
    assert device.servo is not None, "the reader has checked it"
    dictionary = read_dictionary(Path(device.path).parent / device.servo.eds, node)
    return KnownNode(
        name,
        dictionary,
        {pdo.number: _codec(pdo, dictionary) for pdo in device.servo.tpdo},
        {pdo.number: _codec(pdo, dictionary) for pdo in device.servo.rpdo},
    )


def decode(identifier: int, data: bytes, nodes: Mapping[int, KnownNode]) -> Decoded:
    """Meaning of a frame; one that is not understood is shown as bytes."""
    if identifier == 0x000 and len(data) == 2:
        return _nmt(data, nodes)
    if identifier == 0x080:
        return Decoded("SYNC", 0, "SYNC")
    if identifier in (0x7E4, 0x7E5) and len(data) == 8:
        return Decoded("LSS", 0, _lss(data, reply=identifier == 0x7E4))
    node = identifier & 0x7F
    known = nodes.get(node, KnownNode(f"node {node}"))
    base = identifier & ~0x7F
    for kind, bases, codecs in (("TPDO", _TPDO, known.tpdo), ("RPDO", _RPDO, known.rpdo)):
        if base in bases:
            values = _values(data, codecs.get(bases[base]))
            words = _mapped(values, known) if values else data.hex(" ")
            plain = {object_name(*key): value for key, value in values.items()}
            return Decoded(kind, node, f"{known.name}: {words}", plain)
    kind, words = _of_node(base, data, known)
    return Decoded(kind, node, f"{known.name}: {words}")


def _nmt(data: bytes, nodes: Mapping[int, KnownNode]) -> Decoded:
    command, node = data
    who = nodes[node].name if node in nodes else f"node {node}" if node else "all nodes"
    return Decoded("NMT", node, f"{who}: {command_text(command)}")


def _of_node(base: int, data: bytes, known: KnownNode) -> tuple[str, str]:
    """Kind and words of a frame that bears a node's number."""
    raw = data.hex(" ")
    if base == 0x080:
        return "EMCY", str(parse_emergency(data, 0.0) or raw)
    if base == _HEARTBEAT:
        return "heartbeat", state_text(data[0] & 0x7F) if data else raw
    if base in (_SDO_REQUEST, _SDO_REPLY) and len(data) == 8:
        words = _request if base == _SDO_REQUEST else _reply
        return "SDO", words(data, known.dictionary)
    return "other", raw


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


def _codec(spec: PdoSpec, dictionary: Any) -> PdoCodec:
    objects = []
    for text in spec.objects:
        index, sub = parse_object(text)
        variable = dictionary.get_variable(index, sub)
        objects.append(MappedObject(index, sub, len(variable), is_signed(variable)))
    return PdoCodec(spec, objects)


def _values(data: bytes, codec: PdoCodec | None) -> dict[tuple[int, int], int]:
    values = codec.decode(data) if codec is not None else None
    if codec is None or values is None:
        return {}
    return dict(zip(codec.position, values, strict=True))


def _mapped(values: Mapping[tuple[int, int], int], known: KnownNode) -> str:
    return ", ".join(
        f"{_named(*key, known.dictionary)} {_value(key[0], value)}" for key, value in values.items()
    )


def _value(index: int, value: int) -> str:
    if index == 0x6040:
        return f"{value:02X}h {_control(value)}"
    if index == 0x6041:
        return f"{value:04X}h {state_of(value)}"
    return str(value)


def _control(word: int) -> str:
    if word & FAULT_RESET:
        return "fault reset"
    plain = _CONTROL.get(word & 0x0F, f"{word:04X}h")
    return f"{plain} + halt" if word & HALT else plain


def _named(index: int, sub: int, dictionary: Any) -> str:
    """``6040h Control word``; a sub-object with its record's name."""
    number = object_name(index, sub)
    variable = dictionary.get_variable(index, sub) if dictionary is not None else None
    return f"{number} {variable.name}" if variable is not None else number


def _place(data: bytes, dictionary: Any) -> tuple[int, str]:
    index, sub = struct.unpack_from("<HB", data, 1)
    return index, _named(index, sub, dictionary)


def _expedited(data: bytes) -> int | None:
    """Number in an expedited transfer; None where it is not expedited."""
    if not data[0] & 0x02:
        return None
    size = 4 - (data[0] >> 2 & 3) if data[0] & 0x01 else 4
    return int.from_bytes(data[4 : 4 + size], "little")


def _content(index: int, data: bytes) -> str:
    """Content of a transfer, or its length where the content follows in segments."""
    value = _expedited(data)
    if value is None:
        return f"{int.from_bytes(data[4:8], 'little')} bytes"
    return _value(index, value) if index in (0x6040, 0x6041) else f"{value} ({value:X}h)"


def _request(data: bytes, dictionary: Any) -> str:
    command = data[0] >> 5
    if command in (0, 3):
        return f"segment {data[1:].hex(' ')}" if command == 0 else "next segment"
    index, name = _place(data, dictionary)
    if command == 2:
        return f"read {name}"
    if command == 4:
        return f"abort {name}: {_abort(data)}"
    return f"write {name} = {_content(index, data)}"


def _reply(data: bytes, dictionary: Any) -> str:
    command = data[0] >> 5
    if command in (0, 1):
        return f"segment {data[1:].hex(' ')}" if command == 0 else "segment taken"
    index, name = _place(data, dictionary)
    if command == 4:
        return f"{name} refused: {_abort(data)}"
    if command == 3:
        return f"{name} written"
    return f"{name} is {_content(index, data)}"


def _abort(data: bytes) -> str:
    return str(canopen.SdoAbortedError(int.from_bytes(data[4:8], "little")))


def _lss(data: bytes, *, reply: bool) -> str:
    words = _LSS.get(data[0], f"command {data[0]:02X}h")
    number = int.from_bytes(data[1:5], "little")
    return ("answer: " if reply else "") + words.format(*data, n=number)

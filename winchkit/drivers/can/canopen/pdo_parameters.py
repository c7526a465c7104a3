"""PDO parameters: written in the order that CiA 301 requires, and read back."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo import PdoCodec, parse_object
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import PdoSpec

Direction = Literal["tpdo", "rpdo"]

INVALID, IDENTIFIER = 1 << 31, 0x7FF
"""Bits of a COB-ID (CiA 301): what is not used, and the CAN-ID."""
_NO_RTR = 1 << 30
COMMUNICATION = {"tpdo": 0x1800, "rpdo": 0x1400}
MAPPING = {"tpdo": 0x1A00, "rpdo": 0x1600}
_FIRST_COB = {"tpdo": 0x180, "rpdo": 0x200}
PREDEFINED = range(1, 5)
MOST_PDOS = 512
"""In each direction (CiA 301: 1400h to 15FFh, 1800h to 19FFh)."""
_INHIBIT_UNIT, _MS = 1e-4, 1e-3
"""s: units of the inhibit time (sub-index 3) and of the event timer (sub-index 5)."""


def cob_id(direction: Direction, number: int, node: int) -> int:
    """Identifier of the predefined connection set."""
    return _FIRST_COB[direction] + 0x100 * (number - 1) + node


def codecs(node: SdoNode, specs: Iterable[PdoSpec]) -> tuple[PdoCodec, ...]:
    """Codecs of the PDOs of a device file, typed by the EDS."""
    return tuple(
        PdoCodec(spec, [node.mapped(*parse_object(text)) for text in spec.objects])
        for spec in specs
    )


def set_up(node: SdoNode, direction: Direction, wanted: tuple[PdoCodec, ...]) -> None:
    """Map ``wanted`` on a pre-operational node and switch every other PDO of this direction off."""
    by_number = {codec.spec.number: codec for codec in wanted}
    for number in (*PREDEFINED, *_beyond(node, direction)):
        record = COMMUNICATION[direction] + number - 1
        codec = by_number.get(number)
        if codec is not None:
            _map(node, direction, codec)
            continue
        identifier = node.read_if_there(record, 1)
        if identifier is None or identifier & INVALID:
            continue
        mapping = MAPPING[direction] + number - 1
        if node.writes(record, 1):
            node.write(record, 1, identifier | INVALID)
        elif node.writes(mapping, 0):  # a PDO without objects is not used (CiA 301)
            node.write(mapping, 0, 0)


def _beyond(node: SdoNode, direction: Direction) -> list[int]:
    """Numbers of the PDOs above four that the EDS declares."""
    first = COMMUNICATION[direction]
    return [
        number
        for number in range(PREDEFINED.stop, MOST_PDOS + 1)
        if first + number - 1 in node.dictionary
    ]


def _map(node: SdoNode, direction: Direction, codec: PdoCodec) -> None:
    number = codec.spec.number
    record = COMMUNICATION[direction] + number - 1
    mapping = MAPPING[direction] + number - 1
    identifier = cob_id(direction, number, node.node)
    if direction == "tpdo":
        identifier |= _NO_RTR
    renamed = node.writes(record, 1)
    if renamed:
        node.write(record, 1, identifier | INVALID)
    else:
        _check_identifier(node, record, identifier)
    _set_transmission(node, record, codec.spec.transmission)
    _set_timers(node, record, codec.spec)
    if node.writes(mapping, 0):
        node.write(mapping, 0, 0)
        for position, item in enumerate(codec.objects, start=1):
            node.write(mapping, position, item.entry)
        node.write_verified(mapping, 0, len(codec.objects))
        # Entries above the count need not be readable: of an array, they do not exist (CiA 301).
        for position, item in enumerate(codec.objects, start=1):
            node.verify(mapping, position, item.entry)
    else:
        _check_fixed(node, direction, codec)
    if renamed:
        node.write(record, 1, identifier)
        _verify_identifier(node, record, identifier)


def _check_identifier(node: SdoNode, record: int, identifier: int) -> None:
    """A COB-ID that the EDS does not let change has to be in use, and the predefined one."""
    kept = node.read(record, 1)
    if (kept ^ identifier) & ~_NO_RTR:
        state = "is not in use" if kept & INVALID else f"is {kept & 0x7FF:03X}h"
        raise NotPermitted(
            f"{node.place(record, 1)} cannot be written by its EDS and {state}, not "
            f"{identifier & 0x7FF:03X}h as the predefined connection set has it; use another PDO "
            "in the device file, or set it with the maker's program"
        )


def _set_transmission(node: SdoNode, record: int, transmission: int) -> None:
    """Set the transmission type, or see that one that cannot be written is the wanted one."""
    if node.writes(record, 2):
        node.write_verified(record, 2, transmission)
        return
    kept = node.read(record, 2)
    if kept != transmission:
        raise NotPermitted(
            f"{node.place(record, 2)} cannot be written by its EDS and is {kept}, not "
            f"{transmission} as in the device file; write transmission = {kept} there, or use "
            "another PDO"
        )


def _check_fixed(node: SdoNode, direction: Direction, codec: PdoCodec) -> None:
    """A mapping that the EDS does not let change has to be the one that is wanted."""
    mapping = MAPPING[direction] + codec.spec.number - 1
    count = node.read(mapping, 0)
    held = [node.read(mapping, position) for position in range(1, count + 1)]
    if held != [item.entry for item in codec.objects]:
        entries = ", ".join(f"{entry:08X}h" for entry in held) or "nothing"
        raise NotPermitted(
            f"{node.place(mapping)} is fixed and holds {entries}, not the objects of {direction} "
            f"{codec.spec.number} in the device file; write there what the drive holds"
        )


def _set_timers(node: SdoNode, record: int, spec: PdoSpec) -> None:
    """Inhibit time and event timer; a drive may lack those that are not asked for."""
    if not spec.by_event:
        return
    for sub, time, unit in ((3, spec.inhibit_time, _INHIBIT_UNIT), (5, spec.event_timer, _MS)):
        if time or node.read_if_there(record, sub) is not None:
            node.write_verified(record, sub, round(time / unit))


def _verify_identifier(node: SdoNode, record: int, identifier: int) -> None:
    """Compare the COB-ID, apart from the RTR bit, which some devices keep."""
    kept = node.read(record, 1)
    if (kept ^ identifier) & ~_NO_RTR:
        node.write_verified(record, 1, identifier)

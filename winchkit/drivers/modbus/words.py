"""Numbers in 16-bit registers, in every order that devices put their bytes in."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from winchkit.schema.devices.modbus import REGISTERS, Order, ValueType

_FORMAT: dict[ValueType, str] = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "f32": ">f"}


def number_of(kind: ValueType, order: Order, words: Mapping[int, int], at: int) -> float:
    """The number whose first register is ``at``; NaN and infinity as they come."""
    count = REGISTERS[kind]
    wire = b"".join(words[at + k].to_bytes(2, "big") for k in range(count))
    letters = _letters(order, count)
    ordered = bytes(wire[letters.index(letter)] for letter in sorted(letters))
    return float(struct.unpack(_FORMAT[kind], ordered)[0])


def words_of(kind: ValueType, order: Order, number: float) -> list[int]:
    """Registers of a number; raises ``struct.error`` for one beyond the type's range."""
    data = struct.pack(_FORMAT[kind], number if kind == "f32" else int(number))
    letters = _letters(order, len(data) // 2)
    wire = bytes(data[sorted(letters).index(letter)] for letter in letters)
    return [int.from_bytes(wire[at : at + 2], "big") for at in range(0, len(wire), 2)]


def _letters(order: Order, count: int) -> str:
    """Order of the bytes on the wire, ``AB`` or ``BA`` for one register."""
    if count == 2:
        return order
    return "AB" if order in ("ABCD", "CDAB") else "BA"

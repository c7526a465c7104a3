"""Writes values into Modbus registers as a device file lays them out."""

from __future__ import annotations

import struct

from winchkit.schema.device import FieldSpec

__all__ = ["counts_of", "encode"]

_BITS = {"u16": 16, "i16": 16, "u32": 32, "i32": 32}
_SIGNED = ("i16", "i32")
_ORDERS = {"ABCD": (0, 1, 2, 3), "CDAB": (2, 3, 0, 1), "BADC": (1, 0, 3, 2), "DCBA": (3, 2, 1, 0)}
_SHORT_ORDERS = {"ABCD": (0, 1), "CDAB": (0, 1), "BADC": (1, 0), "DCBA": (1, 0)}


def counts_of(field: FieldSpec, value: float) -> tuple[float, bool]:
    """Counts of a value in the field's unit, and whether they had to be clipped to its range."""
    counts = value / field.scale
    if field.type == "f32":
        return counts, False
    whole = round(counts)
    bits = _BITS[field.type]
    if field.sign_bit is not None:
        high = (1 << bits) - 1
        low = -high
    elif field.type in _SIGNED:
        low, high = -(1 << (bits - 1)), (1 << (bits - 1)) - 1
    else:
        low, high = 0, (1 << bits) - 1
    return min(max(whole, low), high), not low <= whole <= high


def encode(field: FieldSpec, counts: float) -> list[int]:
    """Registers of a field, in the order of their addresses.

    With a sign bit the registers hold the magnitude; the sign is the status word's business.
    """
    if field.type == "f32":
        data = struct.pack(">f", counts)
    else:
        whole = abs(int(counts)) if field.sign_bit is not None else int(counts)
        size = _BITS[field.type] // 8
        data = whole.to_bytes(size, "big", signed=field.type in _SIGNED and whole < 0)
    order = _ORDERS[field.order] if len(data) == 4 else _SHORT_ORDERS[field.order]
    placed = bytes(data[index] for index in order)
    return [int.from_bytes(placed[at : at + 2], "big") for at in range(0, len(placed), 2)]

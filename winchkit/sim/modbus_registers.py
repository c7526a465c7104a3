"""Writes values into Modbus registers as a device file lays them out."""

from __future__ import annotations

import struct

from winchkit.schema.modbus_parts import FieldSpec, Order, ValueType

__all__ = ["counts_of", "decimals_of", "encode", "encode_number"]

_BITS = {"u16": 16, "i16": 16, "u32": 32, "i32": 32}
_DECIMALS = 2
_SIGNED = ("i16", "i32")
_ORDERS = {"ABCD": (0, 1, 2, 3), "CDAB": (2, 3, 0, 1), "BADC": (1, 0, 3, 2), "DCBA": (3, 2, 1, 0)}
_SHORT_ORDERS = {"ABCD": (0, 1), "CDAB": (0, 1), "BADC": (1, 0), "DCBA": (1, 0)}


def counts_of(field: FieldSpec, value: float) -> tuple[float, bool]:
    """Counts of a value in the field's unit, and whether they had to be clipped to its range."""
    counts = value / field.scale * 10.0 ** decimals_of(field)
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


def decimals_of(field: FieldSpec) -> int:
    """Decimals that a simulated device is set to, where it tells them itself."""
    return _DECIMALS if field.decimals is not None else 0


def encode(field: FieldSpec, counts: float) -> list[int]:
    """Registers of a field, in the order of their addresses.

    With a sign bit the registers hold the magnitude; the sign is the status word's business.
    """
    return encode_number(
        field.type, field.order, abs(counts) if field.sign_bit is not None else counts
    )


def encode_number(kind: ValueType, order: Order, number: float) -> list[int]:
    """Registers of a number of a type, in the order of their addresses."""
    if kind == "f32":
        data = struct.pack(">f", number)
    else:
        whole = int(number)
        data = whole.to_bytes(_BITS[kind] // 8, "big", signed=kind in _SIGNED and whole < 0)
    placed = _ORDERS[order] if len(data) == 4 else _SHORT_ORDERS[order]
    wire = bytes(data[index] for index in placed)
    return [int.from_bytes(wire[at : at + 2], "big") for at in range(0, len(wire), 2)]

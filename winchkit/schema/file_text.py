"""Text of a declaration's file: the inverse of reading it."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

from winchkit.schema.profiles.winch import EffectTable
from winchkit.schema.quantity import Quantity
from winchkit.units import UNITS, format_quantity, is_bare

_DIGITS = 15
"""Significant digits: all that a number written in decimals has."""


def file_text(kind: str, declared: Any) -> str:
    """Text of a file of a kind; what has its default value is left out."""
    import tomlkit

    return tomlkit.dumps({"schema": 1, "kind": kind, **_table(declared)})


def _table(declared: Any) -> dict[str, Any]:
    """Keys of a table, quantities in their SI unit."""
    from winchkit.schema.reading.tables import marker_at

    given = {
        field.name: getattr(declared, field.name)
        for field in fields(declared)
        if field.compare and getattr(declared, field.name) != field.default
    }
    return {key: _value(value, marker_at(type(declared), (key,))) for key, value in given.items()}


def _value(value: Any, marker: object) -> Any:
    if isinstance(value, EffectTable):
        return {"id": value.id, **value.values}
    if is_dataclass(value):
        return _table(value)
    if isinstance(value, tuple):
        return [_value(item, marker) for item in value]
    if isinstance(marker, Quantity) and not is_bare(marker.dimension):
        return format_quantity(value, next(iter(UNITS[marker.dimension])), _DIGITS)
    return float(value) if isinstance(value, float) else value

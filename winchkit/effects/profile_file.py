"""Writes fitted effects into a copy of a profile file, with where their values came from.

The user's file keeps its comments, its order and its shorthands: only values that were refitted
change, and one ``[[effect]]`` table comes at the end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import AoT, InlineTable

from winchkit.effects.bind import Term
from winchkit.errors import Fault, FileError
from winchkit.units import format_quantity

__all__ = ["Fitted", "write_fitted"]

_SHORTHANDS = {
    "cable-elongation-linear": ("cable", "axial_stiffness"),
    "cable-weight": ("cable", "mass_per_length"),
    "gear-efficiency": ("gearbox", "efficiency"),
}


@dataclass(frozen=True)
class Fitted:
    """A term with the standard deviations of its values, and where they came from."""

    term: Term
    std: Mapping[str, float]
    runs: Sequence[str]
    date: date


def write_fitted(source: Path, fitted: Sequence[Fitted], out: Path) -> None:
    """Copy the profile ``source`` to ``out`` with fitted effects; those it has are updated.

    Raises FileError where a file cannot be read or written.
    """
    try:
        document = tomlkit.parse(source.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(Fault(f"cannot be read: {error.strerror}", str(source))) from error
    tables = document.get("effect")
    if not isinstance(tables, AoT):
        tables = tomlkit.aot()
        document["effect"] = tables
    unused = list(tables)
    for item in fitted:
        if _update_shorthand(document, item):
            continue
        table = next((t for t in unused if t["id"] == item.term.effect.id), None)
        if table is None:
            table = tomlkit.table()
            table["id"] = item.term.effect.id
            tables.append(table)
            table = tables[-1]
        else:
            unused.remove(table)
        _fill(table, item)
    if not len(tables):
        del document["effect"]
    try:
        out.write_text(tomlkit.dumps(document), encoding="utf-8")
    except OSError as error:
        raise FileError(Fault(f"cannot be written: {error.strerror}", str(out))) from error


def _update_shorthand(document: Any, item: Fitted) -> bool:
    """Put a refitted value where the profile has it as a shorthand; False where it has none."""
    table, key = _SHORTHANDS.get(item.term.effect.id, ("", ""))
    if key not in document.get(table, {}):
        return False
    unit = item.term.effect.parameter(key).unit
    document[table][key] = _written(item.term.values[key], unit)
    return True


def _fill(table: Any, item: Fitted) -> None:
    effect = item.term.effect
    for parameter in effect.parameters:
        value = item.term.values[parameter.name]
        if parameter.name in item.std or value != parameter.null:
            table[parameter.name] = _written(value, parameter.unit)
    table["fitted"] = _provenance(item)


def _provenance(item: Fitted) -> InlineTable:
    std = tomlkit.inline_table()
    for name, value in item.std.items():
        std[name] = _written(value, item.term.effect.parameter(name).unit)
    fitted = tomlkit.inline_table()
    fitted["runs"] = list(item.runs)
    fitted["date"] = item.date
    fitted["std"] = std
    return fitted


def _written(value: float, unit: str) -> str | float:
    """A quantity as files have it; a bare number only where there is no unit."""
    text = format_quantity(value, unit, digits=8)
    return float(text) if unit == "1" else text

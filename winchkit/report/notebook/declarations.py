"""Profiles as rows of a table: the part, and its declared values with units."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from winchkit.quantity_text import plain, quantity
from winchkit.schema.profiles.winch import EffectTable
from winchkit.schema.quantity import Quantity
from winchkit.units import UNITS, is_bare

_LEFT_OUT = {"name", "description", "ledger", "effect", "rules"}


def declared_rows(profile: Any) -> list[list[str]]:
    """Parts of a profile with the values that differ from the defaults; all values of its kind."""
    rows = []
    for field in dataclasses.fields(profile):
        if field.name in _LEFT_OUT or not field.init:
            continue
        value = getattr(profile, field.name)
        if isinstance(value, tuple):
            for number, one in enumerate(value, start=1):
                name = getattr(one, "name", str(number))
                rows.append([f"{field.name} {name}", ", ".join(_values(one, whole=True))])
        elif dataclasses.is_dataclass(value):
            rows.append([field.name, ", ".join(_values(value))])
        elif isinstance(value, Mapping):
            rows += [[f"{field.name} {key}", ", ".join(_values(v))] for key, v in value.items()]
    rows = [row for row in rows if row[1]]
    return rows + [[f"effect {table.id}", _effect(table)] for table in profile.effect]


def _effect(table: EffectTable) -> str:
    return ", ".join(f"{key} {value}" for key, value in table.values.items()) or "declared"


def _values(part: Any, *, whole: bool = False) -> Iterator[str]:
    """Values of a declared table that differ from their defaults; of a whole one all quantities."""
    if not dataclasses.is_dataclass(part):
        yield str(part)
        return
    kind: Any = type(part)
    units = _units(kind)
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if field.name == "name" or value is None or value == ():
            continue
        if value == field.default and not (whole and field.name in units):
            continue
        if dataclasses.is_dataclass(value):
            shown = getattr(value, "name", "") or ", ".join(_values(value))
        else:
            shown = _text(value, units.get(field.name, ""))
        if shown:
            yield f"{field.name.replace('_', ' ')} {shown}"


def _text(value: Any, unit: str) -> str:
    if isinstance(value, tuple | list):
        return f"({', '.join(_text(each, unit) for each in value)})"
    if isinstance(value, Mapping):
        return f"{len(value)} values"
    if isinstance(value, float):
        return quantity(value, unit, 4) if unit and value else plain(value)
    return str(value)


@cache
def _units(kind: type) -> dict[str, str]:
    """SI unit of every field that is a quantity."""
    hints = get_type_hints(kind, include_extras=True)
    return {name: unit for name, hint in hints.items() if (unit := _unit(hint))}


def _unit(hint: Any) -> str:
    """SI unit of the first quantity within an annotation; empty without one."""
    if get_origin(hint) is Annotated:
        for mark in hint.__metadata__:
            if isinstance(mark, Quantity) and not is_bare(mark.dimension):
                return next(iter(UNITS[mark.dimension]))
    return next((unit for inner in get_args(hint) if (unit := _unit(inner))), "")

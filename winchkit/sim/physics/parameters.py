"""Readers of numbers with units into dataclass fields, and of overrides of a profile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, get_args, get_type_hints

from winchkit.errors import Fault, FileError, UsageError, suggest
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.quantity import Quantity
from winchkit.schema.simbench import dotted_keys
from winchkit.units import UNITS


def _markers(kind: type[Any]) -> dict[str, Quantity]:
    """Quantity markers of a dataclass's fields by name."""
    hints = get_type_hints(kind, include_extras=True)
    found = {}
    for field in fields(kind):
        marker = quantity_of(hints[field.name])
        if marker is not None and not field.name.startswith("_"):
            found[field.name] = marker
    return found


def quantity_of(hint: Any) -> Quantity | None:
    """Quantity that the type of a field has, also within a union or a tuple; None without one."""
    for part in (*getattr(hint, "__metadata__", ()), *get_args(hint)):
        if isinstance(part, Quantity):
            return part
        inner = quantity_of(part) if get_args(part) else None
        if inner is not None:
            return inner
    return None


def read_numbers(kind: type, raw: Mapping[str, Any], where: str) -> dict[str, float]:
    """SI values of the numbers in ``raw``; FileError with every fault among them."""
    markers = _markers(kind)
    faults: list[Fault] = []
    values: dict[str, float] = {}
    for name, text in raw.items():
        key = f"{where}.{name}"
        if name not in markers:
            known = ", ".join(markers) or "none"
            near = suggest(name, list(markers))
            faults.append(Fault(f"unknown number; known are {known}{near}", key=key))
            continue
        try:
            values[name] = markers[name].read(text)
        except UsageError as error:
            faults.append(Fault(str(error), key=key))
    if faults:
        raise FileError(faults)
    return values


def number_names(kind: type[Any]) -> list[str]:
    """Names of the fields that hold a quantity."""
    return list(_markers(kind))


def with_unit(kind: type, name: str, value: float) -> str | float:
    """Write an SI value of a field as a file would, e.g. ``"0.0003 m"``."""
    unit = next(iter(UNITS[_markers(kind)[name].dimension]))
    return value if unit == "1" else f"{value!r} {unit}"


def overridden(profile: WinchProfile, overrides: Mapping[str, Any]) -> WinchProfile:
    """Replace numbers of a profile by keys such as ``pulley.0.radius``; raises FileError."""
    faults: list[Fault] = []
    for key, raw in dotted_keys(overrides):
        try:
            profile = _replaced(profile, key.split("."), raw)
        except UsageError as error:
            faults.append(Fault(str(error), key=f"truth.{key}"))
    if faults:
        raise FileError(faults)
    return profile


def _replaced(owner: Any, path: list[str], raw: Any) -> Any:
    """A copy of a dataclass or tuple with the number at ``path`` replaced."""
    head, rest = path[0], path[1:]
    if isinstance(owner, tuple):
        if not head.isdigit() or int(head) >= len(owner) or not rest:
            raise UsageError(f"'{head}' is not a position in a list of {len(owner)}, from 0")
        place = int(head)
        return (*owner[:place], _replaced(owner[place], rest, raw), *owner[place + 1 :])
    names = [field.name for field in fields(owner)] if is_dataclass(owner) else []
    if head not in names:
        raise UsageError(f"no key '{head}' here" + suggest(head, names))
    if rest:
        inner = getattr(owner, head)
        if inner is None:
            raise UsageError(f"the profile has no table '{head}' that could differ")
        return replace(owner, **{head: _replaced(inner, rest, raw)})
    markers = _markers(type(owner))
    if head not in markers:
        raise UsageError(f"'{head}' is not a number and cannot be overridden")
    return replace(owner, **{head: markers[head].read(raw)})

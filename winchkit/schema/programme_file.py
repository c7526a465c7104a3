"""Writes a motion programme as users write it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from winchkit.errors import Fault, FileError
from winchkit.schema.programme import Programme, Step
from winchkit.units import format_quantity

__all__ = ["write_programme"]

_UNITS = {
    "to": "m",
    "by": "m",
    "speed": "m/s",
    "acceleration": "m/s^2",
    "hold": "s",
    "load_mass": "kg",
    "temperature": "degC",
}
_ORDER = ("ask", "load_mass", "temperature", "to", "by", "speed", "acceleration", "hold")


def write_programme(programme: Programme, path: Path) -> None:
    """Write a programme file; raises FileError."""
    import tomlkit

    document = tomlkit.document()
    document["schema"] = 1
    document["kind"] = "programme"
    document["name"] = programme.name
    document["repeat"] = programme.repeat
    if programme.description:
        document["description"] = programme.description
    steps = tomlkit.aot()
    for step in programme.step:
        table = tomlkit.table()
        table.update(_written(step))
        steps.append(table)
    document["step"] = steps
    try:
        path.write_text(tomlkit.dumps(document), encoding="utf-8")
    except OSError as error:
        raise FileError(Fault(f"cannot be written: {error.strerror}", str(path))) from error


def _written(step: Step) -> dict[str, Any]:
    out: dict[str, Any] = {} if step.winch == "all" else {"winch": step.winch}
    for key in _ORDER:
        value = getattr(step, key)
        if value is not None:
            out[key] = format_quantity(value, _UNITS[key]) if key in _UNITS else value
    return out

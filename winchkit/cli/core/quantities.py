"""Quantities as people type them at a prompt: the space before the unit may be missing."""

from __future__ import annotations

from winchkit.errors import UsageError
from winchkit.schema.plausible import NUMBER, typed_quantity
from winchkit.units import UNITS

__all__ = ["dimension", "optional", "quantity", "seconds"]


def quantity(text: str, dimension: str) -> float:
    """``"0.1m/s"`` or ``"0.1 m/s"`` in SI; raises UsageError, also for a time below zero."""
    value = typed_quantity(text, dimension)
    if dimension == "time" and value < 0:
        raise UsageError(f"'{text}' is below zero; a duration is not")
    return value


def dimension(text: str, among: tuple[str, ...]) -> str:
    """Which of these dimensions the unit of ``text`` has; raises UsageError for none of them."""
    found = NUMBER.match(text)
    unit = found[2].strip() if found else ""
    for name in among:
        if unit in UNITS[name]:
            return name
    units = "; ".join(f"{name} {', '.join(UNITS[name])}" for name in among)
    raise UsageError(f"'{text}' is no {' or '.join(among)} with its unit ({units})")


def optional(text: str | None, dimension: str) -> float | None:
    """A quantity; None where none is given."""
    return None if text is None else quantity(text, dimension)


def seconds(text: str | None) -> float | None:
    """A duration; None where none is given."""
    return optional(text, "time")

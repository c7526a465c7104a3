"""Quantities as people type them at a prompt: the space before the unit may be missing."""

from __future__ import annotations

import re

from winchkit.errors import UsageError
from winchkit.units import parse

__all__ = ["optional", "quantity", "seconds"]

_NUMBER = re.compile(r"^\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(.*)$")


def quantity(text: str, dimension: str) -> float:
    """``"0.1m/s"`` or ``"0.1 m/s"`` in SI; raises UsageError, also for a time below zero."""
    value = parse(_NUMBER.sub(r"\1 \2", text).strip(), dimension)
    if dimension == "time" and value < 0:
        raise UsageError(f"'{text}' is below zero; a duration is not")
    return value


def optional(text: str | None, dimension: str) -> float | None:
    """A quantity; None where none is given."""
    return None if text is None else quantity(text, dimension)


def seconds(text: str | None) -> float | None:
    """A duration; None where none is given."""
    return optional(text, "time")

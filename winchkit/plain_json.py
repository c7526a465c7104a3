"""Values for JSON: null in place of NaN and infinity, which JSON lacks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Any


def finite_or_none(value: float) -> float | None:
    """Return the number, or None where it is not finite."""
    return float(value) if isfinite(value) else None


def significant(values: Iterable[float], digits: int) -> list[float | None]:
    """Round numbers to significant digits; None where one is not finite."""
    return [float(f"{value:.{digits}g}") if isfinite(value) else None for value in values]


def without_nan(value: Any) -> Any:
    """Replace every number that is not finite in mappings and sequences by None."""
    if isinstance(value, float):
        return finite_or_none(value)
    if isinstance(value, Mapping):
        return {str(key): without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    return value

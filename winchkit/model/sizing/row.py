"""One line of a sizing: a requirement, its value, its limit, and alternatives where it fails."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from typing import Literal

_EXACT = 1e-6
"""Relative: declared decimals of six digits agree."""


def up(value: float, digits: int = 4) -> str:
    """A lower limit as text, rounded up, so that the printed value is sufficient."""
    return _rounded(value, digits, ROUND_CEILING)


def down(value: float, digits: int = 4) -> str:
    """An upper limit as text, rounded down, so that the printed value is sufficient."""
    return _rounded(value, digits, ROUND_FLOOR)


def _rounded(value: float, digits: int, way: str) -> str:
    exact = Decimal(value)
    unit = Decimal(1).scaleb(exact.adjusted() - digits + 1)
    return f"{float(exact.quantize(unit, rounding=way)):.{digits}g}"


@dataclass(frozen=True)
class Row:
    """A requirement; values in ``unit``, which is SI. Without a limit it is only reported."""

    name: str
    equation: str
    value: float
    unit: str
    relation: Literal["<=", ">=", "=", ""] = ""
    limit: float | None = None
    ok: bool | None = None
    alternatives: tuple[str, ...] = ()
    """Alternatives, each sufficient by itself; empty where the requirement is met."""
    note: str = ""

    @staticmethod
    def at_most(
        name: str, equation: str, value: float, limit: float, unit: str, *options: str
    ) -> Row:
        """A value with an upper limit."""
        ok = value <= limit
        return Row(name, equation, value, unit, "<=", limit, ok, () if ok else options)

    @staticmethod
    def at_least(
        name: str, equation: str, value: float, limit: float, unit: str, *options: str
    ) -> Row:
        """A value with a lower limit."""
        ok = value >= limit
        return Row(name, equation, value, unit, ">=", limit, ok, () if ok else options)

    @staticmethod
    def equal(
        name: str, equation: str, value: float, limit: float, unit: str, *options: str
    ) -> Row:
        """A value that must be met within a relative error of 1e-6."""
        ok = abs(value - limit) <= _EXACT * abs(limit)
        return Row(name, equation, value, unit, "=", limit, ok, () if ok else options)

"""One line of a sizing: a requirement, its value, its limit, and what would do where it fails."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from typing import Literal

__all__ = ["Row", "down", "up"]

_EXACT = 1e-6


def up(value: float, digits: int = 4) -> str:
    """A lower limit in words: rounded up, so that what is written does."""
    return _rounded(value, digits, ROUND_CEILING)


def down(value: float, digits: int = 4) -> str:
    """An upper limit in words: rounded down, so that what is written does."""
    return _rounded(value, digits, ROUND_FLOOR)


def _rounded(value: float, digits: int, way: str) -> str:
    exact = Decimal(value)
    unit = Decimal(1).scaleb(exact.adjusted() - digits + 1)
    return f"{float(exact.quantize(unit, rounding=way)):.{digits}g}"


@dataclass(frozen=True)
class Row:
    """A requirement; values in ``unit``, which is SI. Without a limit it is only told."""

    name: str
    equation: str
    value: float
    unit: str
    relation: Literal["<=", ">=", "=", ""] = ""
    limit: float | None = None
    ok: bool | None = None
    alternatives: tuple[str, ...] = ()
    """What would do instead, each by itself; empty where the requirement is met."""
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
        """A value that must be met to a millionth."""
        ok = abs(value - limit) <= _EXACT * abs(limit)
        return Row(name, equation, value, unit, "=", limit, ok, () if ok else options)

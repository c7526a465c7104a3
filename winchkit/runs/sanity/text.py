"""Numbers with units in the texts of findings."""

from __future__ import annotations


def share(part: float) -> str:
    """A share in per cent with two digits, never in scientific notation."""
    percent = 100 * part
    return f"{percent:.0f} %" if abs(percent) >= 9.95 else f"{percent:.2g} %"


def counted(count: int, noun: str) -> str:
    """``1 gap``, ``3 gaps``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"

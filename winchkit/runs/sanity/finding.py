"""Finding: one property of a run's channel that limits conclusions, and numbers in its text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Finding:
    """One finding, made before any analysis."""

    code: str
    """Short noun in kebab case, e.g. ``quantised``; docs/diagnosis.md lists all."""
    run: str
    """Name of the run; empty for a finding on all runs together."""
    channel: str
    """Name of the channel, or ``time``."""
    value: float
    """Size in SI or as a share, as the code defines it."""
    text: str
    """One sentence without a full stop: what, how large, and what is done about it."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that commands print."""
        return dict(vars(self))


def share(part: float) -> str:
    """A share in per cent with two digits, never in scientific notation."""
    percent = 100 * part
    return f"{percent:.0f} %" if abs(percent) >= 9.95 else f"{percent:.2g} %"


def counted(count: int, noun: str) -> str:
    """``1 gap``, ``3 gaps``, ``no gaps``."""
    return f"{count} {noun}" if count == 1 else f"{count or 'no'} {noun}s"

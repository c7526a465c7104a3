"""Finding: one property of a run's channel that limits what can be concluded from it."""

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

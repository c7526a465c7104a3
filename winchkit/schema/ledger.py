"""What a profile remembers of how it grew: one ``[[ledger]]`` table a step."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from winchkit.schema.table import Table

__all__ = ["LedgerEntry"]


@dataclass(frozen=True)
class LedgerEntry(Table):
    """One step: an effect added or removed, what it was judged on, and how to take it back."""

    did: Literal["add", "remove"]
    effect: str
    date: datetime.date
    runs: tuple[str, ...] = ()
    before: Mapping[str, str] = field(default_factory=dict)
    """Held-out error per output before the step, rms with its unit."""
    after: Mapping[str, str] = field(default_factory=dict)
    noise: Mapping[str, str] = field(default_factory=dict)
    was: tuple[Mapping[str, Any], ...] = ()
    """The ``[[effect]]`` tables before the step, in order."""
    shorthand: Mapping[str, Any] = field(default_factory=dict)
    """Shorthand keys such as ``cable.axial_stiffness`` as they were before the step."""

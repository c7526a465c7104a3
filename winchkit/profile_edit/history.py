"""The history of a profile: the held-out error after each step of its ledger."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import date
from typing import Any

from winchkit.arguments import require_type
from winchkit.errors import FileError
from winchkit.model.stages import RESULT_UNITS
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import LedgerEntry, WinchProfile
from winchkit.units import dimension_of, parse

ERROR_UNITS: Mapping[str, str] = {**RESULT_UNITS, "platform_position": "m"}
"""Outputs of winches and robots, in the order of reports, with their SI units."""


@dataclass(frozen=True)
class HistoryStep:
    """One step with its held-out errors by output, SI."""

    did: str
    effect: str
    date: date
    runs: tuple[str, ...] = ()
    before: Mapping[str, float] = field(default_factory=dict)
    after: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The step as ``winchkit ledger --json`` prints it."""
        return {**asdict(self), "date": self.date.isoformat(), "runs": list(self.runs)}


def ledger(profile: WinchProfile | RobotProfile) -> tuple[HistoryStep, ...]:
    """Return every step of a profile's ledger, oldest first; raises FileError for a wrong quantity.

    Parameters
    ----------
    profile : WinchProfile or RobotProfile
        Of a winch or a robot.

    Returns
    -------
    tuple of HistoryStep
        Held-out errors per step, SI.
    """
    require_type(profile, (WinchProfile, RobotProfile), "profile")
    return tuple(_step(entry) for entry in profile.ledger)


def _step(entry: LedgerEntry) -> HistoryStep:
    before, after, noise = (_si(entry, name) for name in ("before", "after", "noise"))
    return HistoryStep(entry.did, entry.effect, entry.date, entry.runs, before, after, noise)


def _si(entry: LedgerEntry, name: str) -> dict[str, float]:
    written: Mapping[str, str] = getattr(entry, name)
    unknown = [output for output in written if output not in ERROR_UNITS]
    if unknown:
        raise FileError(
            f"ledger, step {entry.did} {entry.effect}: {name} has '{unknown[0]}'; "
            f"outputs are {', '.join(ERROR_UNITS)}"
        )
    return {o: parse(text, dimension_of(ERROR_UNITS[o]) or "ratio") for o, text in written.items()}

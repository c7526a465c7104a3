"""A profile's ledger as a small table for a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.ladder import LADDER_UNITS, Rung
from winchkit.diagnosis.report.columns import aligned
from winchkit.diagnosis.report.phrases import OUTPUT_NAMES
from winchkit.diagnosis.report.wording import scale_for

__all__ = ["ladder_text"]

_SIGN = {"add": "+", "remove": "−"}


def ladder_text(name: str, rungs: Sequence[Rung]) -> str:
    """Held-out error per step; a step on other runs than the one before begins anew."""
    if not rungs:
        return f"{name}: nothing was added to it or removed from it"
    shown = [o for o in LADDER_UNITS if any(o in rung.after for rung in rungs)]
    rows = [["held-out error, rms", "", *(OUTPUT_NAMES[o] for o in shown)]]
    runs: tuple[str, ...] = ()
    for rung in rungs:
        if rung.runs and rung.runs != runs:
            rows.append([f"before, on {len(rung.runs)} runs", "", *_cells(rung.before, shown)])
            runs = rung.runs
        step = f"{_SIGN[rung.did]} {rung.effect}"
        rows.append([step, rung.date.isoformat(), *_cells(rung.after, shown)])
    rows.append(["noise", "", *_cells(rungs[-1].noise, shown)])
    return "\n".join([name, *aligned(rows, words=2)])


def _cells(values: Mapping[str, float], shown: Sequence[str]) -> list[str]:
    """Values of the shown outputs, a dash where a step was not judged."""
    return [
        scale_for(values[o], LADDER_UNITS[o]).text(values[o]) if o in values else "—" for o in shown
    ]

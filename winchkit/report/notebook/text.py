"""Results as one screen of plain text, for ``repr``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from winchkit.diagnosis.results import Comparison, Diagnosis
from winchkit.fit_statistics import FitStatistics
from winchkit.quantity_text import grouped, percent, significant
from winchkit.report.notebook.declarations import declared_rows
from winchkit.report.text import (
    addition_text,
    compare_text,
    diagnosed_errors,
    head_lines,
    step_lines,
)
from winchkit.report.words.columns import aligned, hanging, joined, paragraph
from winchkit.report.words.sentence import changes_text, remaining_text
from winchkit.runs.run import Run

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition, Removal
    from winchkit.diagnosis.plan import WinchPlan

_LINES = 24
"""Lines of a terminal window."""
_CHANNELS = 12
"""Rows of a table in a console; with the others a screen."""
_PROGRAMMES = 5
"""Programmes of a plan that are listed, best first."""


def screen(text: str, more: str = "") -> str:
    """Text of at most 24 lines; omitted lines are counted."""
    lines = text.split("\n")
    if len(lines) <= _LINES:
        return text
    kept = lines[: _LINES - 1]
    return "\n".join([*kept, f"… {len(lines) - len(kept)} more lines{more}"])


def run_screen(run: Run) -> str:
    """A run: its size, and its channels with their units and ranges."""
    head = f"Run {run.name}: {run_head(run)}"
    rows = run_rows(run)
    lines = aligned([["channel", "unit", "lowest", "highest", "missing"], *rows[:_CHANNELS]], 2)
    if len(rows) > _CHANNELS:
        lines.append(f"  … {len(rows) - _CHANNELS} more channels")
    told = ", ".join(f"{key} = {value}" for key, value in run.metadata.items())
    return screen("\n".join([head, *lines, *(paragraph(told, "  ", "  ") if told else [])]))


def run_head(run: Run) -> str:
    """``581 samples in 11.6 s, 50 Hz, 2 gaps``."""
    parts = [f"{grouped(len(run))} samples"]
    if len(run) > 1:
        parts[0] += f" in {significant(float(run.time[-1] - run.time[0]))} s"
        parts.append(f"{significant(1 / run.interval)} Hz")
    return ", ".join([*parts, f"{run.gaps} gaps"] if run.gaps else parts)


def run_rows(run: Run) -> list[list[str]]:
    """Per channel its name, unit, lowest and highest value, and number of missing samples."""
    rows = []
    for name, channel in run.channels.items():
        known = channel.values[np.isfinite(channel.values)]
        ends = [significant(float(f(known)), 4) if len(known) else "–" for f in (np.min, np.max)]
        rows.append([name, channel.unit, *ends, grouped(channel.missing)])
    return rows


def profile_screen(profile: Any) -> str:
    """A profile: its parts with the declared values, and its effects."""
    kind = type(profile).__name__
    text = f": {profile.description}" if profile.description else ""
    head = paragraph(f"{kind} {profile.name}{text}")
    rows = declared_rows(profile)
    return screen("\n".join([*head, *(hanging(rows) if rows else [])]))


def comparison_screen(comparison: Comparison) -> str:
    """A comparison: errors per output and their attribution."""
    return screen(compare_text(comparison), "; to_json() has all")


def diagnosis_screen(diagnosis: Diagnosis) -> str:
    """A diagnosis: verdict, steps with their doubts, held-out errors, and what would change it."""
    blocks = [
        head_lines(diagnosis),
        step_lines(diagnosis),
        diagnosed_errors(diagnosis),
        paragraph(remaining_text(diagnosis)),
        [] if diagnosis.interrupted else paragraph(changes_text(diagnosis)),
    ]
    return screen(joined(blocks), "; fit_report() and to_json() have all")


def addition_screen(addition: Addition | Removal) -> str:
    """An added or removed effect: fitted values and held-out errors."""
    return screen(addition_text(addition), "; to_json() has all")


def plan_screen(plan: WinchPlan) -> str:
    """A plan: the best programmes with their time and power."""
    pairs = [f"{a.effect.id} / {b.effect.id}" for a, b in plan.pairs]
    rows = [["programme", "minutes", *pairs]]
    for offer in plan.offers[:_PROGRAMMES]:
        powers = [percent(power) for power in offer.powers[: len(pairs)]]
        rows.append([offer.kind.name, f"{offer.minutes:.1f}", *powers])
    head = "motion programmes to run next" + (", with the power to distinguish" if pairs else "")
    more = len(plan.offers) - _PROGRAMMES
    return "\n".join([head, *aligned(rows), *([f"  … {more} more"] if more > 0 else [])])


def fit_screen(fit: FitStatistics) -> str:
    """The report of a fit."""
    return screen(fit.text(), ": print(….text())")

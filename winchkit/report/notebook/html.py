"""Results as one screen of HTML, for notebooks, from the parts of the report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.results import Comparison, Diagnosis
from winchkit.fit_statistics import FitStatistics
from winchkit.quantity_text import unbroken
from winchkit.report import tables
from winchkit.report.comparison_rows import HEAD, followed, size_rows
from winchkit.report.html.markup import Markup, details, element, table
from winchkit.report.notebook.declarations import declared_rows
from winchkit.report.notebook.text import plan_screen, run_head, run_rows
from winchkit.report.words.sentence import sentence
from winchkit.report.words.vocabulary import (
    VERDICT_NAMES,
    error_scale,
    meaning,
    output_name,
    values_text,
)
from winchkit.runs.run import Run

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition, Removal
    from winchkit.diagnosis.plan import WinchPlan

TONES = {
    "adequate": "#2b7a4b",
    "explained": "#2b7a4b",
    "partly": "#9a6a00",
    "unknown": "#a83232",
    "undecided": "#5c6670",
}
"""Colour of the edge, by verdict."""
_BOX = "border-left:4px solid {tone};padding:.3em 1em;margin:.3em 0"
_FIRST = 12
"""Rows of a table that are open: about one screen."""
_STROKE = (120.0, 18.0)
"""px of a line of the values in a table."""
_POINTS = 60
"""Points of that line, one for two pixels."""


def run_cell(run: Run) -> str:
    """A run: its channels with units and ranges, and the course of each."""
    rows = [[name, unit, *numbers, _course(run[name])] for name, unit, *numbers in run_rows(run)]
    head = ["channel", "unit", "lowest", "highest", "missing", "over time"]
    told = ", ".join(f"{key} = {value}" for key, value in run.metadata.items())
    shown = shortened(f"{run.name}: {run_head(run)}", head, rows, words=2)
    return framed("#5c6670", *shown, element("p", told))


def profile_cell(profile: Any) -> str:
    """A profile: its parts with the declared values, and its effects."""
    caption = f"{type(profile).__name__} {profile.name}"
    about = element("p", profile.description) if profile.description else Markup("")
    shown = shortened(caption, ["part", "declared"], declared_rows(profile), words=2)
    return framed("#5c6670", *shown, about)


def comparison_cell(comparison: Comparison) -> str:
    """A comparison: errors per output and their attribution."""
    rows = [
        [name, unbroken(followed(error)), *sizes]
        for (name, *sizes), error in zip(
            size_rows(comparison), comparison.outputs.values(), strict=True
        )
    ]
    caption = "Measured less predicted, with the values of the profile's file."
    return framed("#5c6670", table(caption, ["output", "explained by", *HEAD[1:]], rows, words=2))


def diagnosis_cell(diagnosis: Diagnosis) -> str:
    """A diagnosis: verdict, steps with their doubts, and held-out errors."""
    name = "Interrupted" if diagnosis.interrupted else VERDICT_NAMES[diagnosis.verdict]
    return framed(
        TONES[diagnosis.verdict],
        element("b", name),
        element("p", unbroken(sentence(diagnosis))),
        tables.steps(diagnosis),
        tables.figures(diagnosis),
    )


def addition_cell(addition: Addition | Removal) -> str:
    """An added or removed effect: fitted values and held-out errors."""
    rows = [
        [element("code", term.label), meaning(term.effect.id), values_text(values)]
        for term, values in addition.terms
    ]
    errors = []
    for name, output in addition.outputs.items():
        scale = error_scale(output)
        sizes = (output.heldout_rms_before, output.heldout_rms_after)
        noise = "unknown" if output.noise_rms is None else scale.text(output.noise_rms)
        errors.append([output_name(name), *map(scale.text, sizes), noise])
    return framed(
        TONES["explained"],
        table("Effects of the new profile.", ["effect", "meaning", "values"], rows, words=3),
        table("Held-out error, rms.", ["output", "before", "after", "noise"], errors),
    )


def plan_cell(plan: WinchPlan) -> str:
    """A plan: the best programmes with their time and power."""
    return framed("#5c6670", element("pre", plan_screen(plan)))


def fit_cell(fit: FitStatistics) -> str:
    """The report of a fit."""
    return framed("#5c6670", element("pre", fit.text()))


def framed(tone: str, *inside: str) -> str:
    """Parts of a result with an edge of a colour."""
    return element("div", *inside, style=_BOX.format(tone=tone), class_="winchkit")


def shortened(
    caption: str, head: Sequence[str], rows: Sequence[Sequence[str]], words: int = 1
) -> Iterable[Markup]:
    """A table of the first rows, and the others in a block to be opened."""
    yield table(caption, head, rows[:_FIRST], words=words)
    if len(rows) > _FIRST:
        left = len(rows) - _FIRST
        yield details(f"{left} more", table("", head, rows[_FIRST:], words=words))


def _course(values: Array) -> Markup:
    """Course of a channel as a small line."""
    means = np.array([_mean(part) for part in np.array_split(values, min(_POINTS, len(values)))])
    known = np.flatnonzero(np.isfinite(means))
    if len(known) < 2:
        return Markup("")
    width, height = _STROKE
    low, high = float(means[known].min()), float(means[known].max())
    across = known / (len(means) - 1) * width
    down = (high - means[known]) / ((high - low) or 1.0) * height
    points = " ".join(f"{x:.1f},{y + 1:.1f}" for x, y in zip(across, down, strict=True))
    line = element("polyline", points=points, fill="none", stroke="currentColor")
    box = {"width": f"{width:g}", "height": f"{height + 2:g}"}
    return element("svg", line, role="img", aria_label="course over time", **box)


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")

"""Comparison, diagnosis and addition as short plain text for a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, isnan
from typing import TYPE_CHECKING

from winchkit.diagnosis.report.columns import aligned, paragraph
from winchkit.diagnosis.report.comparison_rows import (
    HEAD,
    followed,
    map_lines,
    offset_text,
    size_rows,
)
from winchkit.diagnosis.report.phrases import (
    OUTPUT_NAMES,
    VERDICT_NAMES,
    clause,
    estimate_text,
)
from winchkit.diagnosis.report.sentence import sentence, telling, where_text
from winchkit.diagnosis.report.shown import smallest_shown
from winchkit.diagnosis.report.wording import grouped, percent, scale_for
from winchkit.diagnosis.result import Comparison, Diagnosis, OutputFit

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition
    from winchkit.diagnosis.diagnose import Answer
    from winchkit.diagnosis.remove import Removal

__all__ = ["addition_text", "compare_text", "report_text"]

_MOST_LINES = 40
_FEW = 3


def report_text(answer: Answer) -> str:
    """The story of a diagnosis in at most 40 lines of at most 100 characters."""
    diagnosis = answer.diagnosis
    blocks = [
        [VERDICT_NAMES[diagnosis.verdict].upper(), *paragraph(sentence(diagnosis))],
        _errors(diagnosis.outputs, grown=bool(diagnosis.steps)),
        _shown(answer),
        _confusion(diagnosis),
        _places(diagnosis),
        _next(diagnosis),
        _candidates(diagnosis),
        _notes(diagnosis.notes),
    ]
    lines = [line for block in blocks if block for line in (*block, "")][:-1]
    if len(lines) > _MOST_LINES:
        lines = [*lines[: _MOST_LINES - 1], "… the rest is in --json and --html"]
    return "\n".join(lines)


def compare_text(comparison: Comparison) -> str:
    """How far the profile is off per output, and what the error follows."""
    followings: list[str] = []
    for name, error in comparison.outputs.items():
        told = f"{OUTPUT_NAMES.get(name, name)} {followed(error)}"
        followings += paragraph(told, "  ", "    ")
    blocks = [aligned([HEAD, *size_rows(comparison)])]
    if followings:
        blocks.append(["what the errors follow", *followings])
    maps = [line for told in map_lines(comparison) for line in paragraph(told, "  ", "    ")]
    if maps:
        blocks.append(["over two variables at once, mean error", *maps])
    if comparison.offset is not None:
        blocks.append([offset_text(comparison.offset)])
    blocks.append(_notes(comparison.notes))
    return "\n".join(line for block in blocks if block for line in (*block, "")).rstrip("\n")


def addition_text(addition: Addition | Removal) -> str:
    """What was fitted, and what the step did to the error out of sample."""
    fitted = []
    for term, values in addition.terms:
        told = ", ".join(estimate_text(name, value) for name, value in values.items())
        fitted.append([term.label, told])
    blocks = [
        ["fitted", *aligned(fitted, words=2)] if fitted else [],
        _errors(addition.outputs, grown=True),
        _notes(addition.notes),
    ]
    return "\n".join(line for block in blocks if block for line in (*block, "")).rstrip("\n")


def _errors(outputs: Mapping[str, OutputFit], *, grown: bool) -> list[str]:
    head = ["held-out error, rms", "before", "after", "noise"]
    rows = [head if grown else [head[0], "error", "noise"]]
    for name, output in outputs.items():
        scale = scale_for(output.heldout_rms_before, output.unit)
        noise = "unknown" if output.noise_rms is None else scale.text(output.noise_rms)
        after = [scale.text(output.heldout_rms_after)] if grown else []
        before = scale.text(output.heldout_rms_before)
        rows.append([OUTPUT_NAMES.get(name, name), before, *after, noise])
    return aligned(rows)


def _shown(answer: Answer) -> list[str]:
    if answer.diagnosis.verdict != "adequate":
        return []
    seen = smallest_shown(answer)
    return ["these runs would have shown, for instance", *(f"  {line}" for line in seen)]


def _confusion(diagnosis: Diagnosis) -> list[str]:
    rows = []
    for step in diagnosis.steps:
        for effect, angle in step.angles.items():
            own = next(name for name in step.effects if name not in step.angles)
            rows.append([f"{own} / {effect}", f"{degrees(angle):.1f}° apart"])
    return ["these runs cannot tell apart", *aligned(rows, words=2)] if rows else []


def _places(diagnosis: Diagnosis) -> list[str]:
    lines = [
        line
        for where in telling(diagnosis.where)[:_FEW]
        for line in paragraph(where_text(where), "  ", "    ")
    ]
    if not lines:
        return []
    try_it = f"try: winchkit add {diagnosis.empirical[0]} (a curve, marked as not understood)"
    return ["where the rest lives", *lines, *([f"  {try_it}"] if diagnosis.empirical else [])]


def _next(diagnosis: Diagnosis) -> list[str]:
    lines = []
    for run in diagnosis.next_runs[:_FEW]:
        power = "" if isnan(run.power) else f" (power {percent(run.power)})"
        text = f"{' / '.join(run.separates)}: {run.programme}{power}"
        lines += paragraph(text, "  ", "    ")
    return ["what to run next", *lines] if lines else []


def _candidates(diagnosis: Diagnosis) -> list[str]:
    if diagnosis.verdict == "adequate":
        return []
    best = [c for c in diagnosis.candidates if c.score > 0][:_FEW]
    rows = [[c.effect, clause(c.effect), grouped(c.score)] for c in best]
    return ["strongest evidence, each alone", *aligned(rows, words=2)] if rows else []


def _notes(notes: tuple[str, ...]) -> list[str]:
    lines = [line for note in notes for line in paragraph(note, "  ", "    ")]
    return ["notes", *lines] if lines else []

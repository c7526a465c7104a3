"""Errors of the models, error ÷ noise floor, and candidate cards of the Diagnose view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Diagnosis, Estimate
from winchkit.effects.effect import Effect, parameter_name
from winchkit.quantity_text import PrintScale, between, scale_for, significant, with_std
from winchkit.report.detectability import useful_candidates
from winchkit.report.words.sentence import (
    capital,
    changes_text,
    error_text,
    headline,
    remaining_patterns,
    remaining_text,
    where_text,
)
from winchkit.report.words.steps import (
    alike,
    doubt_texts,
    has_other_law,
    reported,
    reported_steps,
    step_text,
    step_title,
)
from winchkit.report.words.vocabulary import (
    VERDICT_NAMES,
    effect_name,
    name_and_id,
    output_name,
)
from winchkit.web.words import page_text

_SHOWN = 8
"""Candidates that are shown; the others have less evidence."""
_CHANGE = 0.01
"""Change of an error that is shown as a number; below it is a dash."""


@dataclass(frozen=True)
class ModelErrors:
    """A model of the page's history with its held-out errors, SI."""

    label: str
    errors: Mapping[str, float]


def verdict(diagnosis: Diagnosis) -> dict[str, Any]:
    """Chip, headline, sentence and steps of a diagnosis."""
    parts = error_text(diagnosis), remaining_text(diagnosis)
    return {
        "verdict": diagnosis.verdict,
        "chip": VERDICT_NAMES[diagnosis.verdict],
        "headline": headline(diagnosis),
        "sentence": page_text(" ".join(part for part in parts if part)),
        "steps": [
            {
                "effect": step.effects[0],
                "certain": step.certain,
                "text": capital(step_text(step)),
                "doubts": [capital(text) for text in doubt_texts(step, diagnosis.data)],
            }
            for step in reported(diagnosis).steps
        ],
        "changes": changes_text(diagnosis),
        "patterns": [title for title, _ in patterns_of(diagnosis)],
        "unexplained": [where_text(where) for where in diagnosis.where],
        "empirical": list(diagnosis.empirical),
        "notes": [page_text(note) for note in diagnosis.notes],
        "caveats": list(diagnosis.caveats),
        "sanity": [finding.to_json() for finding in diagnosis.sanity],
        "used_share": dict(diagnosis.used_share),
    }


def patterns_of(diagnosis: Diagnosis) -> list[tuple[str, int | Attribution]]:
    """Titles of the open laws, each with the index of its step, and of the remaining patterns."""
    found: list[tuple[str, int | Attribution]] = [
        (capital(step_title(diagnosis.steps[index])), index)
        for index in reported_steps(diagnosis)
        if has_other_law(diagnosis.steps[index]) and not diagnosis.steps[index].refitted
    ]
    if not found and diagnosis.verdict in {"partly", "unknown", "undecided"}:
        places = [w for w in remaining_patterns(diagnosis) if w.frequency is None]
        found += [(capital(where_text(where)), where) for where in places[:1]]
    return found


def refitted(said: str) -> dict[str, Any]:
    """Chip and headline in place of a verdict while a refitted profile is diagnosed."""
    lists = ("patterns", "steps", "unexplained", "empirical", "notes", "caveats", "sanity")
    return {
        "verdict": "refitted",
        "chip": "Refitted",
        "headline": said,
        "sentence": "The candidates beside this profile are being fitted.",
        "changes": "",
        "used_share": {},
        **{name: [] for name in lists},
    }


def model_errors(
    answer: WinchAnswer, history: Sequence[ModelErrors], beside: Diagnosis | None = None
) -> dict[str, Any]:
    """Rows and columns of the errors of the models.

    ``beside``: another one, whose errors are given in the same units. Returns: ``columns`` with
    unit and noise floor; ``rows`` of kind ``history``, ``today``, ``candidate`` or ``floor``, each
    with its errors as text and over the noise floor.
    """
    diagnosis = answer.diagnosis
    today = {name: out.heldout_rms_before for name, out in diagnosis.outputs.items()}
    steps = reported(diagnosis).steps
    named = [effect for step in steps[:1] for effect in step.effects]
    same = {effect for step in steps[:1] for effect in alike(step)}
    equal = {*named[:1], *same} if same else set()
    scores = [c for c in useful_candidates(diagnosis) if c.heldout_rms]
    known = {c.effect: c for c in diagnosis.candidates if c.heldout_rms}
    first = [known[effect] for effect in named if effect in known]
    shown = (first + [c for c in scores if c not in first])[:_SHOWN]
    errors_of = [today, *(model.errors for model in history)]
    if beside is not None:
        errors_of.append({name: out.heldout_rms_before for name, out in beside.outputs.items()})
    scales = {
        name: scale_for([errors.get(name, 0.0) for errors in errors_of], out.unit)
        for name, out in diagnosis.outputs.items()
    }
    floors = {name: out.noise_rms for name, out in diagnosis.outputs.items()}

    def row(kind: str, label: str, errors: Mapping[str, float], **more: Any) -> dict[str, Any]:
        cells = {name: _cell(errors.get(name), floors[name], scales[name]) for name in scales}
        return {"kind": kind, "label": label, "cells": cells, **more}

    rows = [row("history", model.label, model.errors) for model in history]
    rows.append(row("today", "Present profile", today))
    # The errors of a candidate are those of its screening. Of the one effect that the sentence
    # names they are those of the sentence, of the final fit with its own weights.
    fitted: dict[str, Mapping[str, float]] = {}
    if len(steps) == 1 and named:
        after = {name: out.heldout_rms_after for name, out in diagnosis.outputs.items()}
        fitted[named[0]] = after
    for item in shown:
        errors = {
            name: value
            for name, value in fitted.get(item.effect, item.heldout_rms).items()
            if abs(value - today.get(name, value)) > _CHANGE * today.get(name, 1.0)
        }
        rows.append(
            row(
                "candidate",
                capital(effect_name(item.effect)),
                errors,
                effect=item.effect,
                equal=item.effect in equal,
                named=item.effect in named,
            )
        )
    rows.append(row("floor", "Noise floor", {k: v for k, v in floors.items() if v is not None}))
    return {
        "columns": [
            {
                "output": name,
                "name": capital(output_name(name)),
                "unit": scales[name].label,
                "source": out.noise_source,
            }
            for name, out in diagnosis.outputs.items()
        ],
        "rows": rows,
        "focus": _focus(diagnosis),
        "candidates": len(diagnosis.candidates),
        "shown": len(shown),
    }


def card(
    answer: WinchAnswer, effect: Effect, values: Mapping[str, Estimate], distinct: Sequence[str]
) -> dict[str, Any]:
    """Content of the card of a candidate."""
    runs = [
        run
        for run in answer.diagnosis.next_runs
        if effect.id in run.separates and isfinite(run.power)
    ]
    return {
        "effect": effect.id,
        "name": capital(effect_name(effect.id)),
        "what": effect.what,
        "formula": effect.formula,
        "source": effect.source,
        "outputs": list(effect.outputs),
        "parameters": [
            {
                "name": parameter_name(name),
                "text": with_std(e.value, e.std, e.unit),
                "interval": None
                if e.interval is None
                else between(*e.interval, e.unit, scale_for((e.value, e.std), e.unit)),
            }
            for name, e in values.items()
        ],
        "equal": [name_and_id(effect) for effect in distinct],
        "told_apart": effect.told_apart,
        "next": None
        if not runs
        else f"{runs[0].programme} separates {' and '.join(runs[0].separates)}"
        f" with a power of {round(100 * runs[0].power)} %",
    }


def _focus(diagnosis: Diagnosis) -> str:
    """Output whose error is farthest above its noise floor."""

    def ratio(name: str) -> float:
        out = diagnosis.outputs[name]
        return out.heldout_rms_before / out.noise_rms if out.noise_rms else 0.0

    changed = {
        name
        for _ in reported_steps(diagnosis)[:1]
        for name, out in diagnosis.outputs.items()
        if out.heldout_rms_after < (1 - _CHANGE) * out.heldout_rms_before
    }
    return max(changed or diagnosis.outputs, key=ratio)


def _cell(value: float | None, floor: float | None, scale: PrintScale) -> dict[str, Any] | None:
    if value is None or not isfinite(value):
        return None
    return {"text": significant(value / scale.worth, 3), "ratio": value / floor if floor else None}

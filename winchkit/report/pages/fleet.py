"""All winches of a recording as one page: a line for each, what they share, their own pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.fleet.anova import SharedAttribution, SharedError
from winchkit.diagnosis.fleet.meta_analysis import Pooled, SharedEffect
from winchkit.diagnosis.results import Comparison, Diagnosis, Estimate, OutputError, Step
from winchkit.report.html.markup import Markup, compact, details, element, section, table
from winchkit.report.html.page import page
from winchkit.report.pages.parts import bullets
from winchkit.report.words.columns import aligned, hanging, paragraph
from winchkit.report.words.numbers import Scale, percent, quantity, scale_for, significant, unbroken
from winchkit.report.words.sentence import telling, where_text
from winchkit.report.words.vocabulary import (
    OUTPUT_NAMES,
    VARIABLE_NAMES,
    VERDICT_NAMES,
    clause,
    estimate_text,
    listed,
)

__all__ = [
    "effect_text",
    "error_rows",
    "error_texts",
    "shared_effects_html",
    "shared_effects_text",
    "shared_errors_html",
    "shared_errors_text",
    "winch_rows",
]

_FOLLOWED = 3
_BY_CHANCE = 0.01
"""From here on an alarm of one of many winches may be chance."""
_ALL = 0.9
"""Part of a share that makes it alike in all winches, and the rest not worth a word."""


def shared_effects_text(
    found: Mapping[str, Diagnosis], shared: Sequence[SharedEffect], chances: Mapping[str, float]
) -> str:
    """A diagnosis of every winch in a line each, and which effects they share.

    ``chances`` are those of :func:`winchkit.diagnosis.fleet.meta_analysis.alarms`.
    """
    lines = [f"all {len(found)} winches", *hanging(winch_rows(found, chances), words=2)]
    if shared:
        lines += ["", "what they have in common, and what not"]
        lines += [line for one in shared for line in paragraph(effect_text(one), "  ", "    ")]
    return "\n".join(lines)


def shared_errors_text(found: Mapping[str, Comparison], shared: Mapping[str, SharedError]) -> str:
    """A comparison of every winch in a line each, and what their errors follow alike or not."""
    lines = [f"all {len(found)} winches", *aligned(error_rows(found))]
    lines += ["", "what the errors of all follow"]
    lines += [line for told in error_texts(shared) for line in paragraph(told, "  ", "    ")]
    return "\n".join(lines)


def winch_rows(found: Mapping[str, Diagnosis], chances: Mapping[str, float]) -> list[list[str]]:
    """Per winch its name, its verdict, and what was found."""
    rows = []
    for name, one in found.items():
        told, chance = _found(one), chances.get(name, 0.0)
        if chance > _BY_CHANCE:
            told += f"; by chance in one of {len(found)} winches: {percent(chance)} of recordings"
        rows.append([name, VERDICT_NAMES[one.verdict], told])
    return rows


def effect_text(shared: SharedEffect) -> str:
    """``your motor side rubs (motor-coulomb): in H alone: torque = …; A to G would show it``."""
    first, *others = shared.effects
    ids = f"{first}, or {listed(others, 'or')}" if others else first
    parts = [f"{clause(first)} ({ids}): {_where(shared)}"]
    if shared.without:
        parts.append(f"{listed(list(shared.without))} would have shown it and did not")
    if shared.unsure:
        parts.append(f"of {listed(list(shared.unsure))} these runs cannot tell")
    return "; ".join(parts)


def error_rows(found: Mapping[str, Comparison]) -> list[list[str]]:
    """A head, and per winch its name and the rms of every output's error, with the noise."""
    outputs = dict.fromkeys(output for one in found.values() for output in one.outputs)
    rows = [["error, rms (noise)", *(OUTPUT_NAMES.get(output, output) for output in outputs)]]
    scales = {}
    for output in outputs:
        own = [one.outputs[output] for one in found.values() if output in one.outputs]
        scales[output] = scale_for([error.rms for error in own], own[0].unit)
    for name, one in found.items():
        cells = []
        for output, scale in scales.items():
            error = one.outputs.get(output)
            cells.append("–" if error is None else _beside_noise(error, scale))
        rows.append([name, *cells])
    return rows


def _beside_noise(error: OutputError, scale: Scale) -> str:
    """``2.10 mm (0.13)``."""
    if error.noise_rms is None:
        return scale.text(error.rms)
    return f"{scale.text(error.rms)} ({significant(error.noise_rms / scale.worth, 2)})"


def error_texts(shared: Mapping[str, SharedError]) -> list[str]:
    """Per output what its errors follow: ``motor torque: direction 87 %, most of it in H``."""
    out = []
    for output, error in shared.items():
        told = "; ".join(_followed(one) for one in error.follows[:_FOLLOWED])
        most = [
            f", {percent(s)} of the squares in {w}" for w, s in error.winches.items() if s > 0.5
        ]
        off = f"{quantity(error.rms, error.unit)} rms{''.join(most)}"
        name = OUTPUT_NAMES.get(output, output)
        out.append(f"{name} ({off}): {told or 'nothing that was measured'}")
    return out


def _followed(one: SharedAttribution) -> str:
    name = "winch, a level of its own" if one.variable == "winch" else VARIABLE_NAMES[one.variable]
    told = f"{name} {percent(one.share)}"
    if one.variable != "winch":
        if one.common >= _ALL * one.share:
            return f"{told}, alike in all"
        told += f", {percent(one.common)} alike in all"
    return (
        f"{told}, most of the difference in {listed(list(one.outlying))}" if one.outlying else told
    )


def _found(one: Diagnosis) -> str:
    if one.steps:
        return "; ".join(_step(step) for step in one.steps)
    if one.verdict == "adequate":
        return "nothing above the noise"
    return "; ".join(where_text(where) for where in telling(one.where)[:1]) or "no known effect"


def _step(step: Step) -> str:
    first, *others = step.effects
    values = [estimate_text(n, e) for n, e in step.parameters.get(first, {}).items()]
    beside = f" (or {listed(others, 'or')})" if others else ""
    return f"{first}{beside} {', '.join(values)}".strip()


def _where(shared: SharedEffect) -> str:
    values = ", ".join(_value(name, p) for name, p in shared.parameters.items())
    told = f": {values}" if values else ""
    if len(shared.winches) == 1:
        alone = "alone" if not shared.unsure else "at least"
        return f"in {shared.winches[0]} {alone}{told}"
    every = not shared.without and not shared.unsure
    who = f"all {len(shared.winches)}" if every else listed(list(shared.winches))
    return f"in {who}, {_likeness(shared)}{told}"


def _likeness(shared: SharedEffect) -> str:
    """Whether the winches have it alike, all parameters together."""
    outlying = dict.fromkeys(name for p in shared.parameters.values() for name in p.outlying)
    if all(p.homogeneous for p in shared.parameters.values()):
        return "alike"
    return f"alike but for {listed(list(outlying))}" if outlying else "of different sizes"


def _value(name: str, one: Pooled) -> str:
    told = estimate_text(name, Estimate(one.value, one.std, one.unit))
    if one.homogeneous or one.outlying:
        return told
    return f"{told} in the mean, {quantity(one.spread, one.unit, 2)} from winch to winch"


def shared_effects_html(
    found: Mapping[str, Diagnosis],
    shared: Sequence[SharedEffect],
    chances: Mapping[str, float],
    title: str,
    pages: Mapping[str, str],
) -> str:
    """The page over the diagnoses of all winches; ``pages`` are the names of each one's own."""
    told_of = winch_rows(found, chances)
    rows = [[_link(name, pages), verdict, unbroken(text)] for name, verdict, text in told_of]
    told = [unbroken(effect_text(one)) for one in shared]
    return page(
        title,
        (),
        section("winches", "Every winch", _table(["winch", "verdict", "what was found"], rows, 3)),
        section("shared", "What they have in common, and what not", bullets(told)),
        _as_json({"effects": [one.to_json() for one in shared], "alarms": dict(chances)}),
    )


def shared_errors_html(
    found: Mapping[str, Comparison],
    shared: Mapping[str, SharedError],
    title: str,
    pages: Mapping[str, str],
) -> str:
    """The page over the comparisons of all winches, as :func:`shared_effects_html`."""
    head, *rows = error_rows(found)
    linked = [[_link(name, pages), *cells] for name, *cells in rows]
    told = [unbroken(text) for text in error_texts(shared)]
    return page(
        title,
        (),
        section("winches", "Every winch", _table(head, linked, 1)),
        section("shared", "What the errors of all follow", bullets(told)),
        _as_json({"outputs": {name: error.to_json() for name, error in shared.items()}}),
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], words: int) -> Markup:
    return table("Each by itself, against the same profile.", head, rows, words=words)


def _link(name: str, pages: Mapping[str, str]) -> Markup:
    return element("a", name or "the winch", href=pages[name])


def _as_json(shared: Mapping[str, object]) -> Markup:
    return details("What is shared as JSON", element("pre", compact(shared, indent=1)))

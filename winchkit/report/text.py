"""Comparison, diagnosis and addition as short plain text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import degrees, isnan
from typing import TYPE_CHECKING

from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Comparison, Diagnosis, OutputFit, RunOffset
from winchkit.effects.card import sparkline
from winchkit.effects.placement import HOME
from winchkit.profile_edit.history import LADDER_UNITS
from winchkit.report.comparison_rows import (
    HEAD,
    followed,
    map_lines,
    offset_text,
    size_rows,
)
from winchkit.report.detectability import untestable, visible
from winchkit.report.figures.unexplained import unexplained_curve
from winchkit.report.figures.waterfall import waterfall_of
from winchkit.report.words.caveats import caveat_text, finding_texts, used_text
from winchkit.report.words.columns import aligned, hanging, paragraph
from winchkit.report.words.numbers import Scale, grouped, percent, scale_for, significant, with_std
from winchkit.report.words.sentence import changes_text, main_patterns, sentence, where_text
from winchkit.report.words.vocabulary import (
    OUTPUT_NAMES,
    VERDICT_NAMES,
    clause,
    combination_text,
    interval_text,
    parameter_name,
    values_text,
)

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition, Removal
    from winchkit.diagnosis.diagnose import Answer

__all__ = ["addition_text", "compare_text", "error_lines", "report_text"]

_MOST_LINES = 70
"""Lines of a text, two or three screens."""
_FEW = 3
"""Correlations and patterns that are listed, largest first."""
_SOONEST = 4
"""Most sensitive effects that are listed; ``--json`` has all."""
_MOST_OFFSETS = 6
"""Offsets of runs that are listed."""
_BARS = 40
"""Characters of a curve; with its scale within 80."""


def report_text(answer: Answer) -> str:
    """A diagnosis as text.

    Parameters
    ----------
    answer : Answer
        Of a winch or a robot.

    Returns
    -------
    str
        At most 70 lines of at most 80 characters.
    """
    diagnosis = answer.diagnosis
    blocks = [
        [_head(diagnosis), *paragraph(sentence(diagnosis))],
        error_lines(
            diagnosis.outputs,
            extended=bool(diagnosis.steps),
            data=diagnosis.data,
            offsets=diagnosis.run_offsets,
        ),
        _ladder(answer),
        _confusion(diagnosis),
        _correlations(diagnosis),
        _places(answer),
        _next(diagnosis),
        paragraph(changes_text(diagnosis)) if not diagnosis.interrupted else [],
        _shown(answer),
        _candidates(answer),
        *_data(diagnosis),
        _notes(diagnosis.notes),
    ]
    lines = [line for block in blocks if block for line in (*block, "")][:-1]
    if len(lines) > _MOST_LINES:
        lines = [*lines[: _MOST_LINES - 1], "… more in --json and --html"]
    return "\n".join(lines)


def _head(diagnosis: Diagnosis) -> str:
    return "INTERRUPTED" if diagnosis.interrupted else VERDICT_NAMES[diagnosis.verdict].upper()


def compare_text(comparison: Comparison) -> str:
    """A comparison as text: errors per output, and their attribution to variables.

    Parameters
    ----------
    comparison : Comparison
        The comparison.

    Returns
    -------
    str
        Text of at most 80 columns.
    """
    attributed: list[str] = []
    for name, error in comparison.outputs.items():
        text = f"{OUTPUT_NAMES.get(name, name)}: {followed(error)}"
        attributed += paragraph(text, "  ", "    ")
    blocks = [aligned([HEAD, *size_rows(comparison)])]
    if attributed:
        blocks.append(["share of the error's variance explained by", *attributed])
    maps = [line for text in map_lines(comparison) for line in paragraph(text, "  ", "    ")]
    if maps:
        blocks.append(["mean error over two variables", *maps])
    if comparison.offset is not None:
        blocks.append([offset_text(comparison.offset)])
    blocks += [*_data(comparison), _notes(comparison.notes)]
    return _joined(blocks)


def addition_text(addition: Addition | Removal) -> str:
    """An added or removed effect as text: fitted values, and held-out errors.

    Parameters
    ----------
    addition : Addition or Removal
        The added or removed effect.

    Returns
    -------
    str
        Text of at most 80 columns.
    """
    fitted = []
    for term, every in addition.terms:
        values = {name: e for name, e in every.items() if not name.startswith(HOME)}
        text = values_text(values)
        beside = "; with the home lengths of the lines" if len(values) < len(every) else ""
        fitted.append([term.label, text + beside])
        series = "order_2" in values
        sure = {} if series else {n: interval_text(n, v) for n, v in values.items()}
        fitted += [["", f"{parameter_name(n)} {text}"] for n, text in sure.items() if text]
    blocks = [
        ["fitted", *hanging(fitted)] if fitted else [],
        error_lines(addition.outputs, extended=True),
        _notes(addition.notes),
    ]
    return _joined(blocks)


def error_lines(
    outputs: Mapping[str, OutputFit],
    *,
    extended: bool,
    data: str = "runs",
    offsets: Sequence[RunOffset] = (),
) -> list[str]:
    """Held-out errors per output as lines.

    Parameters
    ----------
    outputs : mapping of str to OutputFit
        Errors by output.
    extended : bool
        Whether the model was changed, so that there are errors before and after.
    data : str
        Kind of data, ``runs`` or ``poses``.
    offsets : sequence of RunOffset
        Offsets that every run has for itself, whether it is held out or not.

    Returns
    -------
    list of str
        Lines of at most 80 characters.
    """
    head = ["held-out error, rms", "before", "after", "noise"]
    rows = [head if extended else [head[0], "error", "noise"]]
    for name, output in outputs.items():
        scale = scale_for(output.heldout_rms_before, output.unit)
        noise = "unknown" if output.noise_rms is None else scale.text(output.noise_rms)
        after = [scale.text(output.heldout_rms_after)] if extended else []
        before = scale.text(output.heldout_rms_before)
        rows.append([OUTPUT_NAMES.get(name, name), before, *after, noise])
    held_out = f"held out: each group of {data} is predicted with values fitted without it"
    if not offsets:
        return [*aligned(rows), f"  ({held_out})"]
    own = " and ".join(dict.fromkeys(OUTPUT_NAMES.get(o.output, o.output) for o in offsets))
    held_out += f"; the offset of the {own} is estimated from every run itself"
    return [*aligned(rows), *paragraph(f"({held_out})", "  ", "   "), *_offsets(offsets)]


def _offsets(offsets: Sequence[RunOffset]) -> list[str]:
    """Offsets of single runs, which are no part of the profile."""
    rows = []
    for offset in offsets[:_MOST_OFFSETS]:
        value = with_std(offset.value, offset.std, offset.unit)
        rows.append([offset.run, OUTPUT_NAMES.get(offset.output, offset.output), value])
    more = len(offsets) - len(rows)
    last = [f"  and {more} further in --json"] if more else []
    return ["", "offset of each run", *aligned(rows, words=2), *last]


def _ladder(answer: Answer) -> list[str]:
    """Contribution of each of several effects: added alone first, and removed last."""
    ladder = waterfall_of(answer)
    if ladder is None or len(ladder.first) < 2:
        return []
    outputs = answer.diagnosis.outputs
    scales = {n: scale_for(o.heldout_rms_before, o.unit) for n, o in outputs.items()}
    states = [
        *ladder.rungs,
        *((f"only {name}", rms) for name, rms in ladder.first.items()),
        *((f"all but {name}", rms) for name, rms in ladder.last.items()),
    ]
    rows = [["held-out error, rms", *(OUTPUT_NAMES.get(name, name) for name in scales)]]
    rows += [[label, *(scales[n].text(rms[n]) for n in scales)] for label, rms in states]
    noise = {name: output.noise_rms for name, output in outputs.items()}
    rows.append(["noise", *(_text_or_unknown(scales[n], noise[n]) for n in scales)])
    return ["contribution of each effect", *aligned(rows)]


def _text_or_unknown(scale: Scale, value: float | None) -> str:
    return "unknown" if value is None else scale.text(value)


def _shown(answer: Answer) -> list[str]:
    """Effects that are detectable with these runs, and their smallest sizes."""
    rows, blind = visible(answer), [effect for effect, _ in untestable(answer)]
    if not rows:
        return []
    able, count = [row for row in rows if row.usual], len(rows) + len(blind)
    data = answer.diagnosis.data
    head = (
        f"detectable with these {data} (90 % power): {len(able)} of {count} effects at typical size"
    )
    soonest = [[row.effect, f"{row.parameter} {row.text}"] for row in able[:_SOONEST]]
    lines = [head, *aligned(soonest, words=2)]
    large = [f"{r.effect} ({significant(r.share, 2)} ×)" for r in rows if r.share > 1.0]
    if large:
        text = f"only at a multiple of the typical size: {', '.join(large)}"
        lines += paragraph(text, "  ", "    ")
    never = [row.effect for row in rows if isnan(row.share)]
    if never:
        lines += paragraph(f"at no size within the bounds: {', '.join(never)}", "  ", "    ")
    if large or never:
        lines.append("  'winchkit plan' proposes runs that detect most of them")
    if blind:
        lines += paragraph(
            f"not tested, a part or a channel is missing: {', '.join(blind)}", "  ", "    "
        )
    return lines


def _confusion(diagnosis: Diagnosis) -> list[str]:
    rows = []
    for step in (step for step in diagnosis.steps if not step.whole):
        own = [name for name in step.effects if name not in step.angles]
        for effect, angle in step.angles.items() if own else ():
            rows.append([f"{own[0]} / {effect}", f"{degrees(angle):.1f}° between signatures"])
    head = f"cannot be distinguished with these {diagnosis.data}"
    lines = [head, *aligned(rows, words=2)] if rows else []
    determined = [
        combination_text(step.combination) for step in diagnosis.steps if step.combination
    ]
    if determined:
        lines.append("determined by the data")
        lines += [line for text in determined for line in paragraph(text, "  ", "    ")]
    return lines


def _correlations(diagnosis: Diagnosis) -> list[str]:
    """Correlated values of named effects, and the condition number."""
    if diagnosis.fit is None or not diagnosis.steps or not diagnosis.fit.correlations:
        return []
    pairs = [
        f"{pair.a} and {pair.b} {significant(pair.value, 2)}"
        for pair in diagnosis.fit.correlations[:_FEW]
    ]
    more = len(diagnosis.fit.correlations) - len(pairs)
    text = "; ".join(pairs) + (f"; {more} more in --json" if more else "")
    condition = f"; condition number {significant(diagnosis.fit.condition, 2)}"
    return ["correlation of fitted values", *paragraph(text + condition, "  ", "    ")]


def _places(answer: Answer) -> list[str]:
    """Patterns of the unexplained residual, its shape, and commands to continue."""
    diagnosis, lines = answer.diagnosis, []
    for where in main_patterns(diagnosis.where)[:_FEW]:
        lines += paragraph(where_text(where), "  ", "    ")
        if not where.frequency and diagnosis.verdict in {"partly", "unknown"}:
            lines.append(f"    {_shape(answer, where)}")
    if not lines:
        return []
    if diagnosis.empirical:
        name = diagnosis.empirical[0]
        lines += paragraph(
            f"'winchkit add {name}' adds it as an empirical curve; 'winchkit effects new' creates "
            "an effect of your own from it",
            "  ",
            "  ",
        )
    return ["unexplained residual", *lines]


def _shape(answer: Answer, where: Attribution) -> str:
    """The mean residual over its variable, as bars from its lowest to its highest value."""
    _, mean = unexplained_curve(answer, where)
    low, high = float(mean.min()), float(mean.max())
    scale = scale_for((low, high), LADDER_UNITS[where.output])
    bars = sparkline(mean, min(_BARS, len(mean)))
    return f"{bars}  {scale.text(low, 2)} to {scale.text(high, 2)}"


def _next(diagnosis: Diagnosis) -> list[str]:
    lines = []
    for run in diagnosis.next_runs[:_FEW]:
        power = "" if isnan(run.power) else f" (power {percent(run.power)})"
        text = f"{' / '.join(run.separates)}: {run.programme}{power}"
        lines += paragraph(text, "  ", "    ")
    return ["next runs", *lines] if lines else []


def _candidates(answer: Answer) -> list[str]:
    diagnosis = answer.diagnosis
    if diagnosis.verdict == "adequate":
        return []
    best = [c for c in diagnosis.candidates if c.score > 0][:_FEW]
    if not best:
        return []
    chance = significant(max(answer.result.threshold, 0.0), 2)
    rows = [[c.effect, grouped(c.score), clause(c.effect)] for c in best]
    head = f"highest evidence, each alone (1 % false-alarm threshold: {chance})"
    return [head, *hanging(rows)]


def _data(result: Comparison | Diagnosis) -> list[list[str]]:
    """Caveats, findings on the data, and the share of the samples that is compared."""
    caveats = [caveat_text(code) for code in result.caveats]
    findings = finding_texts(result.sanity)
    used = used_text(result.used_share)
    blocks = {"caveats": caveats, "data": [*findings, *([used] if used else [])]}
    return [
        [head, *(line for text in texts for line in paragraph(text, "  ", "    "))]
        for head, texts in blocks.items()
        if texts
    ]


def _notes(notes: tuple[str, ...]) -> list[str]:
    lines = [line for note in notes for line in paragraph(note, "  ", "    ")]
    return ["notes", *lines] if lines else []


def _joined(blocks: Iterable[Sequence[str]]) -> str:
    """Blocks of lines with an empty line between them; empty blocks are left out."""
    return "\n".join(line for block in blocks if block for line in (*block, "")).rstrip("\n")

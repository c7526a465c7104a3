"""Comparison, diagnosis and addition as short plain text for a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import degrees, isnan
from typing import TYPE_CHECKING

from winchkit import wings
from winchkit.diagnosis.data.sanity import ALARMING, UNRELATED
from winchkit.diagnosis.design.excitation import missing_excitation
from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.residuals.common_force import COMMON_FORCE
from winchkit.diagnosis.residuals.outlying_run import OUTLYING
from winchkit.diagnosis.results import Comparison, Diagnosis, OutputFit, RunOffset, Step
from winchkit.effects.card import sparkline
from winchkit.effects.effect import parameter_name
from winchkit.effects.placement import HOME
from winchkit.profile_edit.history import ERROR_UNITS
from winchkit.quantity_text import grouped, percent, scale_for, significant, with_std
from winchkit.report.comparison_rows import (
    HEAD,
    failing,
    followed,
    map_lines,
    offset_text,
    short_rows,
    size_rows,
)
from winchkit.report.detectability import (
    Visible,
    has_typical_sizes,
    untestable,
    useful_candidates,
    visible,
)
from winchkit.report.figures.unexplained import unexplained_curve
from winchkit.report.figures.waterfall import falls_of, waterfall_of
from winchkit.report.words.caveats import caveat_text, finding_texts, used_text
from winchkit.report.words.columns import aligned, entries, hanging, joined, paragraph
from winchkit.report.words.headline import comparison_headline, noise_text
from winchkit.report.words.sentence import (
    changes_text,
    error_text,
    headline,
    main_patterns,
    remaining_patterns,
    remaining_text,
    unrelated_outputs,
    where_text,
    wrong_channels,
)
from winchkit.report.words.steps import (
    ErrorFall,
    alike,
    doubt_texts,
    named_only,
    reported_steps,
    step_text,
)
from winchkit.report.words.vocabulary import (
    OUTPUT_NAMES,
    VERDICT_NAMES,
    clause,
    combination_text,
    error_scale,
    interval_text,
    output_name,
    values_text,
)

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition, Removal

_MOST_LINES = 29
"""Lines of the short text; with the next command a screen."""
_FEW = 3
"""Correlations, candidates and next runs that are listed, largest first."""
_SOONEST = 4
"""Most sensitive effects that are listed; ``--json`` has all."""
_MOST_OFFSETS = 6
"""Offsets of runs that are listed."""
_BARS = 40
"""Characters of a curve; with its scale within 80."""
_USED = 0.95
"""Share of the samples of an output from which practically all are compared."""
FAILS = "where it fails (shares of the error's variance)"
_STEP_LINES = 12
"""Lines of steps in the short text, or as many as the rest leaves."""


def report_text(answer: Answer, *, verbose: bool = False) -> str:
    """A diagnosis in lines of at most 80 characters, at most 29 unless ``verbose``."""
    diagnosis = answer.diagnosis
    limits = _limits(answer)
    notes = [note for note in diagnosis.notes if verbose or note not in limits]
    blocks = [
        head_lines(diagnosis),
        diagnosed_errors(diagnosis),
        _remaining(answer, verbose=verbose),
        _changes(diagnosis),
        *_data(diagnosis, all_shares=verbose),
        _notes(notes),
    ]
    if verbose:
        blocks += [
            _contributions(answer),
            _confusion(diagnosis),
            _correlations(diagnosis),
            _next(diagnosis),
            _shown(answer),
        ]
    if verbose or diagnosis.interrupted:
        blocks.append(_candidates(answer))

    def steps(most: int | None) -> list[str]:
        return step_lines(diagnosis, falls, most)

    falls, room = falls_of(answer), _MOST_LINES - 1 - len(joined(blocks).split("\n"))
    shorter = (steps(most) for most in range(room, _STEP_LINES, -1))
    fitting = next((lines for lines in shorter if len(lines) <= room), None)
    blocks.insert(1, steps(None) if verbose else fitting or steps(_STEP_LINES))
    lines = joined(blocks).split("\n")
    if len(lines) > _MOST_LINES and not verbose:
        lines = [*lines[: _MOST_LINES - 1], "… more with --verbose"]
    text = "\n".join(lines)
    if not isinstance(answer, WinchAnswer):
        return text
    return in_units_of(answer.engine.regression.dataset.profile, text)


def _changes(diagnosis: Diagnosis) -> list[str]:
    """What to record or to do next."""
    if diagnosis.interrupted:
        return []
    option = " (--as-recorded)" if wrong_channels(diagnosis) else ""
    return paragraph(f"{changes_text(diagnosis).removesuffix('.')}{option}.")


def _limits(answer: Answer) -> list[str]:
    """Notes on what these data cannot show, which are no fault of them."""
    if (by_wing := wings.call("limits", answer)) is not None:
        return list(by_wing(answer))
    assert isinstance(answer, WinchAnswer)
    return missing_excitation(answer.engine.regression)


def head_lines(diagnosis: Diagnosis) -> list[str]:
    """Verdict, and what is missing with the error that falls."""
    name = "INTERRUPTED" if diagnosis.interrupted else VERDICT_NAMES[diagnosis.verdict].upper()
    return [name, *paragraph(f"{headline(diagnosis)}. {error_text(diagnosis)}".strip())]


def step_lines(
    diagnosis: Diagnosis, falls: Sequence[ErrorFall] = (), most: int | None = None
) -> list[str]:
    """Every step that is reported, what explains most first, with its doubts below.

    ``falls``: held-out errors before and after each step. ``most``: number of lines from which
    further steps are named only, as are small ones.
    """
    lines: list[str] = []
    known = dict(enumerate(falls))
    told = reported_steps(diagnosis)
    small = named_only([diagnosis.steps[index] for index in told], diagnosis.outputs)
    number, left_out, full = 0, list[Step](), False
    for index in told:
        step = diagnosis.steps[index]
        if most is not None and lines and (full or step in small):
            left_out.append(step)
            continue
        text = step_text(step, diagnosis.outputs, known.get(index))
        own = paragraph(text, f"{number + 1}. ", "   ")
        if doubts := "; ".join(doubt_texts(step, diagnosis.data)):
            own += paragraph(doubts, "   ? ", "     ")
        full = most is not None and bool(lines) and len(lines) + len(own) > most
        if full:
            left_out.append(step)
            continue
        number += 1
        lines += own
    return [*lines, *paragraph(_named_only(left_out, small), "", "  ")] if left_out else lines


def _named_only(left_out: Sequence[Step], small: Sequence[Step]) -> str:
    """Steps that ``--verbose`` shows; the small ones apart, which the headline does not count."""
    large = [step for step in left_out if step not in small]
    parts = (
        (f"{len(large)} more with --verbose", large),
        ("doubtful and under 1 % each", [step for step in left_out if step in small]),
    )
    words = [f"{what}: {', '.join(s.effects[0] for s in own)}" for what, own in parts if own]
    return f"… {'; '.join(words)}"


def compare_text(comparison: Comparison, *, verbose: bool = False) -> str:
    """A comparison as text: errors per output beside their noise, and where they fail."""
    blocks = [paragraph(f"{comparison_headline(comparison)}.")]
    if comparison.outputs and not verbose:
        lines = entries(failing(comparison))
        blocks += [aligned(short_rows(comparison)), [FAILS, *lines] if lines else []]
    elif comparison.outputs:
        blocks += _tables(comparison)
    blocks += [*_data(comparison, all_shares=verbose), _notes(comparison.notes)]
    return joined(blocks)


def _tables(comparison: Comparison) -> list[list[str]]:
    """All figures of a comparison, with the attribution of its errors to variables."""
    attributed = entries(
        f"{output_name(name)}: {followed(error)}" for name, error in comparison.outputs.items()
    )
    blocks = [aligned([HEAD, *size_rows(comparison)])]
    if attributed:
        blocks.append(["share of the error's variance explained by", *attributed])
    if maps := entries(map_lines(comparison)):
        blocks.append(["mean error over two variables", *maps])
    if comparison.offset is not None:
        blocks.append([offset_text(comparison.offset)])
    return blocks


def addition_text(addition: Addition | Removal) -> str:
    """An added or removed effect as text: fitted values, and held-out errors."""
    from winchkit.diagnosis.add import Addition
    from winchkit.report.simulated import refit_lines

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
        _errors(addition.outputs, extended=True),
        refit_lines(addition.motion) if isinstance(addition, Addition) else [],
        _notes(addition.notes),
    ]
    return joined(blocks)


def diagnosed_errors(diagnosis: Diagnosis) -> list[str]:
    """Held-out errors of a diagnosis."""
    extended, offsets = bool(reported_steps(diagnosis)), diagnosis.run_offsets
    return _errors(diagnosis.outputs, extended=extended, offsets=offsets)


def _errors(
    outputs: Mapping[str, OutputFit],
    *,
    extended: bool,
    offsets: Sequence[RunOffset] = (),
) -> list[str]:
    """Held-out errors per output, with the offsets of each run."""
    head = ["held-out error, rms", "before", "after", "noise"]
    rows = [head if extended else [head[0], "error", "noise"]]
    for name, output in outputs.items():
        scale = error_scale(output)
        noise = noise_text(output).removeprefix("noise ")
        after = [scale.text(output.heldout_rms_after)] if extended else []
        before = scale.text(output.heldout_rms_before)
        rows.append([output_name(name), before, *after, noise])
    data = next((output.heldout_on for output in outputs.values()), "runs")
    held_out = f"held out: measured on {data} that the fit had not seen"
    if extended:  # Then values with their deviations stand above.
        held_out = f"± one standard deviation; held out: on {data} that the fit had not seen"
    if offsets:
        own = " and ".join(dict.fromkeys(output_name(o.output) for o in offsets))
        held_out += f"; the offset of the {own} is estimated from every run itself"
    lines = [*aligned(rows), *paragraph(f"({held_out})", "  ", "   ")]
    return [*lines, *_offsets(offsets)] if offsets else lines


def _offsets(offsets: Sequence[RunOffset]) -> list[str]:
    """Offsets of single runs, which are no part of the profile."""
    rows, scales = [], {}
    for offset in offsets:
        sizes = [o.value for o in offsets if o.output == offset.output]
        scales[offset.output] = scale_for(sizes, offset.unit)
    for offset in offsets[:_MOST_OFFSETS]:
        value = with_std(offset.value, offset.std, offset.unit, scales[offset.output])
        rows.append([offset.run, output_name(offset.output), value])
    more = len(offsets) - len(rows)
    last = [f"  and {more} further in --json"] if more else []
    return ["", "offset of each run", *aligned(rows, words=2), *last]


def _contributions(answer: Answer) -> list[str]:
    """Contribution of each of several effects: added alone first, and removed last."""
    parts = waterfall_of(answer)
    if parts is None or len(parts.first) < 2:
        return []
    outputs = answer.diagnosis.outputs
    scales = {n: error_scale(o) for n, o in outputs.items()}
    states = [
        *parts.steps,
        *((f"only {name}", rms) for name, rms in parts.first.items()),
        *((f"all but {name}", rms) for name, rms in parts.last.items()),
    ]
    rows = [["held-out error, rms", *(output_name(name) for name in scales)]]
    rows += [[label, *(scales[n].text(rms[n]) for n in scales)] for label, rms in states]
    rows.append(["noise", *(noise_text(outputs[n]).removeprefix("noise ") for n in scales)])
    return ["contribution of each effect", *aligned(rows)]


def _shown(answer: Answer) -> list[str]:
    """Effects that are detectable with these runs, and their smallest sizes."""
    rows, blind = visible(answer), [effect for effect, _ in untestable(answer)]
    if not rows:
        return []
    if not has_typical_sizes(answer):
        return _shown_sizes(answer, rows)
    able, count = [row for row in rows if row.usual], len(rows) + len(blind)
    data = answer.diagnosis.data
    head = (
        f"detectable with these {data} (90 % power): {len(able)} of {count} effects at typical size"
    )
    soonest = [[row.effect, f"{row.parameter} {row.text}"] for row in able[:_SOONEST]]
    lines = [head, *aligned(soonest, words=2)]
    large = [f"{r.effect} ({significant(r.share, 2)} ×)" for r in rows if r.share > 1.0]
    if large:
        lines += entries([f"visible only if larger than usual: {', '.join(large)}"])
    never = [row.effect for row in rows if isnan(row.share)]
    if never:
        lines += entries([f"cannot be seen in these runs: {', '.join(never)}"])
    if large or never:
        lines.append("  'winchkit plan' proposes runs that detect most of them")
    if blind:
        lines += entries([f"not tested, a part or a channel is missing: {', '.join(blind)}"])
    return lines


def _shown_sizes(answer: Answer, rows: Sequence[Visible]) -> list[str]:
    """The smallest sizes alone: a carriage may have any mass, and forces to match."""
    sizes = [[row.effect, f"{row.parameter} {row.text}"] for row in rows]
    return [f"detectable with these {answer.diagnosis.data} (90 % power)", *aligned(sizes, words=2)]


def _confusion(diagnosis: Diagnosis) -> list[str]:
    rows = [
        [f"{step.effects[0]} / {effect}", f"{degrees(angle):.1f}° between signatures"]
        for step in diagnosis.steps
        for effect, angle in alike(step).items()
    ]
    head = f"cannot be distinguished with these {diagnosis.data}"
    lines = [head, *aligned(rows, words=2)] if rows else []
    determined = [
        combination_text(step.combination) for step in diagnosis.steps if step.combination
    ]
    if determined:
        lines.append("determined by the data")
        lines += entries(determined)
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
    return ["correlation of fitted values", *entries([text + condition])]


def _remaining(answer: Answer, *, verbose: bool) -> list[str]:
    """What remains and where, its shape, and commands to continue."""
    diagnosis, lines = answer.diagnosis, []
    told = remaining_text(diagnosis)
    if not told and not verbose:
        return []
    listed = main_patterns(diagnosis.where)
    if not verbose:
        most = 1 if diagnosis.verdict == "explained" else 2
        listed = remaining_patterns(diagnosis)[:most] if told else []
    for where in listed:
        lines += entries([where_text(where)])
        if not where.frequency:
            lines.append(f"    {_shape(answer, where)}")
    if lines and diagnosis.empirical:
        lines += entries([f"'winchkit add {diagnosis.empirical[0]}' adds it as a curve"])
    share = told.partition(" Main pattern")[0]
    head = "patterns of the residual" if not share or share.startswith("Main") else share
    return [*paragraph(head), *lines] if lines or share else []


def _shape(answer: Answer, where: Attribution) -> str:
    """The mean residual over its variable, as bars from its lowest to its highest value."""
    _, mean = unexplained_curve(answer, where)
    low, high = float(mean.min()), float(mean.max())
    scale = scale_for((low, high), ERROR_UNITS[where.output])
    bars = sparkline(mean, min(_BARS, len(mean)))
    return f"{bars}  {scale.text(low, 2)} to {scale.text(high, 2)}"


def _next(diagnosis: Diagnosis) -> list[str]:
    texts = []
    for run in diagnosis.next_runs[:_FEW]:
        power = "" if isnan(run.power) else f" (power {percent(run.power)})"
        between = f"{' / '.join(run.separates)}: " if run.separates else ""
        texts.append(f"{between}{run.programme}{power}")
    return ["next runs", *entries(texts)] if texts else []


def _candidates(answer: Answer) -> list[str]:
    best = useful_candidates(answer.diagnosis)[:_FEW]
    if not best:
        return []
    chance = significant(max(answer.result.threshold, 0.0), 2)
    rows = [[c.effect, grouped(c.score), clause(c.effect)] for c in best]
    head = f"highest evidence, each alone (1 % false-alarm threshold: {chance})"
    return [head, *hanging(rows)]


def _data(result: Comparison | Diagnosis, *, all_shares: bool) -> list[list[str]]:
    """Caveats, findings on the data, and the share of the samples that is compared."""
    # The headline has wrong channels where nothing was searched.
    told = ALARMING if isinstance(result, Diagnosis) and not result.candidates else frozenset()
    if isinstance(result, Diagnosis) and unrelated_outputs(result):
        told |= {UNRELATED}
    if isinstance(result, Diagnosis):
        told |= {COMMON_FORCE, OUTLYING}
    most = {} if all_shares else {"most": 1}
    findings = finding_texts([f for f in result.sanity if f.code not in told], **most)
    caveats = [caveat_text(code) for code in result.caveats if code not in told]
    quiet = [band for band in result.removed if all_shares and not band.above_noise]
    findings += [f"{OUTPUT_NAMES[band.output]}: {band.text}" for band in quiet]
    limit = 2.0 if all_shares else _USED
    used = used_text({name: s for name, s in result.used_share.items() if s < limit})
    blocks = {"caveats": caveats, "data": [*findings, *([used] if used else [])]}
    return [[head, *entries(texts)] for head, texts in blocks.items() if texts]


def _notes(notes: Sequence[str]) -> list[str]:
    return ["notes", *entries(notes)] if notes else []

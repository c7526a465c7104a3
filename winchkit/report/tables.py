"""The tables of a report: errors, contributions, candidates, equivalence sets, detectability."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from math import degrees, isfinite

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.results import CandidateScore, Diagnosis, Estimate, OutputFit
from winchkit.effects.effect import Effect, parameter_name
from winchkit.quantity_text import PrintScale, grouped, quantity, significant, unbroken
from winchkit.report.detectability import has_typical_sizes, untestable, useful_candidates, visible
from winchkit.report.figures.waterfall import Waterfall
from winchkit.report.html.markup import Markup, details, element, formula, join, table
from winchkit.report.words.headline import noise_text, worst_outputs
from winchkit.report.words.sentence import capital
from winchkit.report.words.steps import ErrorFall, alike, doubt_texts, reported_steps, step_text
from winchkit.report.words.vocabulary import (
    clause,
    combination_text,
    error_scale,
    estimate_text,
    interval_text,
    listed,
    output_name,
    values_text,
)

_TOP = 10
"""Rows of a table that are open; the others are folded."""


def figures(diagnosis: Diagnosis) -> Markup:
    """Held-out error before and after, and noise, per output."""
    extended = bool(reported_steps(diagnosis))
    # The two bounds of a noise need the room of the last column.
    known = all(output.noise_upper is None for output in diagnosis.outputs.values())
    head = ["output", "today" if extended else "error"]
    head += ["with it"] if extended else []
    rows = []
    for name in worst_outputs(diagnosis.outputs):
        output = diagnosis.outputs[name]
        scale = error_scale(output)
        last = output.heldout_rms_after if extended else output.heldout_rms_before
        cells: list[str] = [output_name(name)]
        cells.append(element("span", scale.text(output.heldout_rms_before), class_="before"))
        if extended:
            cells.append(element("span", scale.text(last), class_="after"))
        noise = output.noise_rms
        cells.append(noise_text(output).removeprefix("noise "))
        most = "" if output.noise_upper is None else "≤ "
        cells.append(f"{most}{significant(last / noise, 2)}" if noise else "–")
        if known:
            cells.append(quantity(output.signal_rms, output.unit))
        rows.append(cells)
    data = next((output.heldout_on for output in diagnosis.outputs.values()), diagnosis.data)
    caption = f"Held-out error, rms: measured on {data} that the fit had not seen."
    last_head = ["measured"] if known else []
    return table(caption, [*head, "noise", "÷ noise", *last_head], rows)


def steps(diagnosis: Diagnosis, falls: Sequence[ErrorFall] = ()) -> Markup:
    """Every step that is reported, with its doubts; ``falls`` as in ``step_lines``."""
    known = dict(enumerate(falls))
    items = []
    for index in reported_steps(diagnosis):
        step = diagnosis.steps[index]
        doubts = [
            element("li", capital(text), class_="doubt")
            for text in doubt_texts(step, diagnosis.data)
        ]
        text = unbroken(capital(step_text(step, diagnosis.outputs, known.get(index))))
        items.append(element("li", text, *([element("ul", *doubts)] if doubts else [])))
    return element("ol", *items, class_="found") if items else Markup("")


def named(found: Iterable[tuple[Effect | None, str, Mapping[str, Estimate]]]) -> Markup:
    """Every named effect with its values, formula and source; these are empty if it is unknown."""
    entries: list[Markup] = []
    for effect, effect_id, estimates in found:
        values = [_sure(name, estimate) for name, estimate in estimates.items()]
        entries.append(element("dt", element("code", effect_id), " ", unbroken(", ".join(values))))
        if effect is not None:
            words = join([effect.what, " ", formula(effect.formula)])
            entries.append(element("dd", words, element("small", f"Source: {effect.source}")))
    return element("dl", *entries, class_="named") if entries else Markup("")


def _sure(name: str, estimate: Estimate) -> str:
    """A value with its standard deviation and, where it is known, its interval."""
    interval = interval_text(name, estimate)
    return estimate_text(name, estimate) + (f" ({interval})" if interval else "")


def waterfall(parts: Waterfall | None, diagnosis: Diagnosis) -> Markup:
    """Bars of held-out error per step beside the noise floor."""
    if parts is None:
        return Markup("")
    outputs = diagnosis.outputs
    longest = {name: 1.05 * _longest(parts, name, output) for name, output in outputs.items()}

    def row(label: str, errors: Mapping[str, float]) -> list[str]:
        return [
            label,
            *(bar(errors[n], longest[n], o.noise_rms, error_scale(o)) for n, o in outputs.items()),
        ]

    head = ["model", *(output_name(name) for name in outputs)]
    caption = "Held-out error, rms, after each added effect. The vertical mark is the noise."
    out = [table(caption, head, [row(label, errors) for label, errors in parts.steps])]
    if len(parts.first) > 1:
        alone = [row(f"only {name}", errors) for name, errors in parts.first.items()]
        without = [row(f"all but {name}", errors) for name, errors in parts.last.items()]
        caption = "Each effect added alone; and each removed, with all others kept."
        out.append(table(caption, head, [*alone, *without]))
    return join(out)


def _longest(parts: Waterfall, name: str, output: OutputFit) -> float:
    steps = (errors for _, errors in parts.steps)
    errors = [e[name] for e in chain(steps, parts.first.values(), parts.last.values())]
    return max([output.noise_rms or 0.0, *(e for e in errors if isfinite(e))])


def bar(
    error: float, longest: float, noise: float | None, scale: PrintScale, tone: str = ""
) -> Markup:
    """A bar as a share of the longest, with a mark at the noise, and the value below."""
    colour = f";background:var(--{tone})" if tone else ""
    inside = [element("span", class_="fill", style=f"width:{_part(error, longest)}%{colour}")]
    if noise:
        floor = f"left:{_part(noise, longest)}%"
        inside.append(element("span", class_="floor", style=floor))
    track = element("span", *inside, class_="track", aria_hidden="true")
    return join([track, element("span", scale.text(error), class_="value")])


def _part(value: float, full: float) -> str:
    share = 100 * value / full if full > 0 and isfinite(value) else 0.0
    return f"{min(max(share, 0.0), 100.0):.1f}"


def candidates(answer: Answer) -> Markup:
    """Every candidate effect, the highest evidence first."""
    diagnosis = answer.diagnosis
    ranked = useful_candidates(diagnosis)
    if not ranked:
        return Markup("")
    outputs = diagnosis.outputs
    scales = {name: error_scale(output) for name, output in outputs.items()}
    head = ["effect", "meaning", "evidence"]
    head += [f"{output_name(n)} [{scale.label}]" for n, scale in scales.items()]
    rows = [_candidate(candidate, scales) for candidate in ranked]
    caption = (
        "Evidence: reduction of χ² minus a penalty of ln n per parameter (BIC). 1 % false-alarm "
        f"threshold: {significant(max(answer.result.threshold, 0.0), 2)}. The held-out error is "
        "that with this effect alone, where it was fitted. Candidates that lower no error are left "
        "out."
    )
    return _shortened(caption, head, rows, "more, with lower evidence")


def _shortened(
    caption: str, head: Sequence[str], rows: Sequence[Sequence[str]], rest: str
) -> Markup:
    """A table of the first rows, and the others in a block to be opened."""
    top = table(caption, head, rows[:_TOP], words=2)
    if len(rows) <= _TOP:
        return top
    others = table("The remaining effects.", head, rows[_TOP:], words=2)
    return join([top, details(f"{len(rows) - _TOP} {rest}", others)])


def _times(share: float) -> str:
    """A size as a multiple of the typical one."""
    return f"{significant(share, 2)} ×" if isfinite(share) else "–"


def _candidate(candidate: CandidateScore, scales: Mapping[str, PrintScale]) -> list[str]:
    errors = [
        significant(candidate.heldout_rms[name] / scale.worth)
        if name in candidate.heldout_rms
        else "–"
        for name, scale in scales.items()
    ]
    name = element("code", candidate.effect)
    return [name, clause(candidate.effect), grouped(candidate.score), *errors]


def equivalence(diagnosis: Diagnosis, effects: Mapping[str, Effect]) -> Markup:
    """Equivalence sets, with the angles between the signatures of their effects."""
    out: list[Markup] = []
    for step in diagnosis.steps:
        if not alike(step):
            continue
        rows = []
        for effect_id, angle in {step.effects[0]: None, **alike(step)}.items():
            values = values_text(step.parameters.get(effect_id, {}))
            shown = "–" if angle is None else f"{degrees(angle):.1f}°"
            effect = effects.get(effect_id)
            distinguished = effect.told_apart if effect is not None else ""
            rows.append([element("code", effect_id), values, distinguished, shown])
        head = ["effect", "fitted values", "distinguished by", "angle"]
        caption = (
            f"Effects that cannot be distinguished with these {diagnosis.data}. The angle is that "
            "between the signatures of an effect and of the first one (–); at 0° they are "
            "proportional."
        )
        out.append(table(caption, head, rows, words=3))
        if step.combination is not None:
            text = combination_text(step.combination)
            out.append(element("p", f"Determined whichever of them is true: {text}."))
    return join(out)


def fit_of(diagnosis: Diagnosis) -> Markup:
    """Fit report of the reported model, correlations above 0.5, and determined combinations."""
    fit, out = diagnosis.fit, []
    if fit is None:
        return Markup("")
    out.append(element("pre", fit.text(), tabindex="0"))
    if fit.correlations:
        rows = [
            [element("code", pair.a), element("code", pair.b), significant(pair.value, 2)]
            for pair in fit.correlations
        ]
        caption = (
            "Correlations of fitted values above 0.5; the condition number of the fit is "
            f"{significant(fit.condition, 2)}."
        )
        out.append(table(caption, ["value", "with", "correlation"], rows, words=2))
    for step in diagnosis.steps:
        if step.combination is not None and len(step.effects) == 1:
            text = combination_text(step.combination)
            out.append(element("p", f"Best determined combination: {text}."))
    return join(out)


def detectable(answer: Answer) -> Markup:
    """Smallest detectable size of every effect."""
    compared = has_typical_sizes(answer)
    rows = [
        [
            element("code", row.effect),
            parameter_name(row.parameter),
            row.text,
            *([_times(row.share)] if compared else []),
        ]
        for row in visible(answer)
    ]
    if not rows:
        return Markup("")
    data = answer.diagnosis.data
    caption = f"Smallest size of each effect that is detectable with these {data} at 90 % power."
    head = ["effect", "parameter", "detectable", *(["of its typical size"] if compared else [])]
    seen = _shortened(caption, head, rows, "more, with larger detectable sizes")
    blind = [
        element("li", element("code", effect), f" needs {listed(needs)}")
        for effect, needs in untestable(answer)
    ]
    lost = details("Not tested: a part or a channel is missing", element("ul", *blind))
    return join([seen, lost]) if blind else seen

"""The verdict in plain words, the same in the report, at the terminal and in the demo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.results import Diagnosis, OutputFit, Step, Where
from winchkit.report.words.numbers import percent, quantity, significant
from winchkit.report.words.vocabulary import (
    OUTPUT_NAMES,
    VARIABLE_NAMES,
    clause,
    estimate_text,
    kind,
    listed,
)

__all__ = [
    "CLEAR_ORDER",
    "capital",
    "changes_text",
    "gain_text",
    "moved_outputs",
    "often_per_turn",
    "sentence",
    "still_text",
    "telling",
    "where_text",
    "worse_text",
]

_MOVED = 1.05
CLEAR_ORDER = 0.2
"""From which share on an order within a turn says more than a trend."""
_ABOVE = 1.5
_WHOLE = (
    "your robot's geometry is off as a whole: no few effects explain these poses as all of its "
    "points and radii together do"
)
_NO_GAIN = "Adding it leaves the held-out errors as they are."
_CHANGES = {
    "runs": {
        "more": "runs with other loads, strokes, speeds or temperatures",
        "one": "a run",
        "other": "a run with another load, stroke or speed",
    },
    "poses": {
        "more": "poses farther out, turned more, with other tensions, payloads or temperatures,",
        "one": "a set of poses",
        "other": "poses elsewhere, or under other tensions,",
    },
}
"""Other data, by what a diagnosis was made from."""
_CONSTANT = ("winch", "pose")
_COUNTS = {2: "Two", 3: "Three", 4: "Four", 5: "Five", 6: "Six"}


def sentence(diagnosis: Diagnosis) -> str:
    """The verdict with its figures, in one to four short sentences."""
    if diagnosis.verdict == "adequate":
        return _adequate(diagnosis)
    if diagnosis.steps:
        steps, outputs = diagnosis.steps, diagnosis.outputs
        gain = gain_text(outputs, f"{_do(steps)} and") or _NO_GAIN
        parts = [_named(steps, diagnosis.data), gain, still_text(outputs)]
        if diagnosis.verdict == "partly":
            parts.append(_rest(diagnosis, "Something else is still missing"))
        return " ".join(part for part in parts if part)
    if diagnosis.verdict == "partly":
        return _rest(diagnosis, "Something is missing, and known effects explain only part of it")
    return _rest(diagnosis, "Something is missing that no known effect explains")


def changes_text(diagnosis: Diagnosis) -> str:
    """What would change the verdict, in a sentence."""
    words = _CHANGES[diagnosis.data]
    if diagnosis.verdict == "adequate":
        return f"What would change this: {words['more']} in which the error rises above the noise."
    if not diagnosis.steps:
        return (
            "No name is given, because with so much left it would be a guess. What would change "
            "this: an effect of your own that explains the rest where it lives, or "
            f"{words['one']} that isolates it."
        )
    if any(len(step.effects) > 1 and not step.whole for step in diagnosis.steps):
        return (
            f"What would change this: {words['one']} in which the effects differ that these "
            f"{diagnosis.data} cannot tell apart."
        )
    return (
        f"What would change this: {words['other']} that the fitted values do not predict down "
        "to the noise."
    )


def where_text(where: Where) -> str:
    """Where a rest lives: ``cable length, 5 times per drum turn (46 % of its error)``."""
    output = OUTPUT_NAMES.get(where.output, where.output)
    if where.line is not None:
        on = "along" if where.output == "platform_position" else "of line"
        output = f"{output} {on} {where.line}"
    if where.variable == "winch":
        what = "the same at every pose" if where.line else "by a constant of each line"
        return f"{output}, {what} ({percent(where.share)} of all lines' error)"
    if where.variable == "pose":
        return f"{output}, alike on all lines of a pose ({percent(where.share)} of its error)"
    variable = VARIABLE_NAMES.get(where.variable, where.variable)
    if where.order is not None:
        often = often_per_turn(where.variable, where.order)
        return f"{output}, {often} ({percent(where.share)} of its error)"
    if where.frequency is not None:
        hertz = significant(where.frequency, 2)
        return f"{output}, around {hertz} Hz ({percent(where.share)} of all above the noise)"
    return f"{output}, following the {variable} ({percent(where.share)} of its error)"


def often_per_turn(angle: str, order: int) -> str:
    """``5 times per drum turn``."""
    turn = VARIABLE_NAMES.get(angle, angle).removesuffix(" angle")
    return f"{'once' if order == 1 else f'{order} times'} per {turn} turn"


def telling(places: Sequence[Where]) -> list[Where]:
    """Places with the most telling first, one per output.

    A clear order says more than a trend, and a trend more than a constant of a robot's line.
    """
    ranked = sorted(
        places,
        key=lambda w: (
            w.order is None or w.share < CLEAR_ORDER,
            w.variable in _CONSTANT,
            w.frequency is not None,
        ),
    )
    first: dict[str, Where] = {}
    for place in ranked:
        first.setdefault(place.output, place)
    return list(first.values())


def moved_outputs(outputs: Mapping[str, OutputFit]) -> list[str]:
    """Outputs whose held-out error fell noticeably, the largest fall first."""
    falls = {
        name: output.heldout_rms_before / output.heldout_rms_after
        for name, output in outputs.items()
        if output.heldout_rms_after > 0
    }
    return sorted((n for n, fall in falls.items() if fall > _MOVED), key=lambda n: -falls[n])


def gain_text(outputs: Mapping[str, OutputFit], opening: str) -> str:
    """``Add it and the held-out error of … falls from … to …``; empty where none falls."""
    moved = moved_outputs(outputs)
    if not moved:
        return ""
    if len(moved) == 1:
        output = outputs[moved[0]]
        error = f"the held-out error of the {OUTPUT_NAMES.get(moved[0], moved[0])}"
        return f"{opening} {error} {_fall(output)}{_beside(output)}."
    falls = [_in_one(name, outputs[name]) for name in moved]
    return f"{opening} the held-out error {listed(falls)}."


def worse_text(outputs: Mapping[str, OutputFit]) -> str:
    """Outputs whose held-out error rose; empty where none did."""
    rises = [
        f"of the {OUTPUT_NAMES.get(name, name)} "
        f"from {quantity(output.heldout_rms_before, output.unit)} "
        f"to {quantity(output.heldout_rms_after, output.unit)}"
        for name, output in outputs.items()
        if output.heldout_rms_after > _MOVED * output.heldout_rms_before
    ]
    return f"It raises the held-out error {listed(rises)}." if rises else ""


def still_text(outputs: Mapping[str, OutputFit]) -> str:
    """Outputs that stay well above their noise, which an explained error need not fall to."""
    above = {
        name: output.heldout_rms_after / output.noise_rms
        for name, output in outputs.items()
        if output.noise_rms
    }
    told = [
        f"the {OUTPUT_NAMES.get(name, name)} at {significant(ratio, 2)} times its noise"
        for name, ratio in above.items()
        if ratio > _ABOVE
    ]
    return f"That leaves {listed(told)}." if told else ""


def _adequate(diagnosis: Diagnosis) -> str:
    figures = []
    for name, output in diagnosis.outputs.items():
        figure = f"{OUTPUT_NAMES.get(name, name)} {quantity(output.heldout_rms_after, output.unit)}"
        if output.noise_rms is not None:
            figure += f" against {quantity(output.noise_rms, output.unit)}"
        figures.append(figure)
    errors = f"Held-out error against noise: {'; '.join(figures)}." if figures else ""
    if _from_repeats(diagnosis):
        return f"Nothing is missing above the noise. {errors}".strip()
    return (
        "No known effect is missing; without a repeated run an unknown one cannot be excluded. "
        f"{errors}"
    ).strip()


def _named(steps: tuple[Step, ...], data: str) -> str:
    if len(steps) == 1:
        return capital(_step(steps[0], data)) + "."
    count = _COUNTS.get(len(steps), str(len(steps)))
    numbered = [f"({n}) {_step(step, data, ' ({})')}" for n, step in enumerate(steps, start=1)]
    return f"{count} effects are missing: {'; '.join(numbered)}."


def _do(steps: Sequence[Step]) -> str:
    """What to do about what is missing."""
    if steps[0].whole:
        return "Calibrate" if len(steps) == 1 else "Calibrate, add the rest"
    if len(steps) > 1:
        return "Add them"
    return "Add one of them" if len(_kinds(steps[0])) > 1 else "Add it"


def _kinds(step: Step) -> list[list[str]]:
    """Effects of a set by kind, parsimonious ones first: a rope stretches by several laws."""
    kinds: dict[str, list[str]] = {}
    for effect in step.effects:
        kinds.setdefault(kind(effect), []).append(effect)
    return list(kinds.values())


def _step(step: Step, data: str, form: str = ": {}") -> str:
    if step.whole:
        return _WHOLE
    kinds = _kinds(step)
    if len(kinds) == 1:
        ((first, *others),) = kinds
        beside = f"these {data} cannot tell it from {listed(others)}" if others else ""
        return _with_values(step, first, form, beside, "; ")
    either = [
        _with_values(step, first, " ({})", f"or as {listed(others, 'or')}" if others else "", ", ")
        for first, *others in kinds
    ]
    return f"{listed(either, 'or')} – these {data} cannot tell which"


def _with_values(step: Step, effect: str, form: str, beside: str, link: str) -> str:
    """An effect in words with its values, and what is to be said beside them."""
    values = step.parameters.get(effect, {})
    told = ", ".join(estimate_text(name, value) for name, value in values.items())
    inside = link.join(part for part in (told, beside) if part)
    return clause(effect) + (form.format(inside) if inside else "")


def _fall(output: OutputFit) -> str:
    before = quantity(output.heldout_rms_before, output.unit)
    return f"falls from {before} to {quantity(output.heldout_rms_after, output.unit)}"


def _beside(output: OutputFit) -> str:
    if output.noise_rms is None:
        return ""
    known = output.noise_source == "repeats"
    what = "the instruments' noise" if known else "what no known effect explains"
    return f"; {what} is {quantity(output.noise_rms, output.unit)}"


def _in_one(name: str, output: OutputFit) -> str:
    text = f"of the {OUTPUT_NAMES.get(name, name)} {_fall(output)}"
    if output.noise_rms is None:
        return text
    return f"{text} (noise {quantity(output.noise_rms, output.unit)})"


def _rest(diagnosis: Diagnosis, opening: str) -> str:
    left = f"{percent(diagnosis.unexplained_share)} of what stood above the noise is left"
    places = [where_text(where) for where in telling(diagnosis.where)[:2]]
    lives = f" It lives in the {', and in the '.join(places)}." if places else ""
    return f"{opening}: {left}.{lives}"


def _from_repeats(diagnosis: Diagnosis) -> bool:
    return all(output.noise_source == "repeats" for output in diagnosis.outputs.values())


def capital(text: str) -> str:
    """With its first letter large."""
    return text[:1].upper() + text[1:]

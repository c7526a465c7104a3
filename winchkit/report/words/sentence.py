"""The verdict in sentences, the same on the page, at the terminal and in the demo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.data.sanity import ALARMING
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Diagnosis, OutputFit, Step
from winchkit.report.words.numbers import percent, quantity, significant
from winchkit.report.words.vocabulary import (
    OUTPUT_NAMES,
    VARIABLE_NAMES,
    clause,
    kind,
    listed,
    values_text,
)

__all__ = [
    "CLEAR_ORDER",
    "capital",
    "cause_and_error",
    "changes_text",
    "doubtful",
    "gain_text",
    "main_patterns",
    "moved_outputs",
    "often_per_turn",
    "sentence",
    "still_text",
    "where_text",
    "worse_text",
]

_MOVED = 1.05
"""Ratio of held-out errors before and after above which a sentence names the output: 5 % is seen in
two digits."""
CLEAR_ORDER = 0.2
"""Least share of the residual variance from which an order within a turn precedes a trend."""
_ABOVE = 1.5
"""Ratio of error to noise from which a sentence says that an output is above its noise."""
_WHOLE = (
    "the geometry of the robot differs as a whole: no small set of effects explains these poses as "
    "well as all points and radii together"
)
_NO_GAIN = "Adding it does not change the held-out errors."
_CHANGES = {
    "runs": {
        "more": "runs at other loads, strokes, speeds or temperatures",
        "one": "a run",
        "other": "a run at another load, stroke or speed",
    },
    "poses": {
        "more": "poses farther out or at other rotations, tensions, payloads or temperatures",
        "one": "a set of poses",
        "other": "poses at other positions or tensions",
    },
}
"""Further data that could change a verdict, by the kind of data of the diagnosis."""
_CONSTANT = ("winch", "pose")
_COUNTS = {2: "Two", 3: "Three", 4: "Four", 5: "Five", 6: "Six"}


def sentence(diagnosis: Diagnosis) -> str:
    """The verdict with its figures, in one to four short sentences.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of a winch or a robot.

    Returns
    -------
    str
        Plain text.
    """
    return " ".join(part for part in cause_and_error(diagnosis) if part)


def cause_and_error(diagnosis: Diagnosis) -> tuple[str, str]:
    """The sentence in two parts: the cause, and the error that it explains.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of a winch or a robot.

    Returns
    -------
    tuple of str
        The second is empty where the first has the figures.
    """
    if diagnosis.interrupted:
        text = "Interrupted before a verdict: errors of the profile, and candidates by evidence."
        return text, ""
    if diagnosis.verdict == "unknown" and (doubts := doubtful(diagnosis)):
        return doubts, ""
    if diagnosis.verdict == "adequate":
        return _adequate(diagnosis)
    if diagnosis.steps:
        steps, outputs = diagnosis.steps, diagnosis.outputs
        gain = gain_text(outputs, _opening(steps)) or _NO_GAIN
        parts = [gain, still_text(outputs)]
        if diagnosis.verdict == "partly":
            parts += [_unexplained(diagnosis, "Partly unexplained")]
        return _named(steps, diagnosis.data), " ".join(part for part in parts if part)
    if diagnosis.verdict == "partly":
        return _unexplained(diagnosis, "Partly unexplained"), ""
    return _unexplained(diagnosis, "Unexplained by any known effect"), ""


def changes_text(diagnosis: Diagnosis) -> str:
    """Further data that would change the verdict, in a sentence."""
    words = _CHANGES[diagnosis.data]
    if diagnosis.verdict == "adequate":
        return (
            f"This result would be refuted by {words['more']} with a residual above the noise "
            "floor."
        )
    if diagnosis.verdict == "unknown" and doubtful(diagnosis):
        return (
            f"This result would change with {words['one']} in the right unit and sign, or with the "
            "confirmation that these are right."
        )
    if not diagnosis.steps:
        return (
            "No effect is named, since a name would be a guess with so large a residual. This "
            "result would change with an effect of your own that explains the residual, or with "
            f"{words['one']} that isolates its cause."
        )
    if any(len(step.effects) > 1 and not step.whole for step in diagnosis.steps):
        return (
            f"This result would change with {words['one']} in which the effects differ that these "
            f"{diagnosis.data} cannot distinguish."
        )
    return (
        f"This result would be refuted by {words['other']} that the fitted model does not predict "
        "to within the noise floor."
    )


def where_text(where: Attribution) -> str:
    """Residual attribution: ``tension, 5 periods per drum turn (46 % of its variance)``."""
    output = OUTPUT_NAMES.get(where.output, where.output)
    if where.line is not None:
        on = "along" if where.output == "platform_position" else "of line"
        output = f"{output} {on} {where.line}"
    if where.variable == "winch":
        what = "constant over the poses" if where.line else "by a constant of each line"
        return f"{output}, {what} ({percent(where.share)} of the residual variance of all lines)"
    share = f"({percent(where.share)} of its residual variance)"
    if where.variable == "pose":
        return f"{output}, equal on all lines of a pose {share}"
    variable = VARIABLE_NAMES.get(where.variable, where.variable)
    if where.order is not None:
        return f"{output}, {often_per_turn(where.variable, where.order)} {share}"
    if where.frequency is not None:
        hertz = significant(where.frequency, 2)
        return f"{output}, around {hertz} Hz ({percent(where.share)} of the power above the noise)"
    return f"{output}, as a function of {variable} {share}"


def often_per_turn(angle: str, order: int) -> str:
    """``5 periods per drum turn``."""
    turn = VARIABLE_NAMES.get(angle, angle).removesuffix(" angle")
    return f"{order} period{'' if order == 1 else 's'} per {turn} turn"


def main_patterns(places: Sequence[Attribution]) -> list[Attribution]:
    """The most specific attribution of each output, the most specific output first.

    A clear order within a turn precedes a trend, and a trend a constant of a robot's line.
    """
    ranked = sorted(
        places,
        key=lambda w: (
            w.order is None or w.share < CLEAR_ORDER,
            w.variable in _CONSTANT,
            w.frequency is not None,
        ),
    )
    first: dict[str, Attribution] = {}
    for place in ranked:
        first.setdefault(place.output, place)
    return list(first.values())


def moved_outputs(outputs: Mapping[str, OutputFit]) -> list[str]:
    """Outputs whose held-out error fell by more than 5 %, the largest fall first."""
    falls = {
        name: output.heldout_rms_before / output.heldout_rms_after
        for name, output in outputs.items()
        if output.heldout_rms_after > 0
    }
    return sorted((n for n, fall in falls.items() if fall > _MOVED), key=lambda n: -falls[n])


def gain_text(outputs: Mapping[str, OutputFit], opening: str) -> str:
    """``With it, the held-out error of … falls from … to …``; empty where none falls."""
    moved = moved_outputs(outputs)
    if not moved:
        return ""
    if len(moved) == 1:
        output = outputs[moved[0]]
        error = f"the held-out error of the {OUTPUT_NAMES.get(moved[0], moved[0])}"
        return f"{opening}, {error} {_fall(output)}{_beside(output)}."
    falls = [_in_one(name, outputs[name]) for name in moved]
    return f"{opening}, the held-out error {listed(falls)}."


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
    """Outputs whose error remains well above their noise floor."""
    texts = _above_noise(outputs)
    return f"Still above the noise floor: {listed(texts)}." if texts else ""


def _above_noise(outputs: Mapping[str, OutputFit]) -> list[str]:
    """Outputs whose held-out error is well above the noise, with the factor."""
    above = {
        name: output.heldout_rms_after / output.noise_rms
        for name, output in outputs.items()
        if output.noise_rms
    }
    return [
        f"{OUTPUT_NAMES.get(name, name)} by a factor of {significant(ratio, 2)}"
        for name, ratio in above.items()
        if ratio > _ABOVE
    ]


def doubtful(diagnosis: Diagnosis) -> str:
    """Wrong signs and units, with which no effect is looked for; empty without any."""
    found = [f for f in diagnosis.sanity if f.code in ALARMING]
    texts = list(dict.fromkeys(f"{f.channel}: {f.text}" for f in found))
    return f"No effect is named with a wrong channel: {'; '.join(texts)}." if texts else ""


def _adequate(diagnosis: Diagnosis) -> tuple[str, str]:
    figures = []
    for name, output in diagnosis.outputs.items():
        figure = f"{OUTPUT_NAMES.get(name, name)} {quantity(output.heldout_rms_after, output.unit)}"
        if output.noise_rms is not None:
            figure += f" (noise {quantity(output.noise_rms, output.unit)})"
        figures.append(figure)
    errors = f"Held-out error: {'; '.join(figures)}." if figures else ""
    if _from_repeats(diagnosis):
        return "No effect is missing: the residual is at the noise floor.", errors
    known = "No known effect is missing; an unknown effect cannot be excluded without repeats."
    if above := _above_noise(diagnosis.outputs):
        known += (
            f" The held-out error is above the residual that all known effects together leave "
            f"({listed(above)}): these runs are too few or too short to name one."
        )
    return known, errors


def _named(steps: tuple[Step, ...], data: str) -> str:
    if len(steps) == 1:
        return capital(_step(steps[0], data)) + "."
    count = _COUNTS.get(len(steps), str(len(steps)))
    numbered = [f"({n}) {_step(step, data, ' ({})')}" for n, step in enumerate(steps, start=1)]
    return f"{count} effects are missing: {'; '.join(numbered)}."


def _opening(steps: Sequence[Step]) -> str:
    """Opening of the sentence on the errors with the missing effects added."""
    if steps[0].whole:
        return "After calibration" if len(steps) == 1 else "After calibration, with the others"
    if len(steps) > 1:
        return "With them"
    return "With one of them" if len(_kinds(steps[0])) > 1 else "With it"


def _kinds(step: Step) -> list[list[str]]:
    """Effects of a set by kind, parsimonious ones first: there are several laws of elongation."""
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
        beside = f"these {data} cannot distinguish it from {listed(others)}" if others else ""
        return _with_values(step, first, form, beside, "; ")
    either = [
        _with_values(step, first, " ({})", f"or as {listed(others, 'or')}" if others else "", ", ")
        for first, *others in kinds
    ]
    return f"{listed(either, 'or')} – these {data} cannot distinguish them"


def _with_values(step: Step, effect: str, form: str, beside: str, link: str) -> str:
    """An effect in words with its values and a remark."""
    values = step.parameters.get(effect, {})
    fitted = values_text(values)
    inside = link.join(part for part in (fitted, beside) if part)
    return clause(effect) + (form.format(inside) if inside else "")


def _fall(output: OutputFit) -> str:
    before = quantity(output.heldout_rms_before, output.unit)
    return f"falls from {before} to {quantity(output.heldout_rms_after, output.unit)}"


def _beside(output: OutputFit) -> str:
    if output.noise_rms is None:
        return ""
    known = output.noise_source == "repeats"
    what = "noise floor" if known else "residual that no known effect explains"
    return f"; the {what} is {quantity(output.noise_rms, output.unit)}"


def _in_one(name: str, output: OutputFit) -> str:
    text = f"of the {OUTPUT_NAMES.get(name, name)} {_fall(output)}"
    if output.noise_rms is None:
        return text
    return f"{text} (noise {quantity(output.noise_rms, output.unit)})"


def _unexplained(diagnosis: Diagnosis, opening: str) -> str:
    share = percent(diagnosis.unexplained_share)
    places = [where_text(where) for where in main_patterns(diagnosis.where)[:2]]
    plural = "s" if len(places) > 1 else ""
    pattern = f" Main pattern{plural}: {'; '.join(places)}." if places else ""
    return f"{opening}: {share} of the residual variance above the noise floor remains.{pattern}"


def _from_repeats(diagnosis: Diagnosis) -> bool:
    return all(output.noise_source == "repeats" for output in diagnosis.outputs.values())


def capital(text: str) -> str:
    """Text with a capital first letter."""
    return text[:1].upper() + text[1:]

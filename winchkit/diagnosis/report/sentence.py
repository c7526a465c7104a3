"""The verdict in plain words, the same in the report, at the terminal and in the demo."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.diagnosis.report.phrases import (
    OUTPUT_NAMES,
    VARIABLE_NAMES,
    clause,
    estimate_text,
    listed,
)
from winchkit.diagnosis.report.wording import percent, quantity, significant
from winchkit.diagnosis.result import Diagnosis, OutputFit, Step, Where

__all__ = ["moved_outputs", "sentence", "telling", "where_text"]

_MOVED = 1.05
_CLEAR = 0.2
_ABOVE = 1.5
_COUNTS = {2: "Two", 3: "Three", 4: "Four", 5: "Five", 6: "Six"}


def sentence(diagnosis: Diagnosis) -> str:
    """The verdict with its figures, in one to four short sentences."""
    if diagnosis.verdict == "adequate":
        return _adequate(diagnosis)
    if diagnosis.steps:
        parts = [_named(diagnosis.steps), _gain(diagnosis), _still(diagnosis)]
        if diagnosis.verdict == "partly":
            parts.append(_rest(diagnosis, "Something else is still missing"))
        return " ".join(part for part in parts if part)
    if diagnosis.verdict == "partly":
        return _rest(diagnosis, "Something is missing, and known effects explain only part of it")
    return _rest(diagnosis, "Something is missing that no known effect explains")


def where_text(where: Where) -> str:
    """Where a rest lives: ``cable length, 5 times per drum turn (46 % of its error)``."""
    output = OUTPUT_NAMES.get(where.output, where.output)
    variable = VARIABLE_NAMES.get(where.variable, where.variable)
    if where.order is not None:
        turn = variable.removesuffix(" angle")
        often = "once" if where.order == 1 else f"{where.order} times"
        return f"{output}, {often} per {turn} turn ({percent(where.share)} of its error)"
    if where.frequency is not None:
        hertz = significant(where.frequency, 2)
        return f"{output}, around {hertz} Hz ({percent(where.share)} of all above the noise)"
    return f"{output}, following the {variable} ({percent(where.share)} of its error)"


def telling(places: Sequence[Where]) -> list[Where]:
    """Places with the most telling first, one per output: a clear order says more than a trend."""
    ranked = sorted(
        places, key=lambda w: (w.order is None or w.share < _CLEAR, w.frequency is not None)
    )
    first: dict[str, Where] = {}
    for place in ranked:
        first.setdefault(place.output, place)
    return list(first.values())


def moved_outputs(diagnosis: Diagnosis) -> list[str]:
    """Outputs whose held-out error fell noticeably, the largest fall first."""
    falls = {
        name: output.heldout_rms_before / output.heldout_rms_after
        for name, output in diagnosis.outputs.items()
        if output.heldout_rms_after > 0
    }
    return sorted((n for n, fall in falls.items() if fall > _MOVED), key=lambda n: -falls[n])


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


def _named(steps: tuple[Step, ...]) -> str:
    if len(steps) == 1:
        return _capital(_step(steps[0])) + "."
    count = _COUNTS.get(len(steps), str(len(steps)))
    return f"{count} effects are missing: {listed([_step(step, ' ({})') for step in steps])}."


def _step(step: Step, form: str = ": {}") -> str:
    if len(step.effects) == 1:
        return _with_values(step, step.effects[0], form)
    either = listed([_with_values(step, effect, " ({})") for effect in step.effects], "or")
    return f"{either} – these runs cannot tell which"


def _with_values(step: Step, effect: str, form: str) -> str:
    values = step.parameters.get(effect, {})
    told = ", ".join(estimate_text(name, value) for name, value in values.items())
    return clause(effect) + (form.format(told) if told else "")


def _gain(diagnosis: Diagnosis) -> str:
    moved = moved_outputs(diagnosis)
    if not moved:
        return "Adding it leaves the held-out errors as they are."
    several = len(diagnosis.steps) > 1
    either = not several and len(diagnosis.steps[0].effects) > 1
    them = "them" if several else "one of them" if either else "it"
    if len(moved) == 1:
        output = diagnosis.outputs[moved[0]]
        error = f"the held-out error of the {OUTPUT_NAMES.get(moved[0], moved[0])}"
        return f"Add {them} and {error} {_fall(output)}{_beside(output)}."
    falls = [_in_one(name, diagnosis.outputs[name]) for name in moved]
    return f"Add {them} and the held-out error {listed(falls)}."


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


def _still(diagnosis: Diagnosis) -> str:
    """Outputs that stay well above their noise, which an explained error need not fall to."""
    above = {
        name: output.heldout_rms_after / output.noise_rms
        for name, output in diagnosis.outputs.items()
        if output.noise_rms
    }
    told = [
        f"the {OUTPUT_NAMES.get(name, name)} at {significant(ratio, 2)} times its noise"
        for name, ratio in above.items()
        if ratio > _ABOVE
    ]
    return f"That leaves {listed(told)}." if told else ""


def _rest(diagnosis: Diagnosis, opening: str) -> str:
    left = f"{percent(diagnosis.unexplained_share)} of what stood above the noise is left"
    places = [where_text(where) for where in telling(diagnosis.where)[:2]]
    lives = f" It lives in the {', and in the '.join(places)}." if places else ""
    return f"{opening}: {left}.{lives}"


def _from_repeats(diagnosis: Diagnosis) -> bool:
    return all(output.noise_source == "repeats" for output in diagnosis.outputs.values())


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]

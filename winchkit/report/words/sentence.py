"""The verdict in sentences, the same on the page, at the terminal and in the demo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan, pi

from winchkit.diagnosis.data.sanity import ALARMING, UNRELATED
from winchkit.diagnosis.design.programmes import ISOLATING
from winchkit.diagnosis.plan import WinchPlan
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.residuals.common_force import COMMON_FORCE
from winchkit.diagnosis.residuals.outlying_run import OUTLYING
from winchkit.diagnosis.results import Diagnosis, OutputFit
from winchkit.effects.effect import told_apart
from winchkit.quantity_text import percent, quantity, scale_for, significant
from winchkit.report.words.caveats import finding_texts
from winchkit.report.words.headline import AT_NOISE, noise_text, size_texts, worst_outputs
from winchkit.report.words.steps import (
    cause,
    kinds_of,
    named_only,
    needs_calibration,
    reported,
)
from winchkit.report.words.vocabulary import (
    OUTPUT_NAMES,
    clause,
    error_scale,
    listed,
    output_name,
    variable_name,
)

_MOVED = 1.05
"""Ratio of held-out errors before and after above which a sentence names the output: 5 % is seen in
two digits."""
CLEAR_ORDER = 0.2
"""Least share of the residual variance from which an order within a turn precedes a trend."""
_ABOVE = 1.5
"""Ratio of error to noise from which a sentence says that an output is above its noise."""
_TAKEN = 0.005
"""Share of the excess from which the text names its cause: half of the last digit of per cent."""
_MOST_VALUES = 3
"""Refitted values that are named."""
_NO_GAIN = "No held-out error changes."
_CHANGES = {
    "runs": ("other loads, strokes, speeds or temperatures", "another load, stroke or speed"),
    "poses": (
        "poses farther out or at other rotations, tensions, payloads or temperatures",
        "poses at other positions or tensions",
    ),
}
"""Further data that could refute an adequate model and an extended one, by the kind of data."""
_CONSTANT = ("winch", "pose")


def headline(diagnosis: Diagnosis) -> str:
    """The result in one line: ``The drum has runout``; without a full stop."""
    worst = OUTPUT_NAMES.get(next(iter(worst_outputs(diagnosis.outputs)), ""), "model")
    verdict, steps = diagnosis.verdict, reported(diagnosis).steps
    if diagnosis.interrupted:
        return "The search was interrupted before a verdict"
    if wrong_channels(diagnosis):
        return "A channel looks wrong: no effect was looked for"
    if verdict == "adequate":
        what = f"{'No' if _noise_is_known(diagnosis) else 'No known'} effect is missing"
        apart = list(dict.fromkeys(f.run for f in diagnosis.sanity if f.code == "outlying-repeat"))
        verb = "differs from its repeats and is" if len(apart) == 1 else "differ and are"
        return f"{what}, but {listed(apart)} {verb} left out" if apart else what
    if verdict == "undecided":
        what = f"The {worst} error" if not steps else f"What remains of the {worst} error"
        return f"{what} may be noise: these runs cannot decide"
    if verdict == "unknown":
        return _unknown_text(diagnosis, worst)
    return (
        capital(cause(steps, diagnosis.outputs))
        if steps
        else f"The {worst} error is explained in part"
    )


def _unknown_text(diagnosis: Diagnosis, worst: str) -> str:
    """Headline where known effects explain little, or nothing."""
    if lost := unrelated_outputs(diagnosis):
        names = listed([output_name(name) for name in lost])
        return f"The {names} {'does' if len(lost) == 1 else 'do'} not follow the motion"
    if reported(diagnosis).steps:
        return f"Known effects explain little of the {worst} error"
    return f"No known effect explains the {worst} error"


def sentence(diagnosis: Diagnosis) -> str:
    """The verdict with its figures, in one to four short sentences."""
    parts = [f"{headline(diagnosis)}.", error_text(diagnosis), remaining_text(diagnosis)]
    return " ".join(part for part in parts if part)


def error_text(diagnosis: Diagnosis) -> str:
    """Sentence on the held-out error that falls most with the steps, without any on the worst."""
    outputs, steps = diagnosis.outputs, reported(diagnosis).steps
    if diagnosis.interrupted:
        return ""
    if wrong := wrong_channels(diagnosis):
        return f"{'; '.join(wrong)}."
    if lost := unrelated_outputs(diagnosis):
        return _lost_text(outputs, lost)
    if not steps:
        name = next(iter(worst_outputs(outputs)), "")
        if not name:
            return ""
        is_named = output_name(name) in headline(diagnosis)
        subject = "It" if is_named else f"The {output_name(name)} error"
        return f"{subject} is {size_texts(outputs)[name]}."
    first, *others = steps
    count = 1 if first.whole else len(kinds_of(first))
    found = "it" if count == 1 else "either" if count == 2 else "any of them"
    opening = "With them" if others else f"With {found}"
    if others and len(small := named_only(steps, outputs)) == len(others):
        opening = f"With {found} and {len(small)} smaller effect{'s' if len(small) > 1 else ''}"
    if not others and all(is_wrong_value(effect) for effect in first.effects):
        opening = "Corrected" if count == 1 else f"With {found} corrected"
    if all(step.refitted for step in steps):
        opening = "Corrected"
    if diagnosis.verdict == "unknown":
        opening = f"With the effect{'s' if others else ''} found"
    return gain_text(outputs, opening, most=1) or _NO_GAIN


def unrelated_outputs(diagnosis: Diagnosis) -> list[str]:
    """Outputs that do not follow the motion, under the verdict ``unknown``; empty without any."""
    if diagnosis.verdict != "unknown":
        return []
    named = [finding.channel for finding in diagnosis.sanity if finding.code == UNRELATED]
    return [name for name in named if name in diagnosis.outputs]


def _lost_text(outputs: Mapping[str, OutputFit], lost: Sequence[str]) -> str:
    """``Repeats of the same motion differ by 0.135 N m rms, as much as it varies.``"""
    sizes = [quantity(outputs[name].noise_rms or 0.0, outputs[name].unit) for name in lost]
    varies = "it varies" if len(lost) == 1 else "they vary"
    return f"Repeats of the same motion differ by {listed(sizes)} rms, as much as {varies}."


def _refit_text(diagnosis: Diagnosis) -> str:
    """What lowers the error where no step does: other values of the profile, all together."""
    taken = 1.0 - diagnosis.unexplained_share
    if reported(diagnosis).steps or diagnosis.fit is None or not taken >= _TAKEN:
        return ""
    changed = []
    for one in diagnosis.fit.parameters:
        low, high = one.interval or (one.value - 2 * one.std, one.value + 2 * one.std)
        if "." in one.name and not low <= one.initial <= high:
            scale = scale_for((one.value, one.initial), one.unit)
            name, parameter = one.name.split(".", 1)
            new, old = scale.text(one.value), scale.text(one.initial)
            changed.append(f"{name} {parameter.replace('_', ' ')} {new} instead of {old}")
    values = f": {', '.join(changed[:_MOST_VALUES])}" if changed else ""
    return f"; refitted values of the profile take {percent(taken)}{values}"


def is_wrong_value(effect: str) -> bool:
    """Whether an effect is another value of something that the profile has already."""
    return clause(effect).endswith("is wrong")


def remaining_text(diagnosis: Diagnosis) -> str:
    """What remains unexplained, and where; empty where nothing is missing any more."""
    if diagnosis.verdict == "adequate" or diagnosis.interrupted or wrong_channels(diagnosis):
        return ""
    if diagnosis.verdict == "explained":
        return still_text(diagnosis.outputs)
    lost = unrelated_outputs(diagnosis)
    if lost and all(_at_noise(o) for name, o in diagnosis.outputs.items() if name not in lost):
        return ""
    share, parts = percent(diagnosis.unexplained_share), []
    if diagnosis.verdict != "undecided":
        parts.append(f"{share} of the error above the noise remains{_refit_text(diagnosis)}.")
    elif reported(diagnosis).steps:
        parts.append(f"At most {share} of the error above the noise remains.")
    if places := [where_text(where) for where in remaining_patterns(diagnosis)[:2]]:
        parts.append(f"Main pattern{'s' if len(places) > 1 else ''}: {'; '.join(places)}.")
    return " ".join(parts)


def changes_text(diagnosis: Diagnosis) -> str:
    """What to record or to do so that the result is confirmed, refuted or decided."""
    other, beyond = _CHANGES[diagnosis.data]
    if wrong := _instruments_text(diagnosis):
        return wrong
    if any(map(needs_calibration, reported(diagnosis).steps)) and diagnosis.verdict != "undecided":
        return "Calibrate the robot first: beside a wrong geometry an effect may imitate it."
    if diagnosis.verdict == "adequate":
        return f"To check: record {other}. An error above the noise there refutes this result."
    if diagnosis.next_runs:
        run = diagnosis.next_runs[0]
        power = "" if isnan(run.power) else f" (power {percent(run.power)})"
        how = run.programme.rstrip(".")
        return f"To decide{_between(run.separates)}: {how[:1].lower()}{how[1:]}{power}."
    rest = "the rest" if reported(diagnosis).steps else "it"
    return (
        f"To check: record {beyond}. If the new model misses it by more than the noise, this "
        "result is wrong."
        if diagnosis.verdict == "explained"
        else f"To explain {rest}: write an effect of your own, or record a run that isolates its "
        "cause."
    )


def _instruments_text(diagnosis: Diagnosis) -> str:
    """What to do where instruments are wrong, or agree with each other and not with the load."""
    if wrong_channels(diagnosis):
        return "Correct the channel by an import, or confirm that it is right."
    if lost := unrelated_outputs(diagnosis):
        names = listed([output_name(name) for name in lost])
        return (
            f"Check the instrument of the {names}, its wiring and its column in the file: no "
            "effect of the motion explains what differs between repeats."
        )
    outlying = [f for f in diagnosis.sanity if f.code == OUTLYING]
    if outlying:
        named = [f"{output_name(f.channel)} of {f.run}: {f.text}" for f in outlying]
        return f"{capital('; '.join(named))}."
    common = [f.text for f in diagnosis.sanity if f.code == COMMON_FORCE]
    return f"To explain the rest: {common[0]}." if common else ""


def _between(effects: Sequence[str]) -> str:
    return f" between {listed(list(effects))}" if effects else ""


def plan_texts(found: WinchPlan) -> list[str]:
    """What the first programme of a plan is for beside its powers, and what no programme shows."""
    texts, at = [], found.operating_range
    if found.isolates is not None:
        shows = ISOLATING[found.isolates.variable][1]
        texts.append(f"It isolates what no effect explains: {where_text(found.isolates)}. {shows}")
    for one, other in found.inseparable:
        what = told_apart(one.effect, other.effect)
        texts.append(
            f"No motion within {at.low:.2f} m to {at.high:.2f} m decides"
            f"{_between((one.effect.id, other.effect.id))}. What does: {what[:1].lower()}{what[1:]}"
        )
    if not texts and not found.pairs and not any(offer.shows for offer in found.offers):
        texts.append(
            f"No such motion within {at.low:.2f} m to {at.high:.2f} m shows an effect that these "
            "runs could not show; a longer stroke or a heavier load may."
        )
    return texts


def where_text(where: Attribution) -> str:
    """Residual attribution: ``tension, 5 periods per drum turn (46 % of its variance)``."""
    output = output_name(where.output)
    if where.line is not None:
        on = "along" if where.output == "platform_position" else "of line"
        output = f"{output} {on} {where.line}"
    if where.variable == "winch":
        what = "constant over the poses" if where.line else "by a constant of each line"
        return f"{output}, {what} ({percent(where.share)} of the residual variance of all lines)"
    share = f"({percent(where.share)} of its residual variance)"
    if where.variable == "pose":
        return f"{output}, equal on all lines of a pose {share}"
    variable = variable_name(where.variable)
    if where.order is not None:
        return f"{output}, {often_per_turn(where.variable, where.order)} {share}"
    if where.frequency is not None:
        hertz = significant(where.frequency, 2)
        return f"{output}, around {hertz} Hz ({percent(where.share)} of the power above the noise)"
    return f"{output}, as a function of {variable} {share}"


def often_per_turn(angle: str, order: int) -> str:
    """``5 periods per drum turn``; of a linear axis ``a period of 6.46 mm``."""
    if angle == "position":
        return f"a period of {quantity(2 * pi / order, 'm')}"
    turn = variable_name(angle).removesuffix(" angle")
    return f"{order} period{'' if order == 1 else 's'} per {turn} turn"


def main_patterns(places: Sequence[Attribution]) -> list[Attribution]:
    """The most specific attribution of each output, the most specific output first.

    A clear order within a turn precedes a trend, unless that explains more than twice as much: a
    bend has a part of every order. A trend precedes a constant of a robot's line.
    """
    trends: dict[str, float] = {}
    for place in places:
        if place.order is None and place.frequency is None:
            trends[place.output] = max(place.share, trends.get(place.output, 0.0))
    ranked = sorted(
        places,
        key=lambda w: (
            w.order is None or w.share < max(CLEAR_ORDER, trends.get(w.output, 0.0) / 2),
            w.variable in _CONSTANT,
            w.frequency is not None,
        ),
    )
    first: dict[str, Attribution] = {}
    for place in ranked:
        first.setdefault(place.output, place)
    return list(first.values())


def remaining_patterns(diagnosis: Diagnosis) -> list[Attribution]:
    """Main patterns of the outputs that are above their noise, of all where none is."""
    found = main_patterns(diagnosis.where)
    outputs = diagnosis.outputs
    return [w for w in found if w.output in outputs and not _at_noise(outputs[w.output])] or found


def _at_noise(output: OutputFit) -> bool:
    return output.heldout_rms_after < AT_NOISE * (output.noise_rms or 0.0)


def moved_outputs(outputs: Mapping[str, OutputFit]) -> list[str]:
    """Outputs whose held-out error fell by more than 5 %, the largest fall first."""
    falls = {
        name: output.heldout_rms_before / output.heldout_rms_after
        for name, output in outputs.items()
        if output.heldout_rms_after > 0
    }
    return sorted((n for n, fall in falls.items() if fall > _MOVED), key=lambda n: -falls[n])


def gain_text(outputs: Mapping[str, OutputFit], opening: str, most: int | None = None) -> str:
    """``With it, the … error falls from … to … (noise …)``; empty where none falls by 5 %."""
    falls = [
        f"the {output_name(name)} error falls {_change(outputs[name])} "
        f"({noise_text(outputs[name])})"
        for name in moved_outputs(outputs)[:most]
    ]
    return f"{opening}, {listed(falls)}." if falls else ""


def worse_text(outputs: Mapping[str, OutputFit]) -> str:
    """Outputs whose held-out error rose; empty where none did."""
    rises = [
        f"of the {output_name(name)} {_change(output)}"
        for name, output in outputs.items()
        if output.heldout_rms_after > _MOVED * output.heldout_rms_before
    ]
    return f"It raises the held-out error {listed(rises)}." if rises else ""


def _change(output: OutputFit) -> str:
    """``from 0.943 mm to 0.309 mm``."""
    scale = error_scale(output)
    return f"from {scale.text(output.heldout_rms_before)} to {scale.text(output.heldout_rms_after)}"


def still_text(outputs: Mapping[str, OutputFit]) -> str:
    """Outputs whose error remains well above their noise, with the factor."""
    ratios = {
        name: output.heldout_rms_after / output.noise_rms
        for name, output in outputs.items()
        if output.noise_rms and output.noise_upper is None
    }
    texts = [
        f"{output_name(name)} by a factor of {significant(ratio, 2)}"
        for name, ratio in ratios.items()
        if ratio > _ABOVE
    ]
    return f"Still above the noise: {listed(texts)}." if texts else ""


def wrong_channels(diagnosis: Diagnosis) -> list[str]:
    """Wrong signs and units, with which no effect is looked for; empty without any."""
    if diagnosis.verdict != "unknown" or diagnosis.steps:
        return []
    return finding_texts([f for f in diagnosis.sanity if f.code in ALARMING])


def _noise_is_known(diagnosis: Diagnosis) -> bool:
    """Whether repeats or instruments give the noise, instead of two bounds."""
    return all(output.noise_upper is None for output in diagnosis.outputs.values())


def capital(text: str) -> str:
    """Text with a capital first letter."""
    return text[:1].upper() + text[1:]

"""Steps of a diagnosis in words: effect, values, error before and after it, share, doubts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import degrees, inf, isfinite
from typing import TypeVar

from winchkit.diagnosis.regression.cross_validation import excess
from winchkit.diagnosis.results import Diagnosis, Estimate, OutputFit, Step
from winchkit.effects.transition import TRANSITION
from winchkit.quantity_text import percent, scale_for, significant, with_std
from winchkit.report.words.vocabulary import (
    clause,
    effect_name,
    error_scale,
    kind,
    listed,
    name_and_id,
    output_name,
    values_text,
    variable_name,
)

_DISTINCT = 20.0
"""Angle between two signatures from which the data distinguish them, °."""
_LOWERED = 1.01
"""Ratio of the errors before and after a step from which it lowers an output's error."""
_LEAST = 1e-3
"""Share below which no figure is shown."""
_TENTH = 0.1
"""Share of the excess of one output from which it is said; the tenth of the verdict."""
_MOST_KINDS = 3
"""Effects of a set that a title names."""
_WHOLE = "the geometry of the robot differs as a whole"
_HOME = "the home pose of the robot is not that of the profile"
_NEGLIGIBLE = 0.01
"""Share of the excess below which a refitted value that agrees with the file's is not reported, and
a doubtful effect is named only."""
_MAIN = 0.9
"""Share of the excess that the others explain where small effects are named only; that of
``explained``."""
_NORMAL_95 = 1.96
"""Standard deviations on each side of a 95 % interval, where none was computed."""
ErrorFall = tuple[Mapping[str, float], Mapping[str, float]]
"""Held-out errors by output before and after a step, SI."""
_D = TypeVar("_D", bound=Diagnosis)


def reported_steps(diagnosis: Diagnosis) -> list[int]:
    """Indices of the steps that are reported, what explains most first; robots' without a share
    before. Additions are in the order in which the model grows; one whose values are not determined
    ranks by what the others do not explain without it.

    A refitted effect of the profile that explains less than a hundredth, and whose values agree
    with those of the file, is left out unless it alone makes the verdict.
    """
    steps = diagnosis.steps
    ranks, least = [], inf
    for step in steps:
        if isfinite(step.explains):
            least = min(least, step.explains)
            loose = any(doubt.code == "undetermined" for doubt in step.doubts)
            ranks.append(min(least, step.share) if loose else least)
        else:
            ranks.append(step.share if isfinite(step.share) else inf)
    ranked = sorted(range(len(steps)), key=lambda i: -ranks[i])
    told = [i for i in ranked if not _is_negligible(steps[i])]
    return ranked if not told and diagnosis.verdict in {"explained", "partly"} else told


def reported(diagnosis: _D) -> _D:
    """A diagnosis with the steps that are reported, in their order; the JSON has all of them."""
    chosen = tuple(diagnosis.steps[index] for index in reported_steps(diagnosis))
    return diagnosis if chosen == diagnosis.steps else replace(diagnosis, steps=chosen)


def explained_share(step: Step) -> float:
    """Share of the excess that a step explains beside those before it, or else beside all."""
    return step.explains if isfinite(step.explains) else step.share


def _is_negligible(step: Step) -> bool:
    """Whether a step is a refit that changes next to nothing; its transition is a nuisance."""
    if not step.refitted or not step.share < _NEGLIGIBLE:
        return False
    values = step.parameters.get(step.effects[0], {})
    sizes = {n: e for n, e in values.items() if n in step.file_values and n != TRANSITION}
    return all(_agrees(estimate, step.file_values[name]) for name, estimate in sizes.items())


def named_only(steps: Sequence[Step], outputs: Mapping[str, OutputFit]) -> list[Step]:
    """Additions that are doubtful and explain less than a hundredth of the excess each, where the
    others explain nine tenths without them.

    One that explains more than all that is left in its outputs is none: beside a weight, friction
    is small.
    """
    noise = {name: output.noise_rms for name, output in outputs.items()}
    before = excess({name: output.heldout_rms_before for name, output in outputs.items()}, noise)
    left = {name: (outputs[name].heldout_rms_after / n) ** 2 for name, n in noise.items() if n}

    def least(step: Step) -> float:
        there = sum(left.get(name, 0.0) for name in {place.output for place in step.place})
        return min(_NEGLIGIBLE, there / before) if before else _NEGLIGIBLE

    small = [s for s in steps if not s.certain and not s.refitted and explained_share(s) < least(s)]
    main = sum(explained_share(step) for step in steps if step not in small)
    return small if main > _MAIN else []


def _agrees(estimate: Estimate, file_value: float) -> bool:
    """Whether the 95 % interval of a value holds that of the file."""
    half = _NORMAL_95 * estimate.std
    low, high = estimate.interval or (estimate.value - half, estimate.value + half)
    return low <= file_value <= high


def cause(steps: Sequence[Step], outputs: Mapping[str, OutputFit]) -> str:
    """What is missing, as the headline of a diagnosis with steps; without a full stop."""
    added = [step for step in steps if not step.refitted]
    refitted = [step for step in steps if step.refitted]
    count, parts = len(added) - len(named_only(steps, outputs)), []
    if added:
        first = step_title(added[0])
        parts.append(first if count <= 1 else f"{count} effects are missing; first, {first}")
    if refitted:
        first, many = step_title(refitted[0]), len(refitted)
        have = "effect of the profile has" if many == 1 else "effects of the profile have"
        others = f"{many} {have} other values"
        factors = [doubt.text for doubt in refitted[0].doubts if doubt.code == "factor"]
        if factors:
            # One number comes before the many that it replaces.
            parts.insert(0, f"{factors[0].partition(' explains')[0]}, or {others}")
        elif not steps[0].refitted:
            parts.append(others)
        else:
            parts.insert(0, first if many == 1 else f"{others}; first, {first}")
    return "; ".join(parts)


def step_title(step: Step) -> str:
    """``the cable is elastic or the frame is compliant``."""
    if step.whole:
        return _WHOLE
    if step.refitted:
        changed = f"{_refitted_values(step, with_errors=False)} in the profile"
        of_reversal = changed.startswith(_REVERSAL)
        return f"{effect_name(step.effects[0])}: {changed}" if of_reversal else changed
    if needs_calibration(step):
        return f"{_HOME}, or {listed([clause(effect) for effect in kinds_of(step)], 'or')}"
    if has_other_law(step):
        return f"{_open_law(step)}; closest: {clause(step.effects[0])}"
    kinds = kinds_of(step)
    if len(kinds) > _MOST_KINDS:
        return f"one of {len(kinds)} effects is missing, which these data cannot distinguish"
    return listed([clause(effect) for effect in kinds], "or")


def needs_calibration(step: Step) -> bool:
    """Whether it is a robot's geometry, or may be its home pose."""
    return step.whole or any(doubt.code == "home" for doubt in step.doubts)


def has_other_law(step: Step) -> bool:
    """Whether a free curve explains more than its law."""
    return step.law == "open" and (
        len(step.effects) == 1 or any(doubt.code == "curve" for doubt in step.doubts)
    )


def step_text(
    step: Step, outputs: Mapping[str, OutputFit] | None = None, fall: ErrorFall | None = None
) -> str:
    """A step in one line: title, values, error of the output that it lowers most, and share.

    ``the cable is elastic: EA = 289.9 ± 6.0 kN; cable length 0.943 → 0.309 mm; explains 99 %``.
    Beside an output that is thousands of times its noise off, any share of all is small: the share
    of the excess of that one output is said where it is a tenth and that of all is no figure.
    """
    parts, there = [_titled_values(step)], 0.0
    if outputs and fall and (name := lowered_most(fall)):
        before, after = fall
        scale = error_scale(outputs[name])
        was = significant(before[name] / scale.worth)
        parts.append(f"{output_name(name)} {was} → {scale.text(after[name])}")
        first, noise = outputs[name].heldout_rms_before, {name: outputs[name].noise_rms}
        whole, *left = (excess({name: e}, noise) for e in (first, before[name], after[name]))
        there = (left[0] - left[1]) / whole if whole else 0.0
    share = explained_share(step)
    if share < _LEAST and there >= _TENTH:
        parts.append(f"explains {percent(min(1.0, there))} of its excess, {percent(share)} of all")
    elif isfinite(share):
        parts.append(f"explains {percent(share) if share >= _LEAST else 'under 0.1 %'}")
    return "; ".join(parts)


def lowered_most(fall: ErrorFall) -> str:
    """Output whose error a step lowers most; empty where it lowers none by 1 %."""
    before, after = fall
    ratios = {name: error / after[name] for name, error in before.items() if after.get(name)}
    best = max(ratios, key=ratios.__getitem__, default="")
    return best if best and ratios[best] >= _LOWERED else ""


def doubt_texts(step: Step, data: str = "runs") -> list[str]:
    """Doubts of a step in words; those of a set name its members by how they differ."""
    out = []
    for doubt in step.doubts:
        out += _alternatives(step, data) if doubt.code == "alternatives" else [doubt.text]
    return out


def alike(step: Step) -> dict[str, float]:
    """Members of a set that the data cannot distinguish from the first, with the angle, rad."""
    if step.whole:
        return {}
    angles = {effect: step.angles.get(effect, 0.0) for effect in step.effects[1:]}
    return {effect: a for effect, a in angles.items() if degrees(a) <= _DISTINCT}


def _alternatives(step: Step, data: str) -> list[str]:
    equal = alike(step)
    same = [name_and_id(effect) for effect in equal]
    others = [name_and_id(effect) for effect in step.effects[1:] if effect not in equal]
    out = [f"these {data} cannot distinguish it from {listed(same)}"] if same else []
    if others:
        out.append(f"these {data} are explained as well by {listed(others)}, in another way")
    return out


def _titled_values(step: Step) -> str:
    if step.whole:
        return _WHOLE
    if step.refitted:
        changed = _refitted_values(step, with_errors=True)
        return f"{effect_name(step.effects[0])}: {changed} in the profile"
    if needs_calibration(step):
        return step_title(step)
    values = {e: values_text(step.parameters.get(e, {})) for e in kinds_of(step)}
    if has_other_law(step) or len(values) == 1:
        return ": ".join(part for part in (step_title(step), values[step.effects[0]]) if part)
    return listed([f"{clause(e)} ({v})" if v else clause(e) for e, v in values.items()], "or")


def kinds_of(step: Step) -> list[str]:
    """First effect of every kind of a set: there are several laws of elongation."""
    first: dict[str, str] = {}
    for effect in step.effects:
        first.setdefault(kind(effect), effect)
    return list(first.values())


_REVERSAL = "its reversal is rounded over"
"""Of a friction; begins the change of a transition."""


def _refitted_values(step: Step, *, with_errors: bool) -> str:
    """``axial stiffness 300 kN instead of 100 kN``; values that print alike only where all do."""
    out, alike = list[str](), list[str]()
    for name, estimate in step.parameters.get(step.effects[0], {}).items():
        if name not in step.file_values:
            continue
        old = step.file_values[name]
        scale = scale_for((estimate.value, old), estimate.unit)
        std = estimate.std if with_errors else float("nan")
        new = with_std(estimate.value, std, estimate.unit, scale)
        is_sharp = name == TRANSITION and old == 0.0
        before, what = ("sharp", _REVERSAL) if is_sharp else (scale.text(old), name)
        changed = f"{what.replace('_', ' ')} {new} instead of {before}"
        (alike if scale.text(estimate.value) == scale.text(old) else out).append(changed)
    return listed(out or alike)


def _open_law(step: Step) -> str:
    """``the motor changes the motor torque over the speed by an unknown law``."""
    if not step.place:
        return "the law is unknown"
    outputs = list(dict.fromkeys(output_name(p.output) for p in step.place))
    part, variable = step.place[0].part, step.place[0].variable
    variable = step.curve or (variable and variable_name(variable))
    over = f" over the {variable}" if variable else ""
    return f"the {part} changes the {listed(outputs)}{over} by an unknown law"

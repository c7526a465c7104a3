"""The result in one short line, as a page shows it first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.results import Comparison, Diagnosis, OutputError, OutputFit, Step
from winchkit.report.words.numbers import quantity, significant
from winchkit.report.words.sentence import capital, doubtful
from winchkit.report.words.vocabulary import OUTPUT_NAMES, clause, kind, listed

__all__ = ["at_noise", "comparison_headline", "headline", "size_texts", "worst_outputs"]

AT_NOISE = 1.15
"""Largest ratio of an error to its noise at which it counts as noise."""


def headline(diagnosis: Diagnosis) -> str:
    """``The drum has runout``; without a full stop.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of a winch or a robot.

    Returns
    -------
    str
        Plain text.
    """
    worst = OUTPUT_NAMES.get(next(iter(worst_outputs(diagnosis.outputs)), ""), "model")
    if diagnosis.interrupted:
        return "The search was interrupted before a verdict"
    if diagnosis.verdict == "unknown" and doubtful(diagnosis):
        return "A channel looks wrong: no effect is named"
    if diagnosis.verdict == "adequate":
        known = all(o.noise_source == "repeats" for o in diagnosis.outputs.values())
        return f"{'No' if known else 'No known'} effect is missing"
    if diagnosis.steps:
        return _missing(diagnosis.steps)
    if diagnosis.verdict == "partly":
        return f"Known effects explain the {worst} error in part, and none is named"
    return f"No known effect explains the {worst} error"


def _missing(steps: Sequence[Step]) -> str:
    if len(steps) > 1:
        cause = "the geometry differs as a whole" if steps[0].whole else clause(steps[0].effects[0])
        return f"{len(steps)} effects are missing; first, {cause}"
    (step,) = steps
    if step.whole:
        return "The geometry of the robot differs as a whole"
    kinds = list(dict.fromkeys(kind(effect) for effect in step.effects))
    return capital(listed(kinds, "or")) if len(kinds) < 3 else _one_of(len(kinds))


def _one_of(count: int) -> str:
    return f"One of {count} effects is missing, which these data cannot distinguish"


def comparison_headline(comparison: Comparison) -> str:
    """``The motor torque error is 2.1 times its noise``; without a full stop."""
    outputs = comparison.outputs
    if not outputs:
        return "No output was compared"
    name = worst_outputs(outputs)[0]
    error, words = outputs[name], OUTPUT_NAMES.get(name, name)
    if error.noise_rms is None:
        return f"The {words} error is {quantity(error.rms, error.unit)} rms; its noise is unknown"
    if all(at_noise(one) for one in outputs.values()):
        return "Every error is at its noise"
    ratio = significant(error.rms / error.noise_rms, 2) if error.noise_rms else "∞"
    return f"The {words} error is {ratio} times its noise"


def at_noise(error: OutputError) -> bool:
    """Whether an error is at most 1.15 times its noise."""
    return error.noise_rms is not None and error.rms < AT_NOISE * error.noise_rms


def worst_outputs(outputs: Mapping[str, OutputError] | Mapping[str, OutputFit]) -> list[str]:
    """Outputs by error over noise, else over signal where one noise is unknown; largest first."""
    known = all(output.noise_rms for output in outputs.values())

    def ratio(name: str) -> float:
        output = outputs[name]
        base = output.noise_rms if known else output.signal_rms
        return _error(output) / base if base else 0.0

    return sorted(outputs, key=lambda name: -ratio(name))


def size_texts(outputs: Mapping[str, OutputError] | Mapping[str, OutputFit]) -> dict[str, str]:
    """``0.785 mm rms, 2.8 times its noise of 0.281 mm``, by output."""
    out = {}
    for name, output in outputs.items():
        size, noise = _error(output), output.noise_rms
        text = f"{quantity(size, output.unit)} rms"
        if noise:
            above = size >= AT_NOISE * noise
            times = f"{significant(size / noise, 2)} times" if above else "about"
            text += f", {times} its noise of {quantity(noise, output.unit)}"
        out[name] = text
    return out


def _error(output: OutputError | OutputFit) -> float:
    return output.rms if isinstance(output, OutputError) else output.heldout_rms_before

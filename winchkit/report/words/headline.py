"""Errors of outputs in words, the worst first, and the headline of a comparison."""

from __future__ import annotations

from collections.abc import Mapping

from winchkit.diagnosis.results import Comparison, OutputError, OutputFit
from winchkit.quantity_text import quantity, significant
from winchkit.report.words.vocabulary import error_scale, output_name

AT_NOISE = 1.15
"""Largest ratio of an error to its noise at which it counts as noise."""


def comparison_headline(comparison: Comparison) -> str:
    """``The motor torque error is 2.1 times its noise``; without a full stop."""
    outputs = comparison.outputs
    if not outputs:
        return "No output was compared"
    name = worst_outputs(outputs)[0]
    error, words = outputs[name], output_name(name)
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
        if isinstance(output, OutputFit) and output.noise_upper is not None:
            text += f", {noise_text(output)}"
        elif noise:
            above = size >= AT_NOISE * noise
            times = f"{significant(size / noise, 2)} times" if above else "about"
            text += f", {times} its noise of {quantity(noise, output.unit)}"
        out[name] = text
    return out


def noise_text(output: OutputFit) -> str:
    """``noise 0.304 mm``; its two bounds where neither repeats nor instruments give it."""
    if output.noise_rms is None:
        return "noise unknown"
    scale = error_scale(output)
    return f"noise {scale.span(output.noise_rms, output.noise_upper)}"


def _error(output: OutputError | OutputFit) -> float:
    return output.rms if isinstance(output, OutputError) else output.heldout_rms_before

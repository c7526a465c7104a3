"""Rounding errors of a run's instruments in its outputs: of the output itself, and of an input.

The rounding error of a measured load or tension, times the derivative of the prediction by the
force, is an error of the prediction, and equal motions share it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset, Recording
from winchkit.model.line import Line, Motion
from winchkit.runs.sanity.local_noise import local_noise
from winchkit.runs.sanity.rounding import mean_error, noise_before_rounding

_WINDOW = 25
"""Samples of a moving mean: it leaves a fifth of the noise and follows a motion."""


@dataclass(frozen=True)
class RoundingError:
    """Error of an output by the rounding of one instrument."""

    components: Array
    """Cosine, then sine components of the mean error's harmonics, (2 × harmonics, n)."""
    white: float
    """Variance of the rest of the output's own error; zero of an input, whose rest is in the
    differences of repeats."""


def instrument_noise(
    recordings: Sequence[Recording], resolution: Mapping[str, float]
) -> dict[str, float]:
    """Standard deviation of the noise before the rounding, SI, per rounded channel.

    It is that of the mean variance of the runs: a constant load in mid-step shows no noise.
    """
    out = {}
    for name, step in resolution.items():
        if not step:
            continue
        found = [both for each in recordings if (both := _measured_and_signal(each, name))]
        after = [min(local_noise(shown), local_noise(shown - signal)) for shown, signal in found]
        if after:
            out[name] = noise_before_rounding(float(np.sqrt(np.mean(np.square(after)))), step)
    return out


def rounding_errors(
    dataset: Dataset,
    run: int,
    output: str,
    noise: Mapping[str, float],
    change: Array | None = None,
) -> Iterator[RoundingError]:
    """Rounding errors in an output of a run, from the noise of the channels before their rounding.

    They are functions of the whole signal, ``change`` by effects included, (n,), SI.
    """
    recording, resolution = dataset.recordings[run], dataset.resolution
    predicted = recording.nominal_smooth[output]
    if output in noise:
        if change is None:
            rest = np.nan_to_num(recording.measured[output] - predicted)
            change = uniform_filter1d(rest, _WINDOW, mode="nearest")
        signal = predicted + change
        yield RoundingError(*mean_error(signal, resolution[output], noise[output]))
    motion = recording.smooth
    name = "tension" if motion.load is None else "load"
    if name not in noise or output == "cable_length":
        return
    step = resolution[name]
    changed = Line(dataset.profile).predict(_with_force(motion, step))[output]
    by_force = (changed - predicted) / step
    components, _ = mean_error(_force(motion), step, noise[name])
    yield RoundingError(by_force * components, 0.0)


def _measured_and_signal(recording: Recording, name: str) -> tuple[Array, Array] | None:
    """Samples of an output or of a measured force, and their prediction without noise."""
    if name in recording.measured:
        return recording.measured[name], recording.nominal_smooth[name]
    signals = recording.signals
    force = {"load": signals.load, "tension": signals.tension}.get(name)
    return None if force is None else (force, _force(recording.smooth))


def _force(motion: Motion) -> Array:
    force = motion.load if motion.load is not None else motion.drum_tension
    return np.zeros_like(motion.at.time) if force is None else force


def _with_force(motion: Motion, added: float) -> Motion:
    """The motion with a larger load, or a larger tension where no load is known."""
    at = replace(motion.at, tension=motion.at.tension + added)
    if motion.load is not None:
        return replace(motion, at=at, load=motion.load + added)
    return replace(motion, at=at, drum_tension=_force(motion) + added)

"""Rounding errors of a run's instruments in its outputs: of the output itself, and of an input.

A measured load or tension is an input of what is predicted from it: its rounding error, times the
derivative of the prediction by the force, is an error of the prediction, and equal motions share
it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.data.rounding import mean_error, noise_before_rounding
from winchkit.model.line import Line, Motion
from winchkit.runs.sanity.local_noise import local_noise
from winchkit.schema.profiles.winch import WinchProfile

__all__ = ["RoundingError", "rounding_errors"]


@dataclass(frozen=True)
class RoundingError:
    """Error of an output by the rounding of one instrument.

    Attributes
    ----------
    instrument : str
        Channel that is rounded; the zero of its steps is the same in all runs.
    components : ndarray of shape (2 × harmonics, n)
        Cosine, then sine components of the harmonics of the mean error, see
        :func:`~winchkit.diagnosis.data.rounding.mean_error`, at the samples of the run.
    white : float
        Variance of the rest of the output's own error. Of an input it is zero: that of repeats is
        in their differences.
    """

    instrument: str
    components: Array
    white: float


def rounding_errors(
    profile: WinchProfile, recording: Recording, output: str, resolution: Mapping[str, float]
) -> Iterator[RoundingError]:
    """Rounding errors in an output of a run.

    Parameters
    ----------
    profile : WinchProfile
        Of the winch.
    recording : Recording
        The run.
    output : str
        Measured and predicted output.
    resolution : mapping of str to float
        Resolution by channel, SI; none is known of a channel that is missing or zero.
    """
    predicted = recording.nominal_smooth[output]
    if step := resolution.get(output, 0.0):
        yield RoundingError(output, *_mean_error(recording.measured[output], predicted, step))
    motion, signals = recording.smooth, recording.signals
    is_known = motion.load is not None
    name, measured = ("load", signals.load) if is_known else ("tension", signals.tension)
    step = resolution.get(name, 0.0)
    if measured is None or not step or output == "cable_length":
        return
    changed = Line(profile).predict(_with_force(motion, step))[output]
    by_force = (changed - predicted) / step
    components, _ = _mean_error(measured, _force(motion), step)
    yield RoundingError(name, by_force * components, 0.0)


def _mean_error(measured: Array, signal: Array, step: float) -> tuple[Array, float]:
    after = min(local_noise(measured), local_noise(measured - signal))
    return mean_error(signal, step, noise_before_rounding(after, step))


def _force(motion: Motion) -> Array:
    force = motion.load if motion.load is not None else motion.drum_tension
    return np.zeros_like(motion.at.time) if force is None else force


def _with_force(motion: Motion, added: float) -> Motion:
    """The motion with a larger load, or a larger tension where no load is known."""
    at = replace(motion.at, tension=motion.at.tension + added)
    if motion.load is not None:
        return replace(motion, at=at, load=motion.load + added)
    return replace(motion, at=at, drum_tension=_force(motion) + added)

"""Discretisation error: change of the effects on a motion interpolated between the samples.

On a four times finer time grid, interpolated by cubic splines, the velocities, accelerations and
hysteresis branches differ slightly from those of the samples. Which are right depends on the motion
between the samples, so the whole difference is a possible error of fitted values and residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset, Recording
from winchkit.diagnosis.data.spectrum import to_frequency
from winchkit.diagnosis.regression.base import Regression, Segment
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis, started
from winchkit.diagnosis.regression.projection import partialled_out
from winchkit.effects.term import modifiers_of
from winchkit.model.line import Line, Motion
from winchkit.model.stages import Signals

_FINER = 4
"""Intervals into which a sampling interval is divided; theory: differences have an error in the
square of the interval, of which 1/16 is left."""
_REACH = 28
"""Samples after which the filter of the cubic spline ends; numerical: (2 − √3)²⁸ = 10⁻¹⁶."""
_LEAST_SAMPLES = 2 * _REACH
"""Samples of a run below which no discretisation error is computed; numerical: the ends of the
filter must not overlap."""


def discretization_error(
    dataset: Dataset, segments: Sequence[Segment], hypothesis: Hypothesis
) -> Array:
    """Change of the effects' outputs on a finer time grid minus that on the samples, (n_rows,)."""
    out = np.zeros(segments[-1].rows.stop)
    if not hypothesis.terms:
        return out
    moved = [
        _changes(Line(dataset.profile, modifiers_of(started(hypothesis, run))), recording)
        for run, recording in enumerate(dataset.recordings)
    ]
    for segment in segments:
        recording = dataset.recordings[segment.run]
        valid = recording.valid[segment.output]
        signal = moved[segment.run].get(segment.output)
        if signal is not None:
            out[segment.rows] = to_frequency(np.where(valid, signal, 0.0), segment.band)
    return out


def without_discretization_error(regression: Regression, fit: Fit, inverse_sigma: Array) -> Array:
    """Residual minus the share, from zero to one, that the discretisation error explains."""
    column = regression.discretization_error(fit.hypothesis)
    across = _beside(fit.jacobian * inverse_sigma[:, None], column * inverse_sigma)
    size = float(across @ across)
    if not size:
        return fit.residual
    share = float(np.clip(across @ (fit.residual * inverse_sigma) / size, 0.0, 1.0))
    return fit.residual - share * across / inverse_sigma


def _beside(present: Array, column: Array) -> Array:
    """Column with the present ones partialled out; zero where only rounding errors remain."""
    left = partialled_out(present, column)
    return np.zeros_like(left) if left @ left <= 1e-12 * float(column @ column) else left


def _changes(line: Line, recording: Recording) -> dict[str, Array]:
    """Change of each output with a finer motion, at the samples of one run."""
    fine = _fine_motion(recording, line)
    if fine is None:
        return {}
    nominal = Line(line.profile).predict(fine)
    after, before = line.predict(fine), line.predict(recording.smooth)
    return {
        output: (after[output] - nominal[output])[::_FINER]
        - (before[output] - recording.nominal_smooth[output])
        for output in recording.measured
    }


def _fine_motion(recording: Recording, line: Line) -> Motion | None:
    """Denoised motion of a run, interpolated between its samples.

    None where the derivatives are not differences of these samples, but precede a decimation, are
    the drive's own velocity, which has less noise, or are those of a smoothing spline.
    """
    signals, smooth, clock = recording.signals, recording.smooth, recording.raw.clock
    if recording.decimated or clock.measured_rate is not None or clock.smoother is not None:
        return None
    count = len(signals.time)
    if count < _LEAST_SAMPLES:
        return None
    here = np.arange(count, dtype=float)
    there = np.arange(_FINER * (count - 1) + 1) / _FINER
    between = interpolated
    time, angle = np.interp(there, here, signals.time), between(signals.motor_angle)
    finer = line.motion(Signals(time, angle, payload=signals.payload, rate_noise=clock.rate_noise))
    at = replace(
        finer.at,
        tension=between(smooth.at.tension + _force_correction(recording, line)),
        temperature=np.interp(there, here, smooth.at.temperature),
        motor_torque=np.interp(there, here, smooth.at.motor_torque),
        predicted_torque=None
        if smooth.at.predicted_torque is None
        else between(smooth.at.predicted_torque),
        reads_cell=smooth.at.reads_cell,
    )
    load = None if smooth.load is None else at.tension
    drum_side = None if smooth.drum_tension is None else between(smooth.drum_tension)
    return replace(finer, at=at, load=load, drum_tension=drum_side, load_mass=smooth.load_mass)


def interpolated(values: Array) -> Array:
    """Cubic spline of even samples, 56 at least, with not-a-knot ends, at four times the rate.

    The second derivatives M of a spline through values y at unit spacing satisfy M[i−1] + 4 M[i] +
    M[i+1] = 6 δ²y[i]; the inverse of this recurrence is the filter z^|k|/√12 with z = √3 − 2
    (Unser, Aldroubi & Eden 1993), whose value after 28 samples is 10⁻¹⁶. At a not-a-knot end M is
    δ²y itself, which adds a multiple of the solution z^k of the homogeneous recurrence.
    """
    pole = np.sqrt(3.0) - 2.0
    kernel = pole ** np.abs(np.arange(-_REACH, _REACH + 1)) / np.sqrt(12.0)
    second = np.diff(values, 2)
    inner = np.convolve(6 * second[1:-1], kernel)[_REACH - 1 : len(second) - 1 + _REACH]
    decay = pole ** np.arange(_REACH)
    inner[:_REACH] += (second[0] - inner[0]) * decay
    inner[-_REACH:] += (second[-1] - inner[-1]) * decay[::-1]
    bend = np.concatenate([[2 * inner[0] - inner[1]], inner, [2 * inner[-1] - inner[-2]]])
    out = np.empty(_FINER * (len(values) - 1) + 1)
    out[::_FINER] = values
    for part in range(1, _FINER):
        after = part / _FINER
        before = 1 - after
        out[part::_FINER] = (
            before * values[:-1]
            + after * values[1:]
            + (before**3 - before) / 6 * bend[:-1]
            + (after**3 - after) / 6 * bend[1:]
        )
    return out


def _force_correction(recording: Recording, line: Line) -> Array:
    """Force lost by second differences over the span h, (n,): that of x is x″ + h²/12 · x⁗.

    Only the part proportional to the acceleration of the cable is corrected, as of a hanging
    weight.
    """
    signals, tension = recording.signals, recording.smooth.at.tension
    hanging = line.motion(replace(signals, load=None, tension=None, load_mass=1.0))
    assert hanging.load is not None
    assert hanging.discretization is not None
    unit_force = hanging.load - hanging.load.mean()
    size = float(unit_force @ unit_force)
    mass = float(unit_force @ tension) / size if size else 0.0
    return -mass * hanging.discretization / 12

"""Noise of the torque that drives a simulated motion: its spectrum, and draws of it.

A simulation integrates errors of the measured torque twice, over the whole run: errors of the
simulated motion are as long as the run, and samples or parts of it are no repeats. The torque's own
errors are short: what the model leaves of the torque along the measured motion is taken as
stationary noise, whose variances per band of a cosine transform (orthonormal DCT-II) are estimated.
What other values of the effects would explain is taken out before, since those of the motion are
not those of the torque; the lowest band is wide beside their number, and divided by its degrees of
freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import dct, idct

from winchkit.arrays import Array
from winchkit.dynamics.forward import Setup
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

_LOWEST = 4
"""Coefficients of the lowest band for each fitted value, which takes a quarter of it at most; 8 at
least. Each further band is an octave (rule of thumb)."""
_DIRECTED = 0.95
"""Expected sign of the motion below which the torque of a sample is not judged: near a reversal and
at rest friction is not known by the motion."""


def torque_left(
    profile: WinchProfile, terms: Sequence[Term], setup: Setup, angle: Array, clock: SamplingTimes
) -> Array:
    """Measured torque of a setup without the predicted one of the measured motion, (n,), N m: a
    straight line over reversals and standstills."""
    inputs = setup.inputs.signals
    is_axis = isinstance(profile, AxisProfile)
    signals = Signals(
        setup.time,
        angle,
        load=inputs.get("load"),
        load_mass=None if is_axis else setup.load_mass,
        motor_torque=inputs["torque"],
        payload=setup.load_mass if is_axis else None,
        clock=clock,
    )
    line = Line(profile, modifiers_of(terms))
    motion = line.motion(signals)
    left = inputs["torque"] - line.predict(motion)["motor_torque"]
    way = motion.at.motor_direction
    turns = np.append(way[1:] * way[:-1] <= 0.0, False)
    unknown = (np.abs(way) <= _DIRECTED) | turns | np.roll(turns, 1) | ~np.isfinite(left)
    near = np.ones(2 * clock.reach + 1)  # On which an acceleration depends.
    known = np.convolve(unknown, near, mode="same") < 0.5
    if not known.any():
        return np.zeros_like(left)
    return np.interp(setup.time, setup.time[known], left[known])


def spectrum(left: Array, seen: Array, fitted: int) -> Array:
    """Standard deviation of each coefficient of the cosine transform of noise, (n,), of which
    ``fitted`` values explain a part; ``seen`` is noise that other instruments add, (n,)."""
    power = np.asarray(dct(left, type=2, norm="ortho")) ** 2
    power -= np.asarray(dct(seen, type=2, norm="ortho")) ** 2
    begin, end, out = 0, max(_LOWEST * fitted, 8), np.empty(len(power))
    while begin < len(power):
        band = power[begin:end]
        dof = len(band) - (fitted if begin == 0 else 0)
        out[begin:end] = np.sum(band) / max(dof, 1)
        begin, end = end, 2 * end
    return np.sqrt(np.maximum(out, 0.0))


def noisy(setup: Setup, spread: Array, random: np.random.Generator) -> Setup:
    """A setup under another noise of its torque, with the deviations of :func:`spectrum`."""
    noise = idct(spread * random.standard_normal(len(spread)), type=2, norm="ortho")
    signals = setup.inputs.signals
    torque = signals["torque"] + noise
    return replace(setup, inputs=replace(setup.inputs, signals={**signals, "torque": torque}))

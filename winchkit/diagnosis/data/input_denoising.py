"""Denoising of measured inputs (errors in variables), on which changes by effects are evaluated.

An input's own noise acts like a lag or a hysteresis. A Wiener filter per frequency band keeps what
repeats share; without repeats what another instrument shares (the tension with the torque, the load
with the tension), or, where there is none, what exceeds the white noise floor.

References
----------
Fuller, W. A. (1987). Measurement Error Models. Wiley.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct

from winchkit.arrays import Array
from winchkit.diagnosis.data.repeats import Repeats
from winchkit.diagnosis.data.spectrum import band_edges
from winchkit.model.line import Line, Motion
from winchkit.model.stages import Signals

_FLOOR_SHARE = 1 / 3
"""Share of the highest frequencies whose mean power is taken for white noise; screened."""


def contrasts(aligned: Array) -> tuple[Array, Array]:
    """Mean part of m repeats, (m, ...), and their Helmert contrasts, (m − 1, ...).

    The mean part is the sum over √m, a contrast (x₁ + … + x_j − j x_{j+1}) / √(j (j + 1)):
    orthogonal to each other, and each with the variance of one repeat's noise.
    """
    m = len(aligned)
    mean = aligned.sum(axis=0) / np.sqrt(m)
    differences = [
        (aligned[:j].sum(axis=0) - j * aligned[j]) / np.sqrt(j * (j + 1)) for j in range(1, m)
    ]
    return mean, np.array(differences).reshape(m - 1, *aligned.shape[1:])


def wiener_filtered(signal: Array) -> Array:
    """Remove white noise by a Wiener gain per band, the noise floor from the highest third."""
    full = np.asarray(dct(signal, type=2, norm="ortho"))
    power = full**2
    highest_third = power[int(len(power) * (1 - _FLOOR_SHARE)) :]
    floor = float(np.mean(highest_third)) if len(highest_third) else 0.0
    return _band_filtered(full, power, np.full_like(power, floor))


def shared_by_instruments(signal: Array, other: Array) -> Array:
    """Part of a signal that another instrument of the same quantity, in the same unit, shows too.

    Each band is scaled by the cross power of both over the signal's own: the Wiener gain, since the
    noise of the two is independent (instrumental variable).
    """
    own, beside = (np.asarray(dct(x, type=2, norm="ortho")) for x in (signal, other))
    return _band_filtered(own, own**2, own**2 - own * beside, beside**2)


def shared_by_repeats(signals: Sequence[Array], rows: Sequence[NDArray[np.intp]]) -> list[Array]:
    """Part of each signal that its repeats share, on its own samples; zero outside the overlap.

    Only the mean of the other repeats is used: the signal's own noise is in the prediction too, and
    a remainder of it would be taken for a lag or a hysteresis.
    """
    if len(signals) < 2:
        return [wiener_filtered(signal) for signal in signals]
    aligned = np.array([signal[index] for signal, index in zip(signals, rows, strict=True)])
    _, differences = contrasts(aligned)
    noise = np.mean(np.asarray(dct(differences, type=2, norm="ortho", axis=1)) ** 2, axis=0)
    out = []
    for own, (signal, index) in enumerate(zip(signals, rows, strict=True)):
        others, _ = contrasts(np.delete(aligned, own, axis=0))
        full = np.asarray(dct(others, type=2, norm="ortho"))
        denoised = np.zeros_like(signal)
        denoised[index] = _band_filtered(full, full**2, noise) / np.sqrt(len(signals) - 1)
        out.append(denoised)
    return out


def _band_filtered(full: Array, power: Array, noise: Array, other: Array | None = None) -> Array:
    """Inverse transform with each band scaled by the share of its power that is not noise, or by
    that of the cross power with ``other``."""
    edges = band_edges(np.arange(len(full), dtype=float), 1)
    gain = np.ones_like(full)
    for low, high in pairwise(edges):
        inside = slice(
            0 if low == -np.inf else int(np.ceil(low)),
            len(full) if high == np.inf else int(np.ceil(high)),
        )
        total = float(np.sum(power[inside]))
        share = 1 - float(np.sum(noise[inside])) / total if total > 0 else 0.0
        # A ratio of two sums of n squares has a standard deviation of 2/√n: two of them are noise.
        # A cross power of independent signals over the power of one: √(ratio of their powers/n).
        deviation = 2 / np.sqrt(inside.stop - inside.start)
        if other is not None and total > 0:
            deviation *= float(np.sqrt(np.sum(other[inside]) / total)) / 2
        gain[inside] = min(share, 1.0) if share > min(2 * deviation, 0.9) else 0.0
    gain[0] = 1.0
    return np.asarray(idct(full * gain, type=2, norm="ortho"))


def denoised_motions(
    line: Line, signals: Sequence[Signals], motions: Sequence[Motion], repeats: Sequence[Repeats]
) -> list[Motion]:
    """Motions with denoised cable force, motor torque and temperature, one per run.

    The acceleration of the cable and a measured torque become the part that repeats share. A
    measured force becomes its regression on that acceleration plus the part of the remainder that
    repeats, or two instruments, share. The force of a known weight follows the acceleration alone;
    on a winch at rest it is used as it is, since a filter would smooth its steps. The error of
    finite differences in the acceleration is estimated from a measured force; with a known weight
    it is a nuisance parameter of the fit.
    """
    out = list(motions)
    for group in repeats:
        own = [signals[index] for index in group.runs]
        if not any(np.ptp(s.motor_angle) for s in own):
            for index in group.runs:
                out[index] = _at_rest(motions[index], signals[index])
            continue
        units = [_unit_weight(line, s) for s in own]
        unit_force = _denoised([load for load, _ in units], group)
        discretization = _denoised([discretization for _, discretization in units], group)
        regressors = [
            np.column_stack(pair) for pair in zip(unit_force, discretization, strict=True)
        ]
        for index, force, r in zip(
            group.runs, _forces(line, own, regressors, group), discretization, strict=True
        ):
            out[index] = _with(out[index], force, r, signals[index].temperature)
        torques = [s.motor_torque for s in own if s.motor_torque is not None]
        if len(torques) == len(own):
            for index, torque in zip(group.runs, _denoised(torques, group), strict=True):
                out[index] = replace(out[index], at=replace(out[index].at, motor_torque=torque))
    return out


def _at_rest(motion: Motion, signals: Signals) -> Motion:
    if signals.temperature is None:
        return motion
    return replace(motion, at=replace(motion.at, temperature=wiener_filtered(signals.temperature)))


def _unit_weight(line: Line, signals: Signals) -> tuple[Array, Array]:
    """Force of one kilogram, m/s², and its correction for finite differences."""
    motion = line.motion(replace(signals, load=None, tension=None, load_mass=1.0))
    assert motion.load is not None
    assert motion.discretization is not None
    return motion.load, motion.discretization


def _denoised(values: Sequence[Array], group: Repeats) -> list[Array]:
    """Part that repeats share plus the mean; outside of the overlap the run's own, denoised."""
    centred = [value - value.mean() for value in values]
    out = []
    for value, own, denoised, rows in zip(
        values, centred, shared_by_repeats(centred, group.rows), group.rows, strict=True
    ):
        without_repeats = np.ones(len(own), dtype=bool)
        without_repeats[rows] = False
        if without_repeats.any():
            denoised[without_repeats] = wiener_filtered(own)[without_repeats]
        out.append(denoised + value.mean())
    return out


def _forces(
    line: Line, signals: Sequence[Signals], regressors: Sequence[Array], group: Repeats
) -> list[Array | None]:
    """Denoised cable force of every run, None where it is not known; ``regressors`` (n, 2) are the
    force of a unit weight and its correction for finite differences."""
    measured = [s.load if s.load is not None else s.tension for s in signals]
    known = [s.load_mass if s.load is None else None for s in signals]
    if all(mass is not None for mass in known):
        pairs = zip(known, regressors, strict=True)
        return [mass * pulled[:, 0] for mass, pulled in pairs if mass is not None]
    values = [value for value in measured if value is not None]
    if len(values) < len(signals):
        return [None] * len(signals)
    regressed = [_regressed_force(v, f) for v, f in zip(values, regressors, strict=True)]
    remainders = [v - f for v, f in zip(values, regressed, strict=True)]
    other = _other_force(line, signals[0]) if len(signals) == 1 else None
    if other is not None:
        beside = other - _regressed_force(other, regressors[0])
        shared = [shared_by_instruments(remainders[0], beside)]
    else:
        shared = shared_by_repeats(remainders, group.rows)
    return [f + r for f, r in zip(regressed, shared, strict=True)]


def _other_force(line: Line, signals: Signals) -> Array | None:
    """Cable force by another instrument than the one that is the load; None where there is none."""
    if signals.load is not None and signals.tension is not None:
        return signals.tension
    if signals.motor_torque is None:
        return None
    motion = line.motion(signals)
    return np.asarray(signals.motor_torque / line.kinematics(motion.at).arm)


def _regressed_force(force: Array, regressors: Array) -> Array:
    """Regression of a force on a constant and on the acceleration of the cable."""
    columns = np.column_stack([np.ones_like(force), regressors - regressors.mean(axis=0)])
    return np.asarray(columns @ np.linalg.lstsq(columns, force, rcond=None)[0])


def _with(
    motion: Motion, force: Array | None, discretization: Array, temperature: Array | None
) -> Motion:
    """A motion with denoised inputs; ``discretization`` is the correction of a unit weight."""
    at = motion.at
    if temperature is not None:
        at = replace(at, temperature=wiener_filtered(temperature))
    if force is None:
        return replace(motion, at=at)
    return replace(
        motion,
        at=replace(at, tension=force),
        load=None if motion.load is None else force,
        drum_tension=None if motion.drum_tension is None else force,
        discretization=None if motion.load_mass is None else motion.load_mass * discretization,
    )

"""Ratio of an angle to the integral of a velocity: it determines units, counts and the sign.

The angle is compared with the integral of the velocity, which quantisation and jitter of the stamps
change less than they change a derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array

__all__ = ["Ratio", "likely_counts", "ratio_of"]

_CLEAR = 0.98
"""Least correlation of angle and integral at which their ratio is used."""
_TOLERANCE = 0.02
_TURN = 2 * math.pi


@dataclass(frozen=True)
class Ratio:
    """Angle over the integral of the velocity, in the numbers of the file."""

    value: float
    """Negative for opposite senses."""
    correlation: float

    def agrees(self, expected: float) -> bool:
        """Whether the magnitude is the expected one, to 2 %."""
        return abs(abs(self.value) / expected - 1) < _TOLERANCE


def ratio_of(time: Array, angle: Array, velocity: Array) -> Ratio | None:
    """Ratio of the change of an angle to the integral of a velocity.

    Parameters
    ----------
    time : (n,) array
        Any unit.
    angle, velocity : (n,) array
        Any units; NaN where missing.

    Returns
    -------
    Ratio, optional
        None where the two are not proportional (correlation below 0.98) or constant.

    Notes
    -----
    With I = ∫ v dt, the ratio is Σ (a − ā)(I − Ī) / Σ (I − Ī)².
    """
    known = np.isfinite(time) & np.isfinite(angle) & np.isfinite(velocity)
    if np.count_nonzero(known) < 8:
        return None
    t, a, v = time[known], angle[known], velocity[known]
    steps = np.diff(t)
    if np.any(steps < 0):
        return None
    integral = np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * steps)))
    a, integral = a - a.mean(), integral - integral.mean()
    norm = float(np.sqrt(np.sum(a**2) * np.sum(integral**2)))
    if norm == 0 or not math.isfinite(norm):
        return None
    correlation = float(np.sum(a * integral)) / norm
    if abs(correlation) < _CLEAR:
        return None
    return Ratio(float(np.sum(a * integral) / np.sum(integral**2)), correlation)


def likely_counts(estimate: float) -> int | None:
    """Usual resolution of an encoder that an estimate of counts per turn stands for, or None.

    Parameters
    ----------
    estimate : float
        Counts per turn.

    Returns
    -------
    int, optional
        A power of two, or four times a usual number of lines, within 0.5 %; None where there is
        none or more than one.
    """
    lines = (100, 200, 250, 256, 360, 400, 500, 512, 600, 720, 900, 1000, 1024, 1250, 1500, 1800)
    more = (2000, 2048, 2500, 3600, 4000, 4096, 5000, 6400, 8192, 9000, 10_000)
    usual = {2**n for n in range(8, 25)} | {4 * n for n in (*lines, *more)}
    usual |= {360, 3600, 36_000, 360_000, 1000, 10_000, 100_000, 1_000_000}
    near = [n for n in usual if abs(estimate / n - 1) < 0.005]
    return near[0] if len(near) == 1 else None

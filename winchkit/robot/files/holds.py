"""Holds in a log of a robot: stretches of rows in which no winch moves beyond its noise.

A run of poses has a row per pose; a log has rows in time, of which some are at rest. The noise of a
motor angle is estimated from the log itself, by quartiles of its first and third differences: third
differences remove a smooth motion, first differences are noise alone where most rows are at rest,
and the smaller estimate is less affected by motion. A hold is a maximal stretch in which every
winch stays within

    |θ − mean θ| ≤ z σ,      z = Φ⁻¹(1 − α / 2N)

of N angles in all (Bonferroni), or within two swings where an angle swings back and forth by a
count or so, as a servo at rest does. Rows are poses already where consecutive angles differ as much
as angles do in general: then σ is of the size of their spread and no stretch is looked for.

References
----------
J. von Neumann, *Distribution of the Ratio of the Mean Square Successive Difference to the
Variance*, Ann. Math. Statist. 12, 1941.
"""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist

import numpy as np

from winchkit.arrays import Array

_LEVEL = 0.01
"""Probability that noise alone ends a hold anywhere in the log."""
_LEAST_ROWS = 5
"""Least rows of a hold: a reversal passes through zero speed in fewer (rule of thumb)."""
_LEAST_SHARE = 0.25
"""Least rows of a hold as a share of the median hold's (rule of thumb): a reversal of a fast log
is at rest for some rows too."""
_MOST_NOISE = 0.05
"""Largest noise of an angle, in its spread, in a log: rows that are poses have a ratio near one."""
_QUARTILE = 0.25
"""Lower quartile of absolute differences: up to three quarters of the samples may move."""
_SHORT_SWING, _FEWEST_SWINGS = 2, 3
"""Changes of a swing that is noise (one, or two where a log interpolates between instants), and
their least number (rules of thumb)."""
_ROUNDING = 1e-9
"""Relative to the largest angle: far above rounding of floating point (1e-16), below a count."""
_OF_NORMAL = 0.31864
"""Lower quartile of |x| of a standard normal x."""
_THIRD = sqrt(20.0)
"""Standard deviation of third differences of white noise, in that of the noise."""


def holds_of(angle: Array) -> list[slice] | None:
    """Stretches at rest of all winches by motor angles (p, n) in the order of time; None where the
    rows are no log, but a pose each."""
    found = _tolerance(angle)
    if found is None:
        return None
    stretches = [s for s in _stretches(angle, found) if s.stop - s.start >= _LEAST_ROWS]
    if not stretches:
        return None
    least = _LEAST_SHARE * float(np.median([s.stop - s.start for s in stretches]))
    return [s for s in stretches if s.stop - s.start >= least]


def is_log(angle: Array) -> bool:
    """Whether rows are samples of a motion, whose noise is far below its spread."""
    return _tolerance(angle) is not None


def _tolerance(angle: Array) -> Array | None:
    """Largest deviation of each angle at rest, (n,), rad; None where rows are poses."""
    count = int(np.count_nonzero(np.isfinite(angle)))
    if len(angle) < 2 * _LEAST_ROWS or not count:
        return None
    width = NormalDist().inv_cdf(1 - _LEVEL / (2 * count))
    sigma, step = np.zeros(angle.shape[1]), np.zeros(angle.shape[1])
    some = angle[:, np.any(np.isfinite(angle), axis=0)]
    largest = float(np.max(np.nanmax(some, axis=0) - np.nanmin(some, axis=0)))
    moves = False
    for line, values in enumerate(angle.T):
        known = values[np.isfinite(values)]
        if len(known) < 2 * _LEAST_ROWS:
            continue
        first, third = np.abs(np.diff(known)), np.abs(np.diff(known, 3))
        step[line] = _swing(np.diff(known), _MOST_NOISE * largest)
        sigma[line] = min(
            float(np.quantile(first, _QUARTILE)) / (_OF_NORMAL * sqrt(2.0)),
            float(np.quantile(third, _QUARTILE)) / (_OF_NORMAL * _THIRD),
        )
        spread = float(np.std(known))
        if sigma[line] < _MOST_NOISE * spread:
            moves = True
        elif spread > max(sigma[line], step[line]) * width:
            return None
    rounding = _ROUNDING * np.nanmax(np.abs(angle), axis=0, initial=1e-9)
    return np.maximum.reduce([width * sigma, 2 * step, rounding]) if moves else None


def _swing(change: Array, most: float) -> float:
    """Median swing below ``most`` of an angle at rest between two turning points, rad, zero where
    it has none; those of a motion have more than two changes."""
    change = change[change != 0]
    if not len(change):
        return 0.0
    turns = np.flatnonzero(change[1:] * change[:-1] < 0) + 1
    starts = np.concatenate([[0], turns])
    swings = np.abs(np.add.reduceat(change, starts))
    length = np.diff([*starts, len(change)])
    short = swings[(length <= _SHORT_SWING) & (swings < most)]
    return float(np.median(short)) if len(short) >= _FEWEST_SWINGS else 0.0


def _stretches(angle: Array, tolerance: Array) -> list[slice]:
    """Maximal stretches, from the start, within the tolerance of their running mean."""
    out, begin = [], 0
    total, known = np.zeros(angle.shape[1]), np.zeros(angle.shape[1])
    for row, values in enumerate(angle):
        there = np.isfinite(values)
        mean = np.divide(total, known, out=np.where(there, values, 0.0), where=known > 0)
        if np.any(np.abs(values[there] - mean[there]) > tolerance[there]):
            out.append(slice(begin, row))
            begin, total, known = row, np.zeros_like(total), np.zeros_like(known)
        total[there] += values[there]
        known[there] += 1
    return [*out, slice(begin, len(angle))]


def averaged(values: Array, holds: list[slice], *, angles: bool = False) -> Array:
    """Means over holds of what was measured, (h, …); NaN where nothing was."""
    out = np.full((len(holds), *values.shape[1:]), np.nan)
    for number, rows in enumerate(holds):
        own = values[rows]
        known = np.isfinite(own)
        some = known.any(axis=0)
        if angles:
            mean = np.angle(np.where(known, np.exp(1j * np.nan_to_num(own)), 0.0).sum(axis=0))
        else:
            mean = np.where(known, own, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        out[number] = np.where(some, mean, np.nan)
    return out

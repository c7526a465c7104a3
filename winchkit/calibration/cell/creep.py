"""Creep in the readings of a calibration: a change with the logarithm of the time since each load.

After a change of load ΔL at the time t_k the reading changes by c ΔL ln((t − t_k)/1 min)/ln 30, so
that c is the creep between 1 and 30 minutes as a share of the change of load, which OIML R 60 and
data sheets state; the changes of all loads add up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array
from winchkit.calibration.cell.fit import FigureOfMerit
from winchkit.schema.calibration import CalibrationPoint

_ONE_MINUTE, _MINUTES = 60.0, 30.0
_FEWEST = 8
"""Readings more than there are loads, from which the scatter of a creep is known to a quarter."""


def creep_shape(points: Sequence[CalibrationPoint], times: Sequence[float]) -> Array:
    """Change of each reading, N, for a creep of the whole change of load, (n,).

    ``times``: s, increasing. A load changes in the middle between two readings.
    """
    load, time = np.array([point.load for point in points]), np.array(times)
    changes, middles = np.diff(load), (time[1:] + time[:-1]) / 2
    since = time[:, None] - middles
    past = since > 0
    logarithm = np.log(np.where(past, since, 1.0) / _ONE_MINUTE) / math.log(_MINUTES)
    return np.asarray(np.where(past, logarithm, 0.0) @ changes)


def creep_within(
    points: Sequence[CalibrationPoint], shape: Array, stretches: Sequence[list[int]]
) -> FigureOfMerit:
    """Creep by readings that follow each other at one load, whose level is free; NaN without."""
    unknown = FigureOfMerit(math.nan, math.nan)
    load, reading = np.array([(point.load, point.indicated) for point in points]).T
    slope = float(np.cov(load, reading)[0, 1] / np.var(load, ddof=1)) if np.ptp(load) else 0.0
    if not slope:
        return unknown
    reading = reading / slope
    parts = [(shape[own] - shape[own].mean(), reading[own]) for own in stretches]
    x = np.concatenate([part for part, _ in parts])
    y = np.concatenate([own - own.mean() for _, own in parts])
    free = len(x) - len(parts) - 1
    square = float(x @ x)
    if free < _FEWEST or not square:
        return unknown
    value = float(x @ y) / square
    left = y - value * x
    return FigureOfMerit(value, math.sqrt(float(left @ left) / free / square))

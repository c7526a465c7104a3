"""Consistency of a motor's velocity with its angle: the integral of one is the other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from winchkit.runs.run import Run
from winchkit.runs.sanity.factors import Slope, named_factor, slope_text
from winchkit.runs.sanity.finding import Finding

__all__ = ["velocity_consistency"]

_RANGE = 0.8, 1.25
"""Slopes that are no wrong unit: a velocity that its drive has filtered or estimated."""
_SIGMAS = 3.0
"""Standard deviations by which a slope must be outside the range."""
_BLOCKS = 40
_LEAST_SAMPLES = 50
_CORRELATION = 0.5
_GAP = 2.5


def velocity_consistency(run: Run, winch: str = "") -> Iterator[Finding]:
    """Findings ``inverted-sign`` and ``wrong-factor`` of ``motor_velocity``; value: the slope.

    Notes
    -----
    The integral of the velocity over about 40 blocks of time is regressed on the change of the
    angle; blocks with a gap are left out.
    """
    prefix = f"{winch}." if winch else ""
    name, angle = f"{prefix}motor_velocity", f"{prefix}motor_angle"
    if name not in run or angle not in run or len(run) < _LEAST_SAMPLES:
        return
    velocity, time = run[name], run.time
    steps = np.diff(time)
    parts = np.where(
        steps > _GAP * np.median(steps), np.nan, steps * (velocity[1:] + velocity[:-1]) / 2
    )
    edges = np.linspace(0, len(parts), min(_BLOCKS, len(parts)) + 1).astype(int)
    turned = np.diff(run[angle][edges])
    integral = np.array([parts[a:b].sum() for a, b in pairwise(edges)])
    good = np.isfinite(turned) & np.isfinite(integral)
    turned, integral = turned[good], integral[good]
    if len(turned) < 3 or not np.any(turned) or not np.any(integral):
        return
    square = float(turned @ turned)
    slope = float(turned @ integral) / square
    left = integral - slope * turned
    if slope**2 * square < _CORRELATION * float(integral @ integral):
        return
    std = float(np.sqrt(left @ left / (len(turned) - 1) / square))
    yield from _judged(run, name, Slope(slope, std))


def _judged(run: Run, name: str, slope: Slope) -> Iterator[Finding]:
    beside = f"its integral over the change of the motor angle has the slope {slope_text(slope)}"
    if slope.value < 0:
        text = f"the sign looks inverted: {beside}"
        yield Finding("inverted-sign", run.name, name, slope.value, text)
    margin = _SIGMAS * slope.std
    if abs(slope.value) + margin < _RANGE[0] or abs(slope.value) - margin > _RANGE[1]:
        known = named_factor(slope, is_angle=True)
        why = f"that is {known}" if known else "no known constant explains it"
        text = f"the unit looks wrong: {beside}; {why}"
        yield Finding("wrong-factor", run.name, name, slope.value, text)

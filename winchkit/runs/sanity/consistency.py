"""Consistency of a motor's velocity with its angle, and speeds that no motor has.

The integral of the velocity is the angle. An angle in degrees or counts that is read as radians
turns faster than any servo motor; without a velocity nothing else of a run shows it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from winchkit.arrays import Array
from winchkit.model.derivatives import lateness
from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.runs.sanity.factors import Slope, named_factor, slope_text
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.local_noise import local_noise

INCONSISTENT = "inconsistent-velocity"
"""Code of the finding on a velocity that is not the derivative of the motor angle."""

LATE = "late-velocity"
"""Code of the finding on a velocity behind a filter, or ahead; value: the lateness, s."""

_RPM = 60 / (2 * np.pi)
"""Of one rad/s."""
_FASTEST = 50_000 / _RPM
"""rad/s; spindles reach 60,000 rpm, servo motors 20,000."""
_FASTEST_SHARE = 0.9
"""Quantile of the speeds that is compared: an angle that wraps jumps in fewer samples."""
_LATE = 0.5
"""Lateness in sampling intervals from which it is reported; rule of thumb."""
_RANGE = 0.8, 1.25
"""Slopes that are no wrong unit: a velocity that its drive has filtered or estimated."""
_SIGMAS = 3.0
"""Standard deviations by which a slope must be outside the range."""
_BLOCKS = 40
"""Blocks of time for the spread of the ratio: each must hold a motion. Rule of thumb."""
_LEAST_SAMPLES = 50
"""The ratio of fewer samples is too uncertain; rule of thumb."""
_CORRELATION = 0.5
"""Least squared correlation at which a slope is judged: less than half of the integral varies with
the angle where a filter delays the velocity by more than an eighth of the motion's period."""
_CLEAR = 4.0
"""Standard deviations of the noise by which both the motion and the velocity are clear."""
_GAP = 2.5
"""Steps beyond this many median ones are gaps, over which no velocity is integrated; two lost
samples."""


def velocity_consistency(run: Run, winch: str = "") -> Iterator[Finding]:
    """Findings on ``motor_velocity``; value: the slope, or the squared correlation.

    The integral of the velocity over about 40 blocks of time is regressed on the change of the
    angle; blocks with a gap are left out. A velocity is inconsistent where the squared correlation
    is below one half, a constant offset aside, although the changes of the angle and the velocity
    itself are both four times as large as their noise.
    """
    prefix = f"{winch}." if winch else ""
    name, angle = f"{prefix}motor_velocity", f"{prefix}motor_angle"
    if f"{prefix}position" in run and angle not in run:
        name, angle = f"{prefix}velocity", f"{prefix}position"
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
        size = _noise(velocity, np.median(steps), len(steps) / _BLOCKS, run[angle])
        if size is not None and np.std(turned) > _CLEAR * size:
            yield from _inconsistent(run, name, turned - turned.mean(), integral - integral.mean())
        return
    std = float(np.sqrt(left @ left / (len(turned) - 1) / square))
    yield from _judged(run, name, Slope(slope, std))
    if _RANGE[0] < slope < _RANGE[1]:
        yield from _late(run, name, run[angle])


def implausible_speed(run: Run, winch: str = "") -> Iterator[Finding]:
    """Finding on a ``motor_angle`` that turns faster than any servo motor; value: the factor of
    degrees, the most frequent cause."""
    name = f"{winch}.motor_angle" if winch else "motor_angle"
    if name not in run or len(run) < _LEAST_SAMPLES:
        return
    speeds = np.abs(np.diff(run[name])) / run.interval
    speeds = speeds[np.isfinite(speeds)]
    fastest = float(np.quantile(speeds, _FASTEST_SHARE)) if len(speeds) else 0.0
    if fastest > _FASTEST:
        rpm, degrees = fastest * _RPM, np.degrees(1.0)
        text = (
            f"the unit looks wrong: the motor turns at {rpm:,.0f} rpm, more than any servo motor "
            f"({_FASTEST * _RPM:,.0f} rpm); in degrees it is {rpm / degrees:,.0f} rpm"
        )
        yield Finding("wrong-factor", run.name, name, degrees, text)


def _late(run: Run, name: str, angle: Array) -> Iterator[Finding]:
    known = np.isfinite(run[name]) & np.isfinite(angle)
    late, std = lateness(run[name][known], angle[known], run.time[known])
    if abs(late) > max(_SIGMAS * std, _LATE * run.interval):
        side = "late against the motor angle, as behind a filter"
        if late < 0:
            side = "ahead of the motor angle, as a command is"
        text = f"it is {quantity(abs(late), 's')} {side}; where it is used it is shifted back"
        yield Finding(LATE, run.name, name, late, text)


def _noise(velocity: Array, step: float, rows: float, angle: Array) -> float | None:
    """Noise of a block's integral and change of the angle; None for all noise."""
    own = local_noise(velocity)
    if _CLEAR * own > np.nanstd(velocity):
        return None
    return float(np.hypot(own * step * np.sqrt(rows), np.sqrt(2) * local_noise(angle)))


def _inconsistent(run: Run, name: str, turned: Array, integral: Array) -> Iterator[Finding]:
    squares = float(turned @ turned) * float(integral @ integral)
    explained = float(turned @ integral) ** 2 / squares if squares else 0.0
    if explained < _CORRELATION:
        text = (
            f"it is not the derivative of the motor angle, whose changes share {explained:.0%} of "
            "their variance with its integral: of another axis, or delayed by a filter; the "
            "derivative of the angle is used instead"
        )
        yield Finding(INCONSISTENT, run.name, name, explained, text)


def _judged(run: Run, name: str, slope: Slope) -> Iterator[Finding]:
    beside = f"its integral over the change of the motor angle has the slope {slope_text(slope)}"
    if slope.value < 0:
        text = f"the sign looks inverted: {beside}"
        yield Finding("inverted-sign", run.name, name, slope.value, text)
    margin = _SIGMAS * slope.std
    if abs(slope.value) + margin < _RANGE[0] or abs(slope.value) - margin > _RANGE[1]:
        known = named_factor(slope, "angle")
        if known:
            text = f"the unit looks wrong: {beside}; that is {known}"
            yield Finding("wrong-factor", run.name, name, slope.value, text)
        elif slope.value > 0:
            text = (
                f"it is not the derivative of the motor angle: {beside}, which no unit explains; "
                "the derivative of the angle is used instead: check the ranges of both"
            )
            yield Finding(INCONSISTENT, run.name, name, slope.value, text)

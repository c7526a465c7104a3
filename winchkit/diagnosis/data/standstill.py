"""Standstills at which the motor torque changes: static friction holds any torque below its limit.

Where the angle does not change by more than its noise, no effect of the motion predicts a change of
the torque. The spread of the residual within standstills is then pure error, as that of repeats is.
Where the torque wanders there, by von Neumann's ratio, as in stick-slip, it is a reaction of static
friction to the controller and says nothing of the friction's size: it is not compared.

References
----------
von Neumann, J. (1941). Distribution of the ratio of the mean square successive difference to the
variance. Ann. Math. Statist. 12, 367-395.
Armstrong-Hélouvry, B., Dupont, P., Canudas de Wit, C. (1994). A survey of models, analysis tools
and compensation methods for the control of machines with friction. Automatica 30, 1083-1138.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.transients import white_noise
from winchkit.model.line import Motion
from winchkit.quantity_text import percent, quantity
from winchkit.runs.sanity.finding import Finding

STANDSTILL = "standstill"
_LEAST_SAMPLES = 5
"""A shorter interval has hardly a variance, and a slow motion crosses its noise in it."""
_LEAST_MOVING = 50
"""Samples in motion without which the standstills are compared as well: they are all there is."""
_DEVIATIONS = 3.0
"""Standard deviations of the angle to either side, which one sample in 370 exceeds."""
_COUNTS = 1.5
"""Steps of the angle's resolution: one may be crossed by noise."""
_TURNS = 3.0
"""Duration of a standstill in those of a turning point: presliding is not taken for one."""
_MOVING = 0.5
"""Mean expected direction from which a motion within the noise is a slow one."""
_WANDERS = 4.0
"""Variance over half the mean square successive difference, 1 for white noise, from which the
torque is no noise: an AR(1) noise with a coefficient of 0.6 has 2.5."""


def standstills(motion: Motion) -> list[slice]:
    """Standstills of the motor: the angle stays within its noise for longer than it does at a turn.

    A turn with the rms acceleration a of the run stays within a width w for 2 √(2 w/a). A
    standstill has five samples at least.
    """
    time, acceleration = motion.at.time, float(np.sqrt(np.mean(motion.at.motor_acceleration**2)))
    intervals, width = _within_noise(motion.at.motor_angle)
    turn = 2 * np.sqrt(2 * width / acceleration) if acceleration else 0.0
    return [
        interval
        for interval in intervals
        if time[interval.stop - 1] - time[interval.start] > _TURNS * turn
        and np.mean(np.abs(motion.at.motor_direction[interval])) < _MOVING
    ]


def _within_noise(angle: Array) -> tuple[list[slice], float]:
    """Longest intervals, one after another, of a range below that of the noise, and that range."""
    steps = np.abs(np.diff(angle))
    resolution = float(np.min(steps[steps > 0], initial=np.inf))
    if not np.isfinite(resolution):
        return [], 0.0
    most = max(2 * _DEVIATIONS * white_noise(angle), _COUNTS * resolution)
    found, first, low, high = [], 0, angle[0], angle[0]
    for index, value in enumerate([*angle.tolist(), np.inf]):
        low, high = min(low, value), max(high, value)
        if high - low > most:
            if index - first >= _LEAST_SAMPLES:
                found.append(slice(first, index))
            first, low, high = index, value, value
    return found, most


def spread_at_standstill(residual: Array, intervals: Sequence[slice]) -> tuple[float, float]:
    """Variance within intervals, pooled, and half their mean square successive difference."""
    parts = [residual[interval] for interval in intervals]
    dof = max(1, sum(len(part) - 1 for part in parts))
    within = sum(float(np.sum((part - np.mean(part)) ** 2)) for part in parts)
    successive = sum(float(np.sum(np.diff(part) ** 2)) for part in parts)
    return within / dof, successive / (2 * dof)


def standstill_mask(measured: Array, nominal: Array, motion: Motion) -> NDArray[np.bool_]:
    """Samples at standstills whose torque is a reaction of static friction.

    There are none where the residual is as steady at standstills as its noise, or where hardly
    anything else is there.
    """
    mask = np.zeros(len(measured), dtype=bool)
    for interval in _reactions(measured - nominal, motion)[0]:
        mask[interval] = True
    return mask


def _reactions(residual: Array, motion: Motion) -> tuple[list[slice], float]:
    """Standstills that are not compared, none where they are, and the variance within them."""
    intervals = standstills(motion)
    within, noise = spread_at_standstill(residual, intervals)
    moving = len(residual) - sum(i.stop - i.start for i in intervals)
    if within <= _WANDERS * noise or moving < _LEAST_MOVING:
        return [], 0.0
    return intervals, within


def standstill_findings(runs: Iterable[tuple[str, Array, Array, Motion]]) -> list[Finding]:
    """Findings on runs whose torque is not compared at standstills.

    ``runs`` holds the name, measured and predicted torque and nominal motion of each.
    """
    found = []
    for name, measured, nominal, motion in runs:
        intervals, within = _reactions(measured - nominal, motion)
        if not intervals:
            continue
        spread = float(np.sqrt(within))
        share = sum(i.stop - i.start for i in intervals) / len(measured)
        text = (
            f"{percent(share)} of the samples left out: the motor stands still, where static "
            "friction holds any torque below its limit; it changes by "
            f"{quantity(spread, 'N m')} rms there"
        )
        found.append(Finding(STANDSTILL, name, "motor_torque", spread, text))
    return found

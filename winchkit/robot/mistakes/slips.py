"""A cable that slips, or a motor that loses its zero, between two rows of a table of poses.

From one row of a run on, the cable of a line then differs from that by its motor angle by the same
length. For every line and row this length is estimated beside the linearised fit
(:mod:`winchkit.robot.mistakes.score`), the column being that of the line's closures from the row to
the end of the run; the largest fall of χ² is the slip.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.bundle_adjustment import ReducedEquations
from winchkit.robot.mistakes.score import eliminated
from winchkit.robot.mistakes.table import Mistake

_ENDS = 3
"""Least rows before and after a slip: fewer are gross errors of single rows (rule of thumb)."""
_LEFT = 0.4
"""Most of χ² that is left without a slip (rule of thumb: noise alone leaves 0.97 and more)."""
_DIFFERENCE = 1e-4
"""Step of a numerical derivative, rad: a cable's law is smooth over far larger angles."""


@dataclass(frozen=True)
class CableSlip:
    """A cable that is longer from a row on than by its motor angle."""

    line: int
    rows: slice
    """From the first row with it to the end of its run."""
    length: float
    """m."""
    left: float
    """χ² without the slip, as a share."""
    chance: float
    """Probability of such a fall without a slip (F test, times the number of lines and rows)."""


def slip_in(
    measured: MeasuredPoses, linear: ReducedEquations, sigma: float, *, least: float = _LEFT
) -> CableSlip | None:
    """The slip that explains these poses; ``sigma`` of the closures, m. None where more than
    ``least`` of χ² is left without it."""
    stack = linear.stack
    if "closure" not in stack.kinds:
        return None
    own, rest = stack.kinds["closure"], eliminated(linear)
    scale = stack.known[:, own] / sigma
    by_poses = np.maximum(1 - np.sum(rest.half[..., own] ** 2, axis=1), 0.0)
    found = None
    for run in np.unique(measured.run):
        rows = np.flatnonzero(measured.run == run)
        if len(rows) < 2 * _ENDS:
            continue
        lengths, falls = rest.fall(
            _to_the_end(scale[rows] * rest.residual[rows, own]),
            _to_the_end(scale[rows] ** 2 * by_poses[rows]),
            _to_the_end(scale[rows, :, None] * linear.pose_free[rows, own]),
        )
        falls[:_ENDS] = falls[len(rows) - _ENDS + 1 :] = 0.0
        first, line = np.unravel_index(int(np.argmax(falls)), falls.shape)
        fall = float(falls[first, line])
        left = 1 - fall / max(rest.square, np.finfo(float).tiny)
        if left <= least and (found is None or left < found.left):
            to_the_end = slice(int(rows[first]), int(rows[-1]) + 1)
            length, chance = float(lengths[first, line]), rest.chance(fall, falls.size)
            found = CableSlip(int(line), to_the_end, length, left, chance)
    return found


def _to_the_end(values: Array) -> Array:
    """Sums from each row to the last one."""
    return np.asarray(np.cumsum(values[::-1], axis=0)[::-1])


def slip_mistake(robot: Robot, measured: MeasuredPoses, slip: CableSlip) -> Mistake:
    """The mistake that a slip is."""
    name, place = robot.names[slip.line], str(measured.place[slip.rows.start])
    longer = "longer" if slip.length > 0 else "shorter"

    def mended(table: MeasuredPoses) -> MeasuredPoses:
        angle = table.motor_angle
        per_turn = (robot.lengths_at(angle + _DIFFERENCE) - robot.lengths_at(angle)) / _DIFFERENCE
        changed = angle.copy()
        changed[slip.rows, slip.line] += slip.length / per_turn[slip.rows, slip.line]
        return replace(table, motor_angle=changed)

    return Mistake(
        f"motor-slip:{name}",
        f"from {place} on the cable of line {name} is {abs(slip.length) * 1e3:.3g} mm {longer} "
        "than by its motor angle",
        "it slipped, or the motor lost its zero between two rows: leave those before or those "
        "after it out, and set the reference anew",
        mended,
    )

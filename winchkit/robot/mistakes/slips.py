"""A cable that slips, or a motor that loses its zero, between two rows of a table of poses.

From one row of a run on, the cable of a line then differs from that by its motor angle by the same
length. For every line and row this length is estimated beside the linearised fit, poses and
parameters eliminated, with the χ² that it takes away; the largest is the slip. With the residuals e
and the column z of a line, both without what poses explain, F the same of the parameters' columns,
H the information with the priors and g the gradient,

    N = Σ z·e − (Σ Fᵀz)ᵀ H⁻¹ g,    D = Σ z·z − (Σ Fᵀz)ᵀ H⁻¹ (Σ Fᵀz),    length N / D,  fall N² / D

with sums over the rows from there to the end of the run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.identification.bundle_adjustment import ReducedEquations
from winchkit.robot.mistakes.table import Mistake

_ENDS = 3
"""Least rows before and after a slip: fewer are gross errors of single rows (rule of thumb)."""
_LEFT = 0.25
"""Most of χ² that is left without a slip: half of the misfit. Noise leaves 0.9 and more."""
_DIFFERENCE = 1e-4
"""Step of a numerical derivative, rad: a cable's law is smooth over far larger angles."""


@dataclass(frozen=True)
class Slip:
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
) -> Slip | None:
    """The slip that explains these poses; ``sigma`` of the closures, m. None where more than
    ``least`` of χ² is left without it."""
    from scipy.special import fdtrc

    stack = linear.stack
    if "closure" not in stack.kinds or len(measured) < 2 * _ENDS:
        return None
    own = stack.kinds["closure"]
    half = linear.factor @ np.swapaxes(stack.by_pose, 1, 2)
    free = stack.residual - (np.swapaxes(half, 1, 2) @ (half @ stack.residual[..., None]))[..., 0]
    scale = stack.known[:, own] / sigma
    by_poses = np.maximum(1 - np.sum(half[..., own] ** 2, axis=1), 0.0)
    inverse = np.linalg.inv(linear.information + np.eye(len(linear.gradient)))
    pull = inverse @ linear.gradient
    freedom = float(np.count_nonzero(stack.known) - np.sum(half**2))
    freedom -= float(np.sum(linear.information * inverse))
    before = float(np.sum(free**2) + linear.prior @ linear.prior - linear.gradient @ pull)
    found = None
    for run in np.unique(measured.run):
        rows = np.flatnonzero(measured.run == run)
        if len(rows) < 2 * _ENDS:
            continue
        columns = scale[rows, :, None] * linear.pose_free[rows, own]
        across = _to_the_end(columns)
        product = _to_the_end(scale[rows] * free[rows, own]) - across @ pull
        square = _to_the_end(scale[rows] ** 2 * by_poses[rows])
        square = square - np.einsum("rnq,qk,rnk->rn", across, inverse, across)
        inside = slice(_ENDS, len(rows) - _ENDS + 1)
        fall = np.zeros_like(square)
        fall[inside] = product[inside] ** 2 / np.maximum(square[inside], np.finfo(float).eps)
        first, line = np.unravel_index(int(np.argmax(fall)), fall.shape)
        left = 1 - float(fall[first, line]) / max(before, np.finfo(float).tiny)
        if left <= least and (found is None or left < found.left):
            length = float(product[first, line] / square[first, line])
            ratio = (freedom - 1) * (1 - left) / max(left, np.finfo(float).eps)
            chance = float(fdtrc(1, freedom - 1, ratio)) * fall.size if freedom > 1 else 1.0
            to_the_end = slice(int(rows[first]), int(rows[-1]) + 1)
            found = Slip(int(line), to_the_end, length, left, chance)
    return found


def _to_the_end(values: Array) -> Array:
    """Sums from each row to the last one."""
    return np.asarray(np.cumsum(values[::-1], axis=0)[::-1])


def slip_mistake(robot: Robot, measured: MeasuredPoses, slip: Slip) -> Mistake:
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

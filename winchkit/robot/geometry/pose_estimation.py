"""Least-squares estimate of poses from what was measured at each, with the robot given.

A step of Gauss and Newton's method solves (JᵀJ + D) δ = −Jᵀ r for each pose. The diagonal D keeps
directions that nothing measured where they are; it is in the step and not in the cost, so that it
slows the iteration and does not bias its end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import angles_of, rotation_by, rotation_of
from winchkit.robot.geometry.kinematics import Pose, guided

_STRIDE = 0.3
"""Longest step of a coordinate, m or rad: rule of thumb, within which lengths are nearly linear."""


@dataclass(frozen=True)
class Iteration:
    """Damping and end of the iteration."""

    damping: float
    """Added to the diagonal of JᵀJ, 1/m² or 1/rad²."""
    relative_damping: float
    """The same, as a share of the trace of JᵀJ."""
    tolerance: float
    """Largest step, m or rad, at which the iteration ends."""
    steps: int
    """Most steps."""


def estimated_pose(
    whitened: Callable[[Pose], tuple[Array, Array]], start: Pose, iteration: Iteration
) -> Pose:
    """Poses with the least sum of squares of whitened residuals (p, r), zero where nothing was
    measured as are their derivatives (p, r, 6); also where the iteration has not converged."""
    pose = start
    for _ in range(iteration.steps):
        residual, by_pose = whitened(pose)
        turned = np.swapaxes(by_pose, 1, 2)
        normal = turned @ by_pose
        trace = np.trace(normal, axis1=1, axis2=2)[:, None]
        firm = iteration.damping + iteration.relative_damping * trace
        normal[:, range(6), range(6)] += firm
        step = -np.linalg.solve(normal, turned @ residual[..., None])[..., 0]
        size = np.max(np.abs(step), axis=1, keepdims=True)
        pose = moved_pose(pose, step * np.minimum(1.0, _STRIDE / np.maximum(size, _STRIDE)))
        if np.max(size) < iteration.tolerance:
            break
    return pose


def moved_pose(pose: Pose, step: Array) -> Pose:
    """Poses moved by positions and rotation vectors, (p, 6), m and rad."""
    return Pose(pose.position + step[:, :3], rotation_by(step[:, 3:]) @ pose.rotation)


def start_pose(position: Array, angles: Array, home: Pose, free: Array) -> Pose:
    """Measured positions and angles, NaN where missing, completed by those of the home pose;
    coordinates that guides hold are those of home."""
    place = np.where(np.isfinite(position), position, home.position)
    some = np.any(np.isfinite(angles), axis=1)
    rotation = np.repeat(home.rotation, len(position), axis=0)
    filled = np.where(np.isfinite(angles), angles, angles_of(home.rotation))
    rotation[some] = rotation_of(*filled[some].T)
    return guided(Pose(place, rotation), home, free)

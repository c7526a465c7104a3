"""Planned motion of the platform in time, with cable lengths, forces and motor angles."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.motion import JERK_TIME
from winchkit.bench.robot.path import Path
from winchkit.model.robot import ForceLimits, PlatformMotion, Pose, Robot, quadratic
from winchkit.model.robot import dynamic_wrench as of_motion
from winchkit.model.trajectory import Trajectory, plan

__all__ = ["PlatformTrajectory", "dynamic_wrench", "plan_along"]

_STEP = 0.02
"""Of the samples between which motor angles are interpolated, s."""
_MOST = 20_000
_FEWEST = 16


@dataclass(frozen=True)
class PlatformTrajectory:
    """Samples of a motion from rest to rest along a path; k of them, n cables."""

    path: Path
    profile: Trajectory
    """Distance along the path by time."""
    time: Array
    """(k,), s."""
    distance: Array
    """Along the path, (k,), m."""
    speed: Array
    """Along the path, (k,), m/s."""
    pose: Pose
    acceleration: Array
    """Of the platform's origin, (k, 3), m/s^2."""
    length: Array
    """Of the cables, (k, n), m."""
    force: Array
    """Cable forces nearest to the middle of the limits, (k, n), N; NaN where there are none."""
    motor_angle: Array
    """(k, n), rad."""

    @property
    def duration(self) -> float:
        """s."""
        return float(self.time[-1])


def plan_along(
    robot: Robot,
    path: Path,
    limits: ForceLimits,
    speed: float,
    acceleration: float,
) -> PlatformTrajectory:
    """Plan an S-curve along a path, and the cables with it.

    Parameters
    ----------
    robot : Robot
        The robot with its effects.
    path : Path
        Path of the platform.
    limits : ForceLimits
        Of the force distribution.
    speed, acceleration : float
        Along the path, m/s and m/s^2; rotation counts as ρ times its angle.

    Returns
    -------
    PlatformTrajectory
        Not yet compared with the limits of the winches.

    Notes
    -----
    On a curved path tangential and centripetal acceleration each get acceleration/√2.
    """
    curved = path.curvature * path.length > 1e-6
    tangential = acceleration / sqrt(2) if curved else acceleration
    fastest = min(speed, sqrt(tangential / path.curvature)) if curved else speed
    profile = plan(path.length, fastest, tangential, tangential / JERK_TIME)
    count = min(_MOST, max(_FEWEST, ceil(profile.duration / _STEP) + 1))
    time = np.linspace(0.0, profile.duration, count)
    distance, rate, change = profile.at(time)
    pose = path.pose(distance)
    first, second = path.derivatives(distance)
    linear = second * rate[:, None] ** 2 + first * change[:, None]
    force = _forces(robot, pose, linear, limits)
    tension = np.where(np.isfinite(force), force, 0.0)
    angle = robot.motor_angles(pose, tension=tension)
    length = robot.lengths(pose)
    return PlatformTrajectory(
        path, profile, time, distance, rate, pose, linear, length, force, angle
    )


def dynamic_wrench(robot: Robot, pose: Pose, acceleration: Array) -> Array:
    """Weight and inertial force of a motion along a path, (k, 6), N and N m.

    Parameters
    ----------
    robot : Robot
        The robot.
    pose : Pose
        k poses.
    acceleration : (k, 3) array
        Of the platform's origin, m/s^2; angular velocity and acceleration are taken as zero.

    Returns
    -------
    (k, 6) array
        About the platform's origin.
    """
    still = np.zeros_like(acceleration)
    motion = PlatformMotion(pose, np.hstack([still, still]), np.hstack([acceleration, still]))
    return of_motion(robot.platform, motion)


def _forces(robot: Robot, pose: Pose, acceleration: Array, limits: ForceLimits) -> Array:
    structure, wrench = robot.structure(pose), dynamic_wrench(robot, pose, acceleration)
    out = np.full(structure.shape[::2], np.nan)
    for k, (matrix, load) in enumerate(zip(structure, wrench, strict=True)):
        found = quadratic(matrix, load, limits)
        if found.feasible:
            out[k] = found.value
    return out

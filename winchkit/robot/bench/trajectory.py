"""Planned motion of the platform in time, with cable lengths, forces and motor angles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from winchkit.arrays import Array
from winchkit.model.trajectory import JERK_TIME, Trajectory, plan
from winchkit.robot.bench.path import PlatformPath
from winchkit.robot.dynamics.dynamics import PlatformMotion, dynamic_wrench
from winchkit.robot.dynamics.rest import rest_poses
from winchkit.robot.forces.force_distribution import ForceLimits, distributed_forces
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot

_STEP = 0.02
"""Of the samples between which motor angles are interpolated, s."""
_MOST = 20_000
"""Samples: 400 s at `_STEP`; longer motions have longer steps."""
_FEWEST = 16
"""Samples: a motion of less than 0.3 s has them in place of a few steps of 20 ms."""
_LEAST = 0.1
"""Quick-stop ramp of a cable that hardly moves, as a share of that of the fastest."""


@dataclass(frozen=True)
class PlatformTrajectory:
    """Samples of a motion from rest to rest along a path; k of them, n cables."""

    path: PlatformPath
    profile: Trajectory
    """Distance along the path by time."""
    time: Array
    """(k,), s."""
    distance: Array
    """Along the path, (k,), m."""
    speed: Array
    """Along the path, (k,), m/s."""
    motion: PlatformMotion
    """Poses with velocities and accelerations, (k, 6)."""
    length: Array
    """Of the cables, (k, n), m."""
    force: Array
    """Cable forces nearest to the middle of the limits, (k, n), N; NaN where there are none."""
    motor_angle: Array
    """(k, n), rad."""

    @property
    def pose(self) -> Pose:
        """Poses, k."""
        return self.motion.pose

    @property
    def duration(self) -> float:
        """s."""
        return float(self.time[-1])


def plan_along(
    robot: Robot,
    path: PlatformPath,
    limits: ForceLimits,
    speed: float,
    acceleration: float,
) -> PlatformTrajectory:
    """Plan an S-curve along a path, and the cables with it. On a curved path tangential and
    centripetal acceleration each get acceleration/√2."""
    curved = path.curvature * path.length > 1e-6
    tangential = acceleration / sqrt(2) if curved else acceleration
    fastest = min(speed, sqrt(tangential / path.curvature)) if curved else speed
    profile = plan(path.length, fastest, tangential, tangential / JERK_TIME)
    count = min(_MOST, max(_FEWEST, ceil(profile.duration / _STEP) + 1))
    time = np.linspace(0.0, profile.duration, count)
    distance, rate, change = profile.at(time)
    motion = motion_at(path, distance, rate, change)
    if robot.hangs:
        motion, force = _hanging(robot, motion, limits)
    else:
        wrench = dynamic_wrench(robot.platform, motion)
        force = distributed_forces(robot.structure(motion.pose), wrench, limits)
    tension = np.where(np.isfinite(force), force, 0.0)
    angle = robot.motor_angles(motion.pose, tension=tension)
    length = robot.lengths(motion.pose)
    return PlatformTrajectory(path, profile, time, distance, rate, motion, length, force, angle)


def _hanging(
    robot: Robot, motion: PlatformMotion, limits: ForceLimits
) -> tuple[PlatformMotion, Array]:
    """The motion in the poses of rest of a hanging platform, and the forces there, NaN without one;
    its swinging about them is no part of the plan."""
    rest = rest_poses(robot, motion.pose)
    low, high = limits.between(len(robot.names))
    within = np.asarray(np.all((low <= rest.force) & (rest.force <= high), axis=1))
    known = np.isfinite(rest.force[:, :1])
    # Where there is no rest the plan is refused by its forces, at the pose that was wanted.
    rotation = np.where(known[..., None], rest.pose.rotation, motion.pose.rotation)
    pose = Pose(motion.pose.position, rotation)
    return replace(motion, pose=pose), np.where((rest.stable & within)[:, None], rest.force, np.nan)


def motion_at(path: PlatformPath, distance: Array, rate: Array, change: Array) -> PlatformMotion:
    """Motion of the platform at places of a path; ``distance`` (k,) along it, m, with its first and
    second derivative by time."""
    first, second = path.derivatives(distance)
    velocity = first * rate[:, None]
    acceleration = second * rate[:, None] ** 2 + first * change[:, None]
    return PlatformMotion(path.pose(distance), velocity, acceleration)


def quick_stop_ramps(planned: PlatformTrajectory, arms: Array, deceleration: float) -> Array:
    """Decelerations of the motors, (n,), rad/s^2, with which all cables stop in the same time, the
    fastest with ``deceleration``, m/s^2; ``arms`` (n,) have no sign, m/rad.

    A quick stop of the drives decelerates each motor by its own 6085h. The speeds of the cables are
    not in the same proportion everywhere on a path: a cable at the share x of its largest speed
    rests after the share x of the common time.
    """
    rate = np.gradient(planned.motor_angle, planned.time, axis=0)
    speed = np.abs(rate).max(axis=0) * arms
    fastest = float(speed.max())
    share = speed / fastest if fastest > 0.0 else np.ones_like(speed)
    return np.asarray(deceleration * np.maximum(share, _LEAST) / arms)

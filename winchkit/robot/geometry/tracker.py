"""Readings of a tracker: its frame, its scale, the reflector on the platform, the target's axes.

A tracker stands in a frame of its own and observes a reflector (or the centre of a marker set) at a
point o of the platform. With the platform at position c and rotation R in the base frame it shows

    y = h + t + (1 + s) Q (c + R o − h),       R_y = Q R M

with the home position h, about which the frame is turned so that shift t and turn Q are hardly
correlated, the relative error of its scale s, and the rotation M from platform axes to those of the
target or of an IMU. Q = exp([q]×) with the rotation vector q. An instrument whose rotations are not
in the tracker's frame (an IMU) shows R_y = R M.

:func:`registered` finds a first estimate of these numbers from predicted poses: the rigid
registration of Umeyama, in turn with a linear least-squares step for shift, offset and scale.

References
----------
S. Umeyama, *Least-Squares Estimation of Transformation Parameters Between Two Point Patterns*, IEEE
Trans. PAMI 13, 1991. B. K. P. Horn, *Closed-form solution of absolute orientation using unit
quaternions*, J. Opt. Soc. Am. A 4, 1987.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import (
    angle_rates,
    mean_rotation,
    rotation_by,
    rotation_of,
    rotation_vector,
    skew,
)
from winchkit.robot.geometry.constraints import Constraint, rotation_residual
from winchkit.robot.geometry.kinematics import Pose
from winchkit.schema.profiles.instruments import FrameSpec
from winchkit.schema.profiles.robot import RobotProfile

_ROUNDS = 30
"""The closed form and the linear step converge linearly, since each keeps what the other has found;
rule of thumb, `_SETTLED` ends them before."""
_SETTLED = 1e-9
"""Relative fall of the sum of squares, which changes a standard deviation by 5e-10: nothing is
left."""
_RANK = 1e-6
"""Singular values of the linear step below this share of the largest count as zero (rule of thumb:
without rotations a reflector's offset is a shift, to within rounding)."""


@dataclass(frozen=True)
class Tracker:
    """Numbers of a tracker; without values it shows the platform's pose in the base frame."""

    home: Array
    """Point about which the frame is turned, (3,), m."""
    shift: Array
    """t, (3,) or per pose (p, 3), m."""
    turn: Array
    """Rotation vector q, (3,) or per pose (p, 3), rad."""
    offset: Array
    """Reflector on the platform o, (3,), m."""
    scale: float = 0.0
    """Relative error of the scale s."""
    mounting: Array | None = None
    """Rotation vector of M, (3,), rad."""
    turns_rotation: bool = True
    """Whether rotations are measured in the tracker's frame."""
    delay: float = 0.0
    """Time by which its readings are older than those of the winches at the same stamp, s."""

    @classmethod
    def at(cls, home: Array) -> Tracker:
        """The tracker in the base frame, its reflector at the platform's origin."""
        return cls(np.asarray(home).reshape(3), np.zeros(3), np.zeros(3), np.zeros(3))

    @property
    def is_trivial(self) -> bool:
        """Whether it shows the platform's pose in the base frame."""
        numbers = (self.shift, self.turn, self.offset, self.scale, self.delay)
        return self.mounting is None and not any(np.any(number) for number in numbers)

    @property
    def frame_in_base(self) -> tuple[Array, Array]:
        """Position (3,) and rotation (3, 3) of the base frame in the tracker's, scale included."""
        turned = rotation_by(self.turn)
        origin = self.home + self.shift - (1 + self.scale) * (turned @ self.home)
        return origin, turned


def declared_tracker(profile: RobotProfile) -> Tracker:
    """The tracker with the numbers of a robot's file, and zero for those that are unknown."""
    spec = profile.instrument
    own = spec.imu.mounting if spec.imu else spec.tracker.mounting
    home = np.array(profile.home.position)
    tracker = replace(Tracker.at(home), turns_rotation=spec.imu is None)
    if not isinstance(spec.tracker.scale, str):
        tracker = replace(tracker, scale=spec.tracker.scale)
    if not isinstance(spec.tracker.delay, str):
        tracker = replace(tracker, delay=spec.tracker.delay)
    if isinstance(spec.tracker.frame, FrameSpec):
        turned = rotation_of(*spec.tracker.frame.rotation)
        shift = np.array(spec.tracker.frame.position) - home
        shift = shift + (1 + tracker.scale) * (turned @ home)
        tracker = replace(tracker, shift=shift, turn=rotation_vector(turned))
    if not isinstance(spec.tracker.reflector, str):
        tracker = replace(tracker, offset=np.array(spec.tracker.reflector))
    if not isinstance(own, str) and any(own):
        tracker = replace(tracker, mounting=rotation_vector(rotation_of(*own)))
    return tracker


def left_jacobian(vector: Array) -> Array:
    """J with exp([v + dv]×) = exp([J dv]×) exp([v]×), of vectors (..., 3); (..., 3, 3)."""
    v = np.asarray(vector, dtype=float)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    cross = skew(v)
    first = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    second = np.where(small, 1 / 6, (1 - np.sinc(safe / np.pi)) / safe**2)
    return np.asarray(np.eye(3) + first * cross + second * (cross @ cross))


def reading_of(tracker: Tracker, pose: Pose) -> Pose:
    """Position and rotation that the tracker shows of p poses."""
    turned = rotation_by(tracker.turn)
    arm = pose.position + pose.rotation @ tracker.offset - tracker.home
    place = tracker.home + tracker.shift + (1 + tracker.scale) * _times(turned, arm)
    return Pose(place, _shown_rotation(tracker, pose, turned))


def pose_behind(tracker: Tracker, reading: Pose) -> Pose:
    """Poses in the base frame of readings: inverse of :func:`reading_of`."""
    back = np.swapaxes(np.broadcast_to(rotation_by(tracker.turn), reading.rotation.shape), 1, 2)
    turned = back @ reading.rotation if tracker.turns_rotation else reading.rotation
    if tracker.mounting is not None:
        turned = turned @ rotation_by(tracker.mounting).T
    arm = reading.position - tracker.home - tracker.shift
    place = tracker.home + _times(back, arm) / (1 + tracker.scale) - turned @ tracker.offset
    return Pose(place, turned)


def tracked_position(tracker: Tracker, pose: Pose, measured: Array) -> Constraint:
    """Position that the tracker should show less the measured one, (p, 3), m, by pose, frame (shift
    and rotation vector), reflector and scale."""
    turned = np.broadcast_to(rotation_by(tracker.turn), pose.rotation.shape)
    lever = pose.rotation @ tracker.offset
    arm = _times(turned, pose.position + lever - tracker.home)
    size = 1 + tracker.scale
    place = tracker.home + tracker.shift + size * arm
    by_pose = np.concatenate([size * turned, -size * turned @ skew(lever)], axis=2)
    by_turn = -skew(size * arm) @ left_jacobian(tracker.turn)
    by = {
        "tracker_frame": np.concatenate(
            [np.broadcast_to(np.eye(3), by_turn.shape), by_turn], axis=2
        ),
        "reflector": size * turned @ pose.rotation,
        "tracker_scale": arm[..., None],
    }
    return Constraint(place - measured, by_pose, {}, by)


def tracked_rotation(tracker: Tracker, pose: Pose, angles: Array) -> Constraint:
    """Rotation that the instrument should show less the measured one, (p, 3), rad."""
    turned = np.broadcast_to(rotation_by(tracker.turn), pose.rotation.shape)
    shown = _shown_rotation(tracker, pose, turned)
    whole = np.all(np.isfinite(angles), axis=1)
    rates = np.where(whole[:, None, None], np.eye(3), angle_rates(shown))
    frame = turned if tracker.turns_rotation else np.broadcast_to(np.eye(3), turned.shape)
    by_pose = np.zeros((len(angles), 3, 6))
    by_pose[..., 3:] = rates @ frame
    by_frame = np.zeros((len(angles), 3, 6))
    if tracker.turns_rotation:
        by_frame[..., 3:] = rates @ left_jacobian(tracker.turn)
    mounting = np.zeros(3) if tracker.mounting is None else tracker.mounting
    by = {
        "tracker_frame": by_frame,
        "mounting": rates @ frame @ pose.rotation @ left_jacobian(mounting),
    }
    return Constraint(rotation_residual(shown, angles), by_pose, {}, by)


def registration(seen: Array, point: Array) -> tuple[Array, Array, float]:
    """Rotation Q, shift t for a scale of 1, and scale k of Σ |y − t − k Q x|² → min (Umeyama) for
    points x and their measured places y; k is 1 where the points coincide."""
    mean_seen, mean = seen.mean(axis=0), point.mean(axis=0)
    spread = point - mean
    left, size, right = np.linalg.svd((seen - mean_seen).T @ spread / len(seen))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right)) or 1.0])
    turned = left @ np.diag(sign) @ right
    variance = float(np.mean(np.sum(spread**2, axis=1)))
    scale = float(size @ sign) / variance if variance > 0 else 1.0
    return turned, mean_seen - turned @ mean, scale


def registered(
    start: Tracker, pose: Pose, seen: Array, angles: Array, free: Collection[str]
) -> Tracker:
    """First estimate of the ``free`` numbers of a tracker from predicted poses, NaN where unknown;
    ``start`` where fewer than four positions were measured whole."""
    known = np.all(np.isfinite(seen), axis=1) & np.all(np.isfinite(pose.position), axis=1)
    if np.count_nonzero(known) >= 4:
        start = _located(start, pose[known], seen[known], free)
    if "mounting" in free:
        start = _mounted(start, pose, angles)
    return start


def _located(start: Tracker, pose: Pose, seen: Array, free: Collection[str]) -> Tracker:
    """Frame by Umeyama's closed form, in turn with a linear step of shift, offset and scale."""
    names = [name for name in ("frame", "reflector", "scale") if name in free]
    found, before = start, np.inf
    for _ in range(_ROUNDS if names else 0):
        if "frame" in free:
            point = pose.position + pose.rotation @ found.offset - found.home
            turned = registration(seen, (1 + found.scale) * point)[0]
            found = replace(found, turn=rotation_vector(turned))
        here = tracked_position(found, pose, seen)
        by = {
            "frame": here.by_robot["tracker_frame"],
            "reflector": here.by_robot["reflector"],
            "scale": here.by_robot["tracker_scale"],
        }
        matrix = np.concatenate([by[name] for name in names], axis=2).reshape(seen.size, -1)
        step = np.linalg.lstsq(matrix, -here.residual.ravel(), rcond=_RANK)[0]
        at = 0
        for name in names:
            own = step[at : at + by[name].shape[2]]
            at += len(own)
            if name == "frame":
                turned = rotation_by(left_jacobian(found.turn) @ own[3:])
                turn = rotation_vector(turned @ rotation_by(found.turn))
                found = replace(found, shift=found.shift + own[:3], turn=turn)
            elif name == "reflector":
                found = replace(found, offset=found.offset + own)
            else:
                found = replace(found, scale=max(found.scale + float(own[0]), -0.5))
        size = float(np.sum(tracked_position(found, pose, seen).residual ** 2))
        if size > before * (1 - _SETTLED):
            break
        before = size
    return found


def _mounted(start: Tracker, pose: Pose, angles: Array) -> Tracker:
    """Mounting from the mean of (Q R)ᵀ R_measured."""
    whole = np.all(np.isfinite(angles), axis=1) & np.all(np.isfinite(pose.rotation), axis=(1, 2))
    if not np.any(whole):
        return start
    bare = replace(start, mounting=None)
    shown = reading_of(bare, pose[whole]).rotation
    turned = mean_rotation(np.swapaxes(shown, 1, 2) @ rotation_of(*angles[whole].T))
    return replace(start, mounting=rotation_vector(turned))


def _shown_rotation(tracker: Tracker, pose: Pose, turned: Array) -> Array:
    out = turned @ pose.rotation if tracker.turns_rotation else pose.rotation
    return out if tracker.mounting is None else out @ rotation_by(tracker.mounting)


def _times(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])

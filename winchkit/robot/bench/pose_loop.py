"""Control of a platform's pose by its tracker: a slow outer loop about the lengths of the cables.

The deviation e (position, rotation vector) of the tracker's pose from the goal, low-passed over T,
is corrected by the winding speeds J e / τ with the derivatives J of the cable lengths by the pose.
The lengths of the winches have no steady error, so that the loop is of second order, with the
damping ratio √(τ/T)/2. A platform that swings at ω with the quality Q shows in it with a loop gain
of Q/(τ T ω²), whose phase beyond 1/T is that of a stable loop.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.tracker import TrackedPose
from winchkit.model.rotation import rotation_from_quaternion, rotation_vector
from winchkit.robot.bench.correction import Latch
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.tracker import Tracker, pose_behind

TIME, LOW_PASS = 1.0, 0.5
"""τ and T, s: a damping ratio of 0.7, and a loop gain below 1 for a platform that swings at 2 Hz
with a quality of 50."""
_JUMP = np.array([1e-3, math.radians(0.2)])
"""Position (m) and rotation (rad) that a platform at rest swings by between two poses, beside the
speed of the correction (rule of thumb)."""
_DISAGREEMENT = np.array([5e-3, math.radians(1.0)])
"""A payload moves a platform on elastic cables by less (rule of thumb)."""

_SHOWN = 50
"""Poses whose mean deviation is reported: half a second at 100 Hz."""


@dataclass(frozen=True)
class TrackerLimits:
    """Bounds of what a tracker may show of a platform that is held, SI."""

    age: float
    """Of the newest pose that differs from the one before it, s."""
    speed: float
    """Of the platform, m/s."""
    rotation_speed: float
    """rad/s."""


class TrackerWatch:
    """Compares a tracker's poses with the clock, with each other and with the winches."""

    def __init__(self, limits: TrackerLimits) -> None:
        self._limits = limits
        self._last: TrackedPose | None = None
        self._place = self._first = np.zeros(6)

    def at(self, now: float, newest: TrackedPose | None, place: Array, moved: Array) -> Trip | None:
        """Trip that the newest pose, at the ``place`` (6,) by the tracker, is a reason for; the
        platform has ``moved`` (6,) since the start, the first call, by the motor angles. m and
        rad."""
        last = self._last
        if newest is not None and (last is None or _differs(newest, last)):
            step = 0.0 if last is None else newest.received - last.received
            before = place if last is None else self._place
            self._last, self._place = newest, place
            if last is None:
                self._first = place - moved
            jump = self._jump(place - before, step)
            if jump is not None:
                return jump
        seen = -math.inf if self._last is None else self._last.received
        if not now - seen <= self._limits.age:
            since = "yet" if math.isinf(seen) else f"for {now - seen:.2f} s"
            words = (
                f"no new pose of the tracker {since} (limit {self._limits.age:g} s; one with the "
                "numbers of the one before is none); is the body in view, and does its program "
                "send?"
            )
            return Trip("tracker age", "", words, latches=True)
        return self._disagreement(self._place - self._first - moved)

    def _jump(self, change: Array, step: float) -> Trip | None:
        fastest = np.array([self._limits.speed, self._limits.rotation_speed])
        size, limit = _sizes(change), _JUMP + fastest * max(0.0, step)
        if (size <= limit).all():
            return None
        words = (
            f"the tracker's pose changed by {_text(size)} within {step * 1e3:.0f} ms (limit "
            f"{_text(limit)}), faster than the platform is moved; look at the tracker, then reset"
        )
        return Trip("tracker jump", "", words, latches=True)

    def _disagreement(self, change: Array) -> Trip | None:
        size = _sizes(change)
        if (size <= _DISAGREEMENT).all():
            return None
        words = (
            f"tracker and motor angles disagree by {_text(size)} on what the platform has moved "
            f"since it is held (limit {_text(_DISAGREEMENT)}); look for a tracker that was moved, "
            "a slack or slipping cable and a load on the platform, then reset"
        )
        return Trip("tracker disagreement", "", words, latches=True)


def _sizes(change: Array) -> Array:
    return np.array([np.linalg.norm(change[:3]), np.linalg.norm(change[3:])])


def _text(size: Array) -> str:
    return f"{size[0] * 1e3:.1f} mm and {math.degrees(size[1]):.2f} deg"


def _differs(newest: TrackedPose, last: TrackedPose) -> bool:
    """Whether a pose is a later one by the tracker's clock, and has other numbers."""
    same = newest.position == last.position and newest.quaternion == last.quaternion
    return newest.time > last.time and not same


class PoseLoop:
    """Winding speeds by a tracker's pose; a loop of a correction."""

    def __init__(
        self,
        goal: Pose,
        by_pose: Array,
        newest: Callable[[], TrackedPose | None],
        watch: TrackerWatch,
        latch: Latch,
        *,
        numbers: Tracker | None = None,
    ) -> None:
        """Hold ``goal``, one pose, by derivatives (n, 6) of the cable lengths and the tracker's
        newest pose; ``numbers`` of the tracker, None where it shows poses in the base frame."""
        self.goal = goal
        self.error = np.full(6, math.nan)
        """Position (m) and rotation vector (rad) of the newest pose from the goal, (6,)."""
        self.by_pose = by_pose
        """Derivatives of the cable lengths by the pose, (n, 6)."""
        self._newest, self._numbers = newest, numbers
        self._watch, self._latch = watch, latch
        self._moved = -np.linalg.pinv(by_pose)
        self._seen: TrackedPose | None = None
        self._low, self._time = self.error, math.nan
        self._errors: deque[Array] = deque(maxlen=_SHOWN)

    @property
    def mean_error(self) -> Array:
        """Mean of the newest 50 of :attr:`error`, (6,); NaN before the first."""
        return np.asarray(np.mean(list(self._errors) or [self.error], axis=0))

    def left(self, index: int) -> str:
        """Cable by which the platform is off its pose."""
        return f"{float(self.by_pose[index] @ self.error) * 1e3:+.2f} mm of cable"

    def speeds(self, time: float, now: float, wound: Array) -> Array | None:
        """Winding speeds (n,), m/s; None without a pose, or one that trips the bench."""
        newest = self._newest()
        if newest is not None and newest is not self._seen:
            self._seen, self.error = newest, self.deviation(newest)
            self._errors.append(self.error)
        trip = self._watch.at(now, newest, self.error, self._moved @ wound)
        if trip is not None:
            self._latch(trip)
            return None
        if math.isnan(self._time):
            self._low = self.error
        else:
            share = 1.0 - math.exp((self._time - time) / LOW_PASS)
            self._low = self._low + share * (self.error - self._low)
        self._time = time
        return np.asarray(self.by_pose @ self._low / TIME)

    def deviation(self, told: TrackedPose) -> Array:
        """Position (m) and rotation vector (rad) of a tracker's pose from the goal, (6,)."""
        turned = rotation_from_quaternion(np.array(told.quaternion)[None])
        pose = Pose(np.array(told.position)[None], turned)
        if self._numbers is not None:
            pose = pose_behind(self._numbers, pose)
        place = pose.position[0] - self.goal.position[0]
        turn = rotation_vector(pose.rotation @ self.goal.rotation[0].T)[0]
        return np.concatenate([place, turn])

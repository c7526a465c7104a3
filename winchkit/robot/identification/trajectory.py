"""Trajectory of a robot: samples in time with the motion of platform and winches.

Rows of a log are averaged over blocks in which no cable moves by more than 5 mm, a filter that all
channels pass alike. The platform's motion is that of the motor angles by the profile without
effects, or the measured one of a platform that hangs on few cables and can swing, smoothed; its
derivatives give the inertial forces and the distance by which a delayed tracker lags. Samples that
lack a channel take part in the motion and are not compared.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from winchkit.arrays import Array
from winchkit.diagnosis.data.sampling import bridged
from winchkit.errors import Fault, RunError
from winchkit.model.rotation import rotation_by, rotation_of, rotation_vector
from winchkit.model.smoothing_spline import SmoothingSpline
from winchkit.robot.dynamics.dynamics import PlatformMotion, dynamic_wrench
from winchkit.robot.dynamics.smoothed_motion import SmoothedMotion, smoothed_motion
from winchkit.robot.files.holds import averaged
from winchkit.robot.files.poses import MeasuredPoses, MotionSamples, joined
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot, robot_of
from winchkit.robot.geometry.tracker import pose_behind
from winchkit.robot.geometry.wrench import gravity_wrench
from winchkit.schema.profiles.robot import PlatformSpec, RobotProfile

_TRAVEL = 5e-3
"""Cable travel within a block, m: the second order of a length of 0.5 m is then 2 µm."""
_MOST = 300
"""Samples that are kept, every m-th block of a longer log."""
_LEAST = 50
"""Samples of a run from which its noise has a spectrum."""
_LEAST_KNOWN = 0.5
"""Share of finite values from which a channel is compared."""
_CHANNELS = ("position", "angles", "swivel", "cable_length", "tension")


@dataclass(frozen=True)
class SampledMotion:
    """Motion at the p samples of a data set, run after run."""

    time: Array
    """Since each run's start, (p,), s."""
    runs: tuple[slice, ...]
    """Samples of each run."""
    motor_rate: Array
    """(p, n), rad/s."""
    valid: NDArray[np.bool_]
    """Samples that have every compared channel, (p,)."""
    smoothed: tuple[SmoothedMotion, ...]
    """Of each run."""
    _shifts: dict[float, Array] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def motion(self) -> PlatformMotion:
        """Of all samples."""
        parts = [each.motion for each in self.smoothed]
        return PlatformMotion(
            Pose(
                np.concatenate([part.pose.position for part in parts]),
                np.concatenate([part.pose.rotation for part in parts]),
            ),
            np.concatenate([part.velocity for part in parts]),
            np.concatenate([part.acceleration for part in parts]),
        )

    def inertial_wrench(self, platform: PlatformSpec) -> Array:
        """Inertial forces on a platform about its origin, (p, 6), N and N m."""
        weight = gravity_wrench(platform, self.motion.pose.rotation)
        return np.asarray(dynamic_wrench(platform, self.motion) - weight)

    def force_std(self, platform: PlatformSpec) -> float:
        """Standard deviation of the inertial force by that of the acceleration, rms, N."""
        std = np.concatenate([each.acceleration_std[:, :3] for each in self.smoothed])
        return platform.mass * float(np.sqrt(np.mean(np.sum(std**2, axis=1))))

    def earlier(self, delay: float) -> Array:
        """Displacement to the pose of a time before, (p, 6): position, m, and rotation vector, rad;
        at a constant speed beyond the ends of a run."""
        if delay not in self._shifts:
            self._shifts.clear()
            parts = [
                _displacement(curve, self.time[rows], delay)
                for curve, rows in zip(self._curves, self.runs, strict=True)
            ]
            self._shifts[delay] = np.concatenate(parts)
        return self._shifts[delay]

    @cached_property
    def _curves(self) -> list[CubicSpline]:
        return [
            CubicSpline(self.time[rows], each.coordinates)
            for rows, each in zip(self.runs, self.smoothed, strict=True)
        ]


def _displacement(curve: CubicSpline, time: Array, delay: float) -> Array:
    inside = np.clip(time - delay, time[0], time[-1])
    here, beyond = curve(time), (time - delay - inside)[:, None]
    there = curve(inside) + beyond * curve(inside, 1)
    turned = rotation_by(there[:, 3:]) @ np.swapaxes(rotation_by(here[:, 3:]), 1, 2)
    return np.hstack([there[:, :3] - here[:, :3], rotation_vector(turned)])


def trajectory_of(
    samples: MotionSamples, profile: RobotProfile
) -> tuple[MeasuredPoses, SampledMotion]:
    """Samples that are compared, means over blocks, and the motion along them; raises RunError for
    a run with fewer than 50 samples, and where the motor angles fit no pose."""
    robot = robot_of(profile)
    rows = samples.measured
    parts, times, rates, motions, faults = [], [], [], [], []
    stride = max(1, -(-sum(map(len, _blocks(samples, robot))) // _MOST))
    for number, blocks in enumerate(_blocks(samples, robot)):
        kept = blocks[::stride]
        place = str(rows.place[blocks[0].start]).partition(" of ")[2] if blocks else ""
        if len(kept) < _LEAST:
            fault = f"only {len(kept)} samples in motion; at least {_LEAST} are needed"
            faults.append(Fault(fault, place))
            continue
        time = averaged(samples.time[:, None], kept)[:, 0]
        angle = averaged(_bridged(rows.motor_angle), kept)
        # The profile may be wrong by more than a robot in use: the pose that fits best.
        found = robot.poses_at(angle, tolerance=np.inf, search="outlying")
        missed = len(kept) - int(np.count_nonzero(found.converged))
        if missed:
            message = (
                f"the motor angles of {missed} of {len(kept)} samples fit no pose of the robot "
                f"'{profile.name}'; is this its profile, and are its lines those of the log?"
            )
            faults.append(Fault(message, place))
            continue
        moving = int(np.argmax(np.ptp(angle, axis=0)))
        spline = SmoothingSpline.fit(time, angle[:, moving])
        part = _averaged(rows, kept, angle, number)
        seen = _swinging(robot, part, found.pose) if robot.hangs else None
        if seen is None:
            motions.append(smoothed_motion(spline, found.pose))
        else:
            most = int(np.argmax(np.ptp(seen.position, axis=0)))
            own = SmoothingSpline.fit(time, seen.position[:, most])
            motions.append(smoothed_motion(own, seen))
        rates.append(np.stack([spline.smoothed(column, 1) for column in angle.T], axis=1))
        parts.append(part)
        times.append(time)
    if faults:
        raise RunError(faults)
    measured = replace(joined(parts), notes=rows.notes, session_of_run=rows.session_of_run)
    ends = np.cumsum([0, *map(len, parts)]).tolist()
    valid, measured = _compared(measured)
    runs = tuple(slice(a, b) for a, b in pairwise(ends))
    motion = SampledMotion(
        np.concatenate(times), runs, np.concatenate(rates), valid, tuple(motions)
    )
    return measured, motion


def _swinging(robot: Robot, measured: MeasuredPoses, still: Pose) -> Pose | None:
    """Measured poses of a hanging platform, which swings beside the pose of equilibrium that its
    motor angles determine (``still``, where a reading is missing); None where few were measured."""
    readings = np.hstack([measured.position, measured.angles])
    known = np.all(np.isfinite(readings), axis=1, keepdims=True)
    if np.mean(known) < _LEAST_KNOWN:
        return None
    seen = Pose(measured.position, rotation_of(*np.nan_to_num(measured.angles).T))
    if robot.tracker is not None:
        seen = pose_behind(robot.tracker, seen)
    position = np.where(known, seen.position, still.position)
    return Pose(position, np.where(known[..., None], seen.rotation, still.rotation))


def _blocks(samples: MotionSamples, robot: Robot) -> list[list[slice]]:
    """Blocks of rows of each run, of equal length, in which no cable, nor a hanging platform, moves
    by more than 5 mm."""
    rows, out = samples.measured, []
    for number in range(int(rows.run.max()) + 1):
        own = np.flatnonzero(rows.run == number)
        angle = _bridged(rows.motor_angle[own])
        travel = max(
            float(np.quantile(np.abs(np.diff(angle[:, i])), 0.99)) * abs(line.arm(0.0))
            for i, line in enumerate(robot.lines)
        )
        moved = np.linalg.norm(np.diff(rows.position[own], axis=0), axis=1)
        if robot.hangs and np.isfinite(moved).any():
            travel = max(travel, float(np.nanquantile(moved, 0.99)))
        size = int(np.clip(_TRAVEL / max(travel, 1e-9), 1, max(1, len(own) // _LEAST)))
        first = int(own[0])
        out.append([slice(at, at + size) for at in range(first, first + len(own) - size + 1, size)])
    return out


def _bridged(values: Array) -> Array:
    """Columns with missing values interpolated; a column without any stays."""
    return np.stack(
        [bridged(column) if np.isfinite(column).any() else column for column in values.T], axis=1
    )


def _averaged(rows: MeasuredPoses, blocks: list[slice], angle: Array, number: int) -> MeasuredPoses:
    """Means over blocks; NaN where one value of a block is missing."""
    means: dict[str, Any] = {}
    for name in (*_CHANNELS, "temperature"):
        values = getattr(rows, name)
        whole = np.stack([np.isfinite(values[block]).all(axis=0) for block in blocks])
        mean = averaged(values, blocks, angles=name in ("angles", "swivel"))
        means[name] = np.where(whole, mean, np.nan)
    return replace(
        rows,
        **means,
        motor_angle=angle,
        run=np.full(len(blocks), number, dtype=np.intp),
        place=rows.place[[block.start for block in blocks]],
    )


def _compared(measured: MeasuredPoses) -> tuple[NDArray[np.bool_], MeasuredPoses]:
    """Samples that have all channels which most samples have, and the values without rarer
    channels. All samples then have the same equations, as a spectrum over time needs; missing
    values are interpolated, and masked."""
    valid = np.ones(len(measured), dtype=bool)
    kept: dict[str, Any] = {}
    for name in _CHANNELS:
        values = getattr(measured, name)
        often = np.mean(np.isfinite(values), axis=0) > _LEAST_KNOWN
        valid &= np.isfinite(values[:, often]).all(axis=1)
        # A missing angle is masked, so that its branch does not matter.
        kept[name] = np.where(often, _bridged(values), np.nan)
    return valid, replace(measured, **kept)

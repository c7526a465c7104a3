"""Tests of a planned motion against the limits of the robot and of its winches."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import NotPermitted
from winchkit.robot.bench.trajectory import PlatformTrajectory
from winchkit.robot.dynamics.dynamics import dynamic_wrench
from winchkit.robot.forces.force_distribution import ForceLimits, closed_form, distributed_forces
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.workspace.distances import distances
from winchkit.schema.bench import LimitSpec
from winchkit.schema.robot_bench import RobotWiring

_NEARER = 1e-4
"""Approach of cables that are within the clearance where a motion begins, m, that is none (rule of
thumb): it may lead away from there."""
_STATIONS = 200
"""Of a trajectory at which a stop is tested, at most."""


@dataclass(frozen=True)
class _Exceeded:
    """A limit that is not kept, at a sample of a trajectory."""

    sample: int
    words: str


def require_within_limits(
    robot: Robot,
    planned: PlatformTrajectory,
    limits: Mapping[str, LimitSpec],
    wiring: RobotWiring,
) -> None:
    """Raise NotPermitted, with the place on the path, where a motion, or a stop on its way, would
    exceed a limit."""
    found = [
        *_length_faults(robot.names, planned, limits),
        *_rate_faults(robot.names, planned, limits),
        *_force_faults(robot, planned, ForceLimits(*wiring.tension), wiring.acceleration),
        *_clearance_faults(robot, planned, wiring),
    ]
    if not found:
        return
    first = min(found, key=lambda one: one.sample)
    raise NotPermitted(
        f"at {planned.distance[first.sample] * 1e3:.0f} mm of the path of "
        f"{planned.path.length * 1e3:.0f} mm, {place_of(planned.pose, first.sample)}: {first.words}"
    )


def place_of(pose: Pose, sample: int) -> str:
    """A position for messages."""
    x, y, z = pose.position[sample]
    return f"x {x:.3f} m, y {y:.3f} m, z {z:.3f} m"


def _length_faults(
    names: Sequence[str], planned: PlatformTrajectory, limits: Mapping[str, LimitSpec]
) -> Iterator[_Exceeded]:
    for i, name in enumerate(names):
        length = planned.length[:, i]
        if not np.all(np.isfinite(length)):
            sample = int(np.argmin(np.isfinite(length)))
            words = f"the anchor of cable {name} lies inside its pulley; choose another path"
            yield _Exceeded(sample, words)
            continue
        bounds = limits[name].length
        if bounds is None:
            continue
        beyond = (length < bounds[0]) | (length > bounds[1])
        if np.any(beyond):
            sample = int(np.argmax(beyond))
            words = (
                f"cable {name} would be {length[sample]:.3f} m long, limits.length of its winch "
                f"is {bounds[0]:g} m to {bounds[1]:g} m; choose another path"
            )
            yield _Exceeded(sample, words)


def _rate_faults(
    names: Sequence[str], planned: PlatformTrajectory, limits: Mapping[str, LimitSpec]
) -> Iterator[_Exceeded]:
    rate = np.gradient(planned.length, planned.time, axis=0)
    change = np.gradient(rate, planned.time, axis=0)
    for i, name in enumerate(names):
        for values, limit, what, unit in (
            (rate[:, i], limits[name].speed, "speed", "m/s"),
            (change[:, i], limits[name].acceleration, "acceleration", "m/s^2"),
        ):
            beyond = np.abs(values) > limit
            if np.any(beyond):
                sample = int(np.argmax(beyond))
                largest = float(np.max(np.abs(values)))
                words = (
                    f"{what} of cable {name} is {abs(values[sample]):.3g} {unit} there and "
                    f"{largest:.3g} {unit} at most, limits.{what} of its winch is {limit:g} "
                    f"{unit}; move at {limit / largest:.0%} of this {what}"
                )
                yield _Exceeded(sample, words)


def _force_faults(
    robot: Robot, planned: PlatformTrajectory, tension: ForceLimits, deceleration: float
) -> Iterator[_Exceeded]:
    """The planned motion at every sample, and a stop at up to 200 of them. The swinging of a
    hanging platform in a stop is not known."""
    without = np.flatnonzero(~np.isfinite(planned.force).all(axis=1))
    if len(without):
        wrench = dynamic_wrench(robot.platform, planned.motion)
        yield _without_forces(robot, planned, tension, wrench, int(without[0]))
    if robot.hangs:
        return
    first, _ = planned.path.derivatives(planned.distance)
    moving = np.where(planned.speed[:, None] > 0, 1.0, 0.0)
    braked = planned.motion.acceleration - deceleration * moving * first
    structure = robot.structure(planned.pose)
    wrench = dynamic_wrench(robot.platform, replace(planned.motion, acceleration=braked))
    count = len(planned.time)
    stations = np.unique(np.linspace(0, count - 1, min(count, _STATIONS)).astype(int))
    force = distributed_forces(structure[stations], wrench[stations], tension)
    without = stations[~np.isfinite(force).all(axis=1)]
    if len(without):
        k = int(without[0])
        yield _without_forces(robot, planned, tension, wrench, k, when=" during a stop")


def _clearance_faults(
    robot: Robot, planned: PlatformTrajectory, wiring: RobotWiring
) -> Iterator[_Exceeded]:
    """Cables that come nearer to each other or to a body than the clearance, and than they are. No
    point of the platform moves by more than a quarter of the clearance between two samples."""
    if wiring.clearance is None:
        return
    count = ceil(4 * planned.path.length / wiring.clearance) + 1
    places = np.linspace(0.0, planned.path.length, max(count, 2))
    stations = np.unique(np.searchsorted(planned.distance, places).clip(0, len(planned.time) - 1))
    pose = planned.pose[stations]
    found = distances(robot, wiring.body, pose, wiring.clearance)
    limit = np.minimum(wiring.clearance, found.distance[0] - _NEARER)
    for column in np.flatnonzero(np.any(found.distance < limit, axis=0)).tolist():
        row = int(np.argmax(found.distance[:, column] < limit[column]))
        words = f"{found.text(row, column)}; choose another path"
        yield _Exceeded(int(stations[row]), words)


def _without_forces(
    robot: Robot,
    planned: PlatformTrajectory,
    tension: ForceLimits,
    wrench: Array,
    k: int,
    *,
    when: str = "",
) -> _Exceeded:
    """The cable that is farthest beyond its limits, of the forces nearest to their middle."""
    if robot.hangs:
        return _Exceeded(
            k,
            f"the platform has no stable rest there with cable forces from {tension.low:g} N to "
            f"{tension.high:g} N; choose another path, or other limits `tension` of [robot]",
        )
    nearest = closed_form(robot.structure(planned.pose)[k], wrench[k], tension).value
    low, high = tension.spread(len(robot.names))
    i = int(np.argmax(np.maximum(low - nearest, nearest - high)))
    limit = low[i] if nearest[i] < low[i] else high[i]
    return _Exceeded(
        k,
        f"no cable forces from {low[i]:g} N to {high[i]:g} N hold the platform{when}; cable "
        f"{robot.names[i]} would need {nearest[i]:.0f} N, limit {limit:g} N; choose another path, "
        "a lower acceleration, or other limits `tension` of [robot]",
    )

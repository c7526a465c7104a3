"""Plans motions of a platform within the limits of a bench file; needs no open bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arguments import number, positive
from winchkit.arrays import Array
from winchkit.bench.robot import no_robot
from winchkit.errors import NotPermitted, UsageError
from winchkit.model.rotation import angles_of, rotation_of
from winchkit.robot.bench.checks import require_within_limits
from winchkit.robot.bench.path import Waypoint, paths_through
from winchkit.robot.bench.trajectory import PlatformTrajectory, plan_along
from winchkit.robot.bench.wiring import robot_of_bench
from winchkit.robot.forces.force_distribution import ForceLimits
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.bench import BenchSpec, LimitSpec
from winchkit.schema.profiles.robot import COORDINATES
from winchkit.schema.robot_bench import RobotWiring

_GUIDED = 1e-6
"""Difference from a coordinate that guides hold, m and rad, that is rounding."""


@dataclass(frozen=True)
class Planner:
    """A robot with the limits of its platform and of its winches."""

    robot: Robot
    wiring: RobotWiring
    limits: Mapping[str, LimitSpec]
    """By line."""

    @classmethod
    def of(cls, spec: BenchSpec) -> Planner:
        """The robot of a bench file; raises UsageError where it declares none."""
        robot = robot_of_bench(spec)
        if robot is None or spec.robot is None:
            raise no_robot(spec)
        return cls(robot, spec.robot, {name: spec.winch[name].limits for name in robot.names})

    @property
    def tension(self) -> ForceLimits:
        """Limits of the force distribution, N."""
        return ForceLimits(*self.wiring.tension)

    def plan(
        self,
        waypoints: Sequence[Waypoint],
        start: Pose,
        speed: float | None = None,
        acceleration: float | None = None,
    ) -> list[PlatformTrajectory]:
        """Plan motions through waypoints, with a stop at each that is not blended, and compare them
        with all limits; speed (m/s) and acceleration (m/s²) are by default those of ``[robot]``.
        Raises UsageError for what is no pose, or no number; NotPermitted for a limit that would be
        exceeded on the way, or by a stop."""
        for waypoint in waypoints:
            if not all(np.isfinite(part).all() for part in (waypoint.position, waypoint.rotation)):
                raise UsageError("move: a pose with numbers that are not finite is no goal")
            self._require_free(Pose(waypoint.position[None], waypoint.rotation[None]))
        wiring = self.wiring
        fast = _within("speed", speed, wiring.speed, "m/s")
        ramp = _within("acceleration", acceleration, wiring.acceleration, "m/s^2")
        scale = wiring.speed / wiring.rotation_speed
        # Rotation counts as ρ times its angle: its acceleration is limited with that of the path.
        turning = wiring.rotation_acceleration * scale
        out = []
        for path in paths_through(start, waypoints, scale):
            one = plan_along(self.robot, path, self.tension, fast, min(ramp, turning))
            require_within_limits(self.robot, one, self.limits, wiring)
            out.append(one)
        return out

    def _require_free(self, goal: Pose) -> None:
        """Raise NotPermitted for a goal that the platform's guides do not permit."""
        robot = self.robot
        held = coordinates_of(robot.guided(goal))
        for name, value in coordinates_of(goal).items():
            if abs(value - held[name]) > _GUIDED:
                raise NotPermitted(
                    f"the platform of '{robot.profile.name}' moves in "
                    f"{', '.join(robot.platform.degrees_of_freedom)} alone; its guides hold {name} "
                    f"at {held[name]:.4g}, and the goal has {value:.4g} (m, rad)"
                )


def moved(pose: Pose, change: Mapping[str, float], *, relative: bool) -> Pose:
    """A pose with some of its coordinates replaced or changed."""
    new = _six(pose)
    for name, value in change.items():
        if name not in COORDINATES:
            raise UsageError(f"'{name}' is no coordinate of a pose: {', '.join(COORDINATES)}")
        index = COORDINATES.index(name)
        new[index] = number("move", name, value) + (new[index] if relative else 0.0)
    return Pose(new[None, :3], rotation_of(*new[3:])[None])


def coordinates_of(pose: Pose) -> dict[str, float]:
    """One pose as x, y, z (m), roll, pitch and yaw (rad)."""
    return {name: float(value) for name, value in zip(COORDINATES, _six(pose), strict=True)}


def _six(pose: Pose) -> Array:
    return np.concatenate([pose.position[0], angles_of(pose.rotation)[0]])


def _within(name: str, asked: float | None, limit: float, unit: str) -> float:
    """The asked value, or the limit; raises NotPermitted beyond it."""
    if asked is None:
        return limit
    if positive("move", name, asked) > limit:
        raise NotPermitted(
            f"{name} {asked:g} {unit} of the platform is not within the limit {limit:g} {unit} of "
            "[robot]"
        )
    return asked

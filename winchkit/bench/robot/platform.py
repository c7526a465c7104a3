"""The platform of a robot as its user moves it: ``bench.robot``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.common_move import wait_together
from winchkit.bench.control.motion import StartGate
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.host import WinchHost
from winchkit.bench.robot.checks import require_within_limits
from winchkit.bench.robot.motion import CableMotion, PathTime
from winchkit.bench.robot.path import Waypoint, paths_through
from winchkit.bench.robot.trajectory import PlatformTrajectory, plan_along
from winchkit.errors import NotPermitted
from winchkit.model.robot import ForceLimits, Pose, Robot, angles_of, rotation_of
from winchkit.schema.robot_bench import RobotWiring

if TYPE_CHECKING:
    from winchkit.bench.winch import Winch

__all__ = ["Platform", "moved"]

_AGREE = 0.02
"""Largest difference between a cable length by its drum and by the geometry at the pose that fits
all cables best, m: a larger one is a wrong reference, a slipped or a slack cable."""
_COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


def moved(pose: Pose, change: Mapping[str, float], *, relative: bool) -> Pose:
    """A pose with some coordinates replaced or changed, as :meth:`Platform.moved`."""
    new = _six(pose)
    for name, value in change.items():
        index = _COORDINATES.index(name)
        new[index] = value + (new[index] if relative else 0.0)
    return Pose(new[None, :3], rotation_of(*new[3:])[None])


class Platform:
    """The platform that the winches of a bench move together.

    All winches start in one cycle, and their targets of a cycle belong to one pose. The profile of
    the robot, not those of the bench file, has the winches' drums.
    """

    def __init__(
        self, bench: WinchHost, wiring: RobotWiring, robot: Robot, winches: Mapping[str, Winch]
    ) -> None:
        """Take the winches of the robot's lines by name."""
        self.robot = robot
        self.wiring = wiring
        self._bench = bench
        self._winches = [winches[name] for name in robot.names]
        self._limits = {one.name: one.wiring.limits for one in self._winches}
        self.tension = ForceLimits(*wiring.tension)
        """Limits of the force distribution, N."""

    @property
    def pose(self) -> Pose:
        """Pose by the motor angles, one; raises NotPermitted where they fit no pose."""
        angles = self._angles()
        found = self.robot.poses_at(angles)
        if found.converged[0]:
            found = self.robot.poses_at(angles, found.pose, self._forces(found.pose))
        if not found.converged[0]:
            raise NotPermitted(
                f"no pose of the platform has the motor angles of robot "
                f"'{self.robot.profile.name}'; home the winches: `winchkit home WINCH --here "
                "LENGTH`"
            )
        worst = int(np.argmax(np.abs(found.residual[0])))
        size = abs(float(found.residual[0][worst]))
        if size > _AGREE:
            raise NotPermitted(
                f"the cables fit no pose: cable {self.robot.names[worst]} differs by "
                f"{size * 1e3:.0f} mm from the pose that fits all best (limit {_AGREE * 1e3:.0f} "
                "mm); home the winches, and look for a slack cable"
            )
        return found.pose

    def coordinates(self) -> dict[str, float]:
        """The pose as x, y, z (m), roll, pitch and yaw (rad)."""
        return {
            name: float(value) for name, value in zip(_COORDINATES, _six(self.pose), strict=True)
        }

    def moved(self, change: Mapping[str, float], *, relative: bool) -> Pose:
        """The present pose with some of its coordinates replaced or changed.

        Parameters
        ----------
        change : mapping of str to float
            ``x``, ``y``, ``z`` in m, ``roll``, ``pitch``, ``yaw`` in rad.
        relative : bool
            Whether they are added.

        Returns
        -------
        Pose
            One pose.
        """
        return moved(self.pose, change, relative=relative)

    @property
    def moving(self) -> bool:
        """Whether a motion is under way."""
        return any(winch.moving for winch in self._winches)

    def planned(
        self,
        waypoints: Sequence[Waypoint],
        speed: float | None = None,
        acceleration: float | None = None,
        start: Pose | None = None,
    ) -> list[PlatformTrajectory]:
        """Plan motions through waypoints and compare them with all limits; nothing moves.

        Parameters
        ----------
        waypoints : sequence of Waypoint
            Poses to go to; the platform stops at each that is not blended.
        speed, acceleration : float, optional
            Of the platform, m/s and m/s²; by default the limits of ``[robot]``.
        start : Pose, optional
            Pose at which it begins; by default the present one.

        Returns
        -------
        list of PlatformTrajectory
            One from each stop to the next.

        Raises
        ------
        NotPermitted
            For a limit that would be exceeded on the way, or by a stop.
        """
        if len(self.robot.names) < 6:
            raise NotPermitted(
                f"robot '{self.robot.profile.name}' has {len(self.robot.names)} cables, which do "
                "not determine the rotation of its platform; moves along a path need at least 6"
            )
        wiring = self.wiring
        fast = _within("speed", speed, wiring.speed, "m/s")
        ramp = _within("acceleration", acceleration, wiring.acceleration, "m/s^2")
        scale = wiring.speed / wiring.rotation_speed
        # Rotation counts as ρ times its angle: its acceleration is limited with that of the path.
        ramp = min(ramp, wiring.rotation_acceleration * scale)
        paths = paths_through(start or self.pose, waypoints, scale)
        out = []
        for path in paths:
            one = plan_along(self.robot, path, self.tension, fast, ramp)
            require_within_limits(self.robot, one, self._limits, self.tension, wiring.acceleration)
            out.append(one)
        return out

    def move(
        self,
        goal: Pose,
        speed: float | None = None,
        acceleration: float | None = None,
        *,
        wait: bool = True,
        hold: bool = False,
    ) -> None:
        """Move the platform on a line to a pose; raises NotPermitted before anything moves.

        Parameters
        ----------
        goal : Pose
            One pose.
        speed, acceleration : float, optional
            m/s and m/s²; by default the limits of ``[robot]``.
        wait : bool
            Return when it stands still.
        hold : bool
            Keep the drives enabled at the end.
        """
        waypoint = Waypoint(goal.position[0], goal.rotation[0])
        for planned in self.planned([waypoint], speed, acceleration):
            self.begin(planned, hold=hold)
            if wait:
                self.wait()

    def begin(self, planned: PlatformTrajectory, *, hold: bool = False) -> None:
        """Begin a planned motion; all winches start in one cycle.

        Parameters
        ----------
        planned : PlatformTrajectory
            A motion that begins at the present pose.
        hold : bool
            Keep the drives enabled at the end.
        """
        from scipy.interpolate import CubicSpline

        angles = planned.motor_angle - planned.motor_angle[0] + self._angles()[0]
        self._permit(planned, angles)
        curve = CubicSpline(planned.time, angles, bc_type="clamped")
        clock = PathTime(planned, self.wiring.acceleration)
        step = float(planned.time[1])
        sources = {
            winch: CableMotion(clock, curve.c[:, :, i], step, winch.cable, holds=hold)
            for i, winch in enumerate(self._winches)
        }
        gate = StartGate([partial(winch.ready_for, source) for winch, source in sources.items()])
        with self._bench.loop.ordering:
            for winch, source in sources.items():
                winch.begin(source, gate)

    def wait(self) -> None:
        """Return at the end of the motion; raises what ended it before."""
        wait_together(self._bench.loop, self._winches, self._bench.clock)

    def _permit(self, planned: PlatformTrajectory, angles: Array) -> None:
        """Raise what forbids a motion of one of the winches."""
        for i, winch in enumerate(self._winches):
            winch.require_length()
            for angle in (float(angles[:, i].min()), float(angles[:, i].max())):
                self._bench.axes[winch.name].permit_angle(angle)
            change = np.diff(planned.length[:, i])
            for direction, goes in (
                (Direction.PAY_OUT, bool(np.any(change > 0))),
                (Direction.WIND_IN, bool(np.any(change < 0))),
            ):
                self._bench.permit(winch.name, direction if goes else Direction.NONE)

    def _angles(self) -> Array:
        snapshot = self._bench.snapshot
        return np.array([[snapshot.winch[one.name].motor_angle for one in self._winches]])

    def _forces(self, pose: Pose) -> Array:
        """Cable forces of the plan at a pose at rest, (1, n); zero where there are none."""
        from winchkit.model.robot import quadratic

        if len(self.robot.names) < 6:
            return np.zeros((1, len(self.robot.names)))
        found = quadratic(self.robot.structure(pose)[0], self.robot.weight(pose)[0], self.tension)
        return (found.value if found.feasible else np.zeros_like(found.value))[None]


def _six(pose: Pose) -> Array:
    """Coordinates of one pose."""
    return np.concatenate([pose.position[0], angles_of(pose.rotation)[0]])


def _within(name: str, asked: float | None, limit: float, unit: str) -> float:
    """The asked value, or the limit; raises NotPermitted beyond it."""
    if asked is None:
        return limit
    if not 0 < asked <= limit:
        raise NotPermitted(
            f"{name} {asked:g} {unit} of the platform is not within the limit {limit:g} {unit} of "
            "[robot]"
        )
    return asked

"""The pose and the winches of a platform on an open bench."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.common_move import wait_together
from winchkit.bench.control.motion import MotionSource, StartGate
from winchkit.bench.host import WinchHost
from winchkit.errors import NotPermitted, UsageError
from winchkit.model.rotation import rotation_vector
from winchkit.robot.bench.planner import Planner, coordinates_of, moved
from winchkit.robot.dynamics.rest import rest_poses
from winchkit.robot.forces.force_distribution import quadratic
from winchkit.robot.geometry.candidates import distance
from winchkit.robot.geometry.forward import AGREEMENT, PosesFound
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.robot_bench import RobotWiring

if TYPE_CHECKING:
    from winchkit.bench.winch import Winch
    from winchkit.robot.bench.trajectory import PlatformTrajectory

_NEAR = 0.1
"""Distance and rotation from the pose that was found last, m and rad, up to which the next one is
computed from it without a search (rule of thumb: a platform does not turn to another solution of
its lengths within so little)."""
_UPRIGHT = 0.35
"""Rotation from home, rad, up to which the pose found by an iteration from home is the platform's:
from within a spacing of the lattice of starts 99 % end in the solution."""


class PlatformPose:
    """Pose of the platform by the motor angles, and the common start of its winches."""

    def __init__(
        self, bench: WinchHost, wiring: RobotWiring, robot: Robot, winches: Mapping[str, Winch]
    ) -> None:
        """Take the winches of the robot's lines by name."""
        self.robot = robot
        self._bench = bench
        self._last: Pose | None = None
        self._planned: PlatformTrajectory | None = None
        """The motion that began last: the platform is on its path, or left it since."""
        self._winches = [winches[name] for name in robot.names]
        self.planner = Planner(
            robot, wiring, {one.name: one.wiring.limits for one in self._winches}
        )
        """Plans its motions within the limits."""

    def permit_tension(self, winch: str) -> None:
        """Raise NotPermitted where a winch may not control its tension beside those that do.

        The others hold its degrees of freedom, one cable each at least.

        Parameters
        ----------
        winch : str
            One of the robot's.
        """
        if winch not in self.robot.names:
            return
        count = len(self._winches)
        free = max(0, count - self.robot.geometry.degrees)
        held = [one.name for one in self._winches if one.holds_tension and one.name != winch]
        if len(held) + 1 > free:
            beside = f" beside {', '.join(held)}" if held else ""
            raise NotPermitted(
                f"winch {winch} may not hold its tension{beside}: of the {count} cables of robot "
                f"'{self.robot.profile.name}' the platform leaves {free} free, the others "
                "hold it; `winchkit hold-platform` holds those of all"
            )

    @property
    def pose(self) -> Pose:
        """Pose by the motor angles, one.

        Raises NotPermitted where they fit no pose, or two that the cables can hold.
        """
        angles = self._angles_without_trims()
        for start in self._starts(angles):
            pulled = self._forces(start)
            found = self.robot.poses_at(angles, start, pulled, tolerance=np.inf, search=np.inf)
            if self._continues(found, start):
                break
        else:
            found = self.robot.poses_at(angles, None, pulled, tolerance=np.inf, search=-1.0)
            self._require_one(found)
        if np.isfinite(found.pose.position).all():
            forces = self._forces(found.pose)
            found = self.robot.poses_at(angles, found.pose, forces, search=np.inf)
        self._last = found.pose if found.converged[0] else None
        if self._last is not None:
            return self._last
        words = f"no pose of the platform has the motor angles of robot '{self.robot.profile.name}'"
        size = np.abs(found.residual[0])
        if np.isfinite(size).all():
            worst = int(np.argmax(size))
            words = (
                f"the cables fit no pose: cable {self.robot.names[worst]} differs by "
                f"{size[worst] * 1e3:.0f} mm from the pose that fits all best (limit "
                f"{AGREEMENT * 1e3:.0f} mm)"
            )
        raise NotPermitted(
            f"{words}; home the winches, and look for a slack cable: `winchkit home WINCH --here "
            "LENGTH`"
        )

    def _starts(self, angles: Array) -> Iterator[Pose]:
        """The pose that was found last, or home, and the nearest one of the last motion's path."""
        yield self._last or self.robot.home
        if self._planned is not None:
            off = np.abs(self._planned.motor_angle - angles).max(axis=1)
            nearest = int(np.argmin(off))
            yield self._planned.pose[nearest : nearest + 1]

    def _continues(self, found: PosesFound, start: Pose) -> bool:
        """Whether an iteration from a pose of the platform, or from home, ended beside it."""
        if start is not self.robot.home:
            return bool(distance(found.pose, start)[0] <= _NEAR)
        turned = distance(Pose(start.position, found.pose.rotation), start)
        return bool(turned[0] <= _UPRIGHT and np.all(np.abs(found.residual[0]) <= AGREEMENT))

    def _require_one(self, found: PosesFound) -> None:
        """Raise NotPermitted where the lengths fit a second pose that the cables can hold, too."""
        if not np.isfinite(found.other.position).all() or not self._forces(found.other).any():
            return
        one, two = (
            f"x, y, z {', '.join(f'{x:.3f}' for x in pose.position[0])} m with a rotation of "
            f"{np.degrees(np.linalg.norm(rotation_vector(pose.rotation)[0])):.0f} deg"
            for pose in (found.pose, found.other)
        )
        raise NotPermitted(
            f"the cable lengths fit two poses of the platform that the cables can hold: {one}, or "
            f"{two}; move single winches until it is nearer to its home pose"
        )

    def coordinates(self) -> dict[str, float]:
        """The pose as x, y, z (m), roll, pitch and yaw (rad)."""
        return coordinates_of(self.pose)

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

    def _start(self, sources: Sequence[MotionSource]) -> None:
        """Begin the motion of each winch, all in one cycle."""
        pairs = list(zip(self._winches, sources, strict=True))
        gate = StartGate([partial(winch.ready_for, source) for winch, source in pairs])
        with self._bench.loop.ordering:
            for winch, source in pairs:
                winch.begin(source, gate)

    def wait(self) -> None:
        """Return at the end of the motion; raises what ended it before."""
        self._bench.loop.require_other_thread("wait")
        wait_together(self._bench.loop, self._winches, self._bench.clock)

    def _angles(self) -> Array:
        snapshot = self._bench.snapshot
        return np.array([[snapshot.winch[one.name].motor_angle for one in self._winches]])

    def _angles_without_trims(self) -> Array:
        """Motor angles without the corrections of the forces: these elongate cables, no more."""
        seen = self._bench.snapshot.winch
        shown = [seen[winch.name] for winch in self._winches]
        return np.array([[one.motor_angle - one.trim_angle for one in shown]])

    def _forces(self, pose: Pose) -> Array:
        """Cable forces of the plan at a pose at rest, (1, n); zero where there are none."""
        if self.robot.hangs:
            rest = rest_poses(self.robot, pose)
            return np.where(rest.stable[:, None], rest.force, 0.0)
        found = quadratic(
            self.robot.structure(pose)[0], self.robot.weight(pose)[0], self.planner.tension
        )
        return (found.value if found.feasible else np.zeros_like(found.value))[None]


def require_finite(name: str, values: Array | None) -> None:
    """Raise UsageError for numbers that are not finite, such as those of a cell without reading."""
    if values is not None and not np.isfinite(values).all():
        raise UsageError(f"{name} has numbers that are not finite: {values}")

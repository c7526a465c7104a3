"""The platform of a robot as its user moves it: ``bench.robot``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import scipy.optimize  # loaded with the robot: in motion an import delays the loop
import scipy.spatial.transform  # noqa: F401
from scipy.interpolate import CubicSpline

from winchkit.arguments import positive, require_type
from winchkit.arrays import Array
from winchkit.bench.common_move import wait_together
from winchkit.bench.control.motion import MotionSource, StartGate
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.control.tension_control import greatest_stiffness
from winchkit.bench.host import WinchHost
from winchkit.errors import NotPermitted, UsageError
from winchkit.model.rotation import rotation_vector
from winchkit.robot.bench.motion import CableMotion, PathTime
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.planner import Planner, coordinates_of, moved
from winchkit.robot.bench.quick_stop import quick_stop_ramps
from winchkit.robot.bench.tension_trim import CableTrim, ForceTrim, TrimSetting
from winchkit.robot.bench.trajectory import PlatformTrajectory
from winchkit.robot.dynamics.rest import rest_poses
from winchkit.robot.forces.force_distribution import null_space, quadratic
from winchkit.robot.geometry.forward import AGREEMENT, Found, distance
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.robot_bench import RobotWiring

if TYPE_CHECKING:
    from winchkit.bench.winch import Winch

_NEAR = 0.1
"""Distance and rotation from the pose that was found last, m and rad, up to which the next one is
computed from it without a search (rule of thumb: a platform does not turn to another solution of
its lengths within so little)."""
_UPRIGHT = 0.35
"""Rotation from home, rad, up to which the pose found by an iteration from home is the platform's:
from within a spacing of the lattice of starts 99 % end in the solution."""
_TRIM_TRAVEL = 0.01
"""Of each cable in a correction of the forces, m: half of the difference of the lengths above which
they fit no pose."""
_TRIM_SPEED, _TRIM_TIME = 0.005, 5.0
"""m/s and s."""


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
        self._bench = bench
        self._last: Pose | None = None
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
                "hold it; use tension_trim of [robot] to correct the tensions of all"
            )

    @property
    def pose(self) -> Pose:
        """Pose by the motor angles, one.

        Raises NotPermitted where they fit no pose, or two that the cables can hold.
        """
        angles, start = self._angles(), self._last or self.robot.home
        found = self.robot.poses_at(angles, start, tolerance=np.inf, search=np.inf)
        if not self._continues(found):
            found = self.robot.poses_at(angles, tolerance=np.inf, search=-1.0)
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

    def _continues(self, found: Found) -> bool:
        """Whether an iteration from the last pose, or from home, ended in the same solution."""
        if self._last is not None:
            return bool(distance(found.pose, self._last)[0] <= _NEAR)
        turned = distance(Pose(self.robot.home.position, found.pose.rotation), self.robot.home)
        return bool(turned[0] <= _UPRIGHT and np.all(np.abs(found.residual[0]) <= AGREEMENT))

    def _require_one(self, found: Found) -> None:
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

    def move(
        self,
        goal: Pose,
        speed: float | None = None,
        acceleration: float | None = None,
        *,
        wait: bool = True,
        hold: bool = False,
    ) -> None:
        """Move the platform on a line to a pose.

        Raises UsageError for numbers that cannot be meant, and NotPermitted, before anything moves.

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
        require_type(goal, Pose, "goal")
        if wait:
            self._bench.loop.require_other_thread("move")
        waypoint = Waypoint(goal.position[0], goal.rotation[0])
        for planned in self.planner.plan([waypoint], self.pose, speed, acceleration):
            self.begin(planned, hold=hold)
            if wait:
                self.wait()

    def begin(
        self,
        planned: PlatformTrajectory,
        *,
        hold: bool = False,
        preload: Array | None = None,
    ) -> Array:
        """Begin a planned motion; all winches start in one cycle.

        Parameters
        ----------
        planned : PlatformTrajectory
            A motion that begins at the present pose.
        hold : bool
            Keep the drives enabled at the end.
        preload : (n,) array, optional
            Motor angles at its end less those of the plan, rad; by default those at its beginning.
            What differs at the beginning is removed in proportion to the travelled path. Where
            ``[robot]`` declares ``tension_trim``, the last correction of the forces is kept.

        Returns
        -------
        (n,) array
            That difference, for the next motion of a series: it is the preload of the cables that
            the plan does not describe, and is to stay.

        Raises
        ------
        UsageError
            For what is no plan, or a preload that is not finite.
        NotPermitted
            For a winch that may not move.
        """
        require_type(planned, PlatformTrajectory, "planned")
        _require_finite("preload", preload)
        present = self._angles()[0] - planned.motor_angle[0]
        kept: Array = present
        if preload is not None and not self.planner.wiring.tension_trim:
            kept = preload
        share = planned.distance[:, None] / planned.path.length
        angles = planned.motor_angle + present + share * (kept - present)
        self._permit(planned, angles)
        self._scale_quick_stops(planned)
        curve = CubicSpline(planned.time, angles, bc_type="clamped")
        clock = PathTime(planned, self.planner.wiring.acceleration)
        step = float(planned.time[1])
        trims: list[CableTrim] | list[None] = [None] * len(self._winches)
        if self.planner.wiring.tension_trim:
            trims = self._trims(
                Pose(planned.pose.position[-1:], planned.pose.rotation[-1:]),
                planned.force[-1],
                hold=hold,
            )
        self._start(
            [
                CableMotion(clock, curve.c[:, :, i], step, winch.cable, holds=hold, trim=trim)
                for i, (winch, trim) in enumerate(zip(self._winches, trims, strict=True))
            ]
        )
        return kept

    def trim(
        self,
        *,
        duration: float = _TRIM_TIME,
        travel: float = _TRIM_TRAVEL,
        speed: float = _TRIM_SPEED,
        axial_stiffness: float | None = None,
        keep: Array | None = None,
        wait: bool = True,
        hold: bool = False,
    ) -> None:
        """Correct the cable forces at rest toward the force distribution of the present pose.

        The measured deviation is corrected as far as it is of forces that balance each other; the
        pose stays. Without a valid reading of every cable nothing moves. Where the travel is used
        up for 0.5 s the bench trips.

        Parameters
        ----------
        duration : float
            s.
        travel : float
            Of each cable, either way, m.
        speed : float
            Of each cable, m/s.
        axial_stiffness : float, optional
            Upper bound for the cables, N; by default that of the profile, else of a steel bar.
        keep : (n,) array, optional
            Forces beside the distribution that are to stay, N, such as :meth:`force_deviation` had
            them at another pose.
        wait : bool
            Return when all winches are at rest.
        hold : bool
            Keep the drives enabled at the end.

        Raises
        ------
        UsageError
            For numbers that cannot be meant.
        NotPermitted
            Where there is no force distribution within the limits, or a winch may not move or has
            no load cell.
        """
        given = {"duration": duration, "travel": travel, "speed": speed}
        if axial_stiffness is not None:
            given["axial_stiffness"] = axial_stiffness
        for name, value in given.items():
            positive("trim", name, value)
        _require_finite("keep", keep)
        if wait:
            self._bench.loop.require_other_thread("trim")
        pose = self.pose
        force = self._forces(pose)[0]
        if not force.any():
            raise NotPermitted(
                "no cable forces within the limits `tension` of [robot] hold the platform here; "
                "move it, or change the limits"
            )
        if keep is not None:
            force = force + self._balanced(pose) @ keep
        for winch in self._winches:
            self._bench.permit(winch.name, Direction.BOTH)
        self._start(
            self._trims(
                pose,
                force,
                duration=duration,
                travel=travel,
                speed=speed,
                axial_stiffness=axial_stiffness,
                hold=hold,
            )
        )
        if wait:
            self.wait()

    def force_deviation(self) -> Array:
        """Measured cable forces less the distribution of the present pose, (n,), N.

        As far as they balance each other: the preload that the plan does not describe. NaN where a
        winch has no valid reading.
        """
        pose = self.pose
        measured = self._readings(self._bench.clock.now())
        return np.asarray(self._balanced(pose) @ (measured - self._forces(pose)[0]))

    def _balanced(self, pose: Pose) -> Array:
        """Projection on the forces that balance each other at a pose, (n, n)."""
        null = null_space(self.robot.structure(pose)[0])
        return np.asarray(null @ null.T)

    def _readings(self, now: float) -> Array:
        """Valid tensions at the platform end, (n,), N; NaN without one."""
        out = np.full(len(self._winches), np.nan)
        for i, winch in enumerate(self._winches):
            cell, reading = winch.load_cell, winch.tension_reading(now)
            if cell is not None and reading.age <= cell.max_age:
                out[i] = reading.value
        return out

    def _trims(
        self,
        pose: Pose,
        force: Array,
        *,
        duration: float = _TRIM_TIME,
        travel: float = _TRIM_TRAVEL,
        speed: float = _TRIM_SPEED,
        axial_stiffness: float | None = None,
        hold: bool,
    ) -> list[CableTrim]:
        """A correction toward cable forces (n,) at a pose, of each winch."""
        robot, winches = self.robot, self._winches
        cells = [winch.load_cell for winch in winches]
        for winch, cell in zip(winches, cells, strict=True):
            winch.require_length()
            if cell is None:
                raise NotPermitted(
                    f"winch {winch.name} has no load cell; the cable forces of a platform are "
                    "corrected by those of all its winches"
                )
        lengths = robot.lengths(pose)[0].tolist()
        stiffness = []
        for line, length in zip(robot.lines, lengths, strict=True):
            cable = line.profile.cable
            bound = (
                None if axial_stiffness is None else axial_stiffness / (length + cable.dead_length)
            )
            stiffness.append(greatest_stiffness(cable, length, bound))
        self._require_torque(force)
        limits = [winch.wiring.limits for winch in winches]
        ages = [cell.max_age for cell in cells if cell is not None]
        setting = TrimSetting(
            robot.names,
            force,
            self._balanced(pose),
            np.array(stiffness),
            max(ages) + max(one.response_time for one in limits),
            travel,
            speed,
            duration,
        )

        def trip(index: int, words: str) -> None:
            winches[index].trip_tension(words)

        common = ForceTrim(setting, limits, self._readings, trip)
        return [CableTrim(common, i, winch.cable, holds=hold) for i, winch in enumerate(winches)]

    def _require_torque(self, force: Array) -> None:
        """Raise NotPermitted where a drive's torque does not hold a cable force (n,)."""
        angles = self._angles()[0].tolist()
        for winch, pull, angle in zip(self._winches, force.tolist(), angles, strict=True):
            drive = self._bench.axes[winch.name].drive
            most = float("nan") if drive is None else drive.limits.torque
            torque = pull * abs(winch.cable.at(angle)[1])
            if torque > most:
                raise NotPermitted(
                    f"winch {winch.name}: the cable force {pull:.0f} N, of the limits `tension` of "
                    f"[robot], needs {torque:.3g} N m at its motor, and the drive gives "
                    f"{most:.3g} N m at most (6072h); lower `tension` of [robot]"
                )

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

    def _scale_quick_stops(self, planned: PlatformTrajectory) -> None:
        """Set the drives' 6085h for this motion, where [robot] declares `quick_stop`."""
        deceleration = self.planner.wiring.quick_stop
        if deceleration is None:
            return
        pairs = zip(self._winches, planned.motor_angle[0].tolist(), strict=True)
        arms = np.array([abs(winch.cable.at(angle)[1]) for winch, angle in pairs])
        ramps = quick_stop_ramps(planned, arms, deceleration).tolist()
        for winch, ramp in zip(self._winches, ramps, strict=True):
            self._bench.axes[winch.name].set_quick_stop(ramp)

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
        if self.robot.hangs:
            rest = rest_poses(self.robot, pose)
            return np.where(rest.stable[:, None], rest.force, 0.0)
        found = quadratic(
            self.robot.structure(pose)[0], self.robot.weight(pose)[0], self.planner.tension
        )
        return (found.value if found.feasible else np.zeros_like(found.value))[None]


def _require_finite(name: str, values: Array | None) -> None:
    """Raise UsageError for numbers that are not finite, such as those of a cell without reading."""
    if values is not None and not np.isfinite(values).all():
        raise UsageError(f"{name} has numbers that are not finite: {values}")

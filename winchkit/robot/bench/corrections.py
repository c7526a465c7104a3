"""Corrections of the platform of an open bench: their loops by its cells, winches and tracker."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.tension_control import SOFTER, greatest_stiffness
from winchkit.bench.host import WinchHost
from winchkit.bench.tracker import TrackerReceiver
from winchkit.bench.winch import Winch
from winchkit.errors import NotPermitted
from winchkit.robot.bench.balance_check import (
    MOST,
    BalanceCheck,
    check_of,
    declared_friction,
    sources_of,
)
from winchkit.robot.bench.correction import Bounds, Correction, Loop
from winchkit.robot.bench.force_loop import ForceLoop, ForceSetting, PathForces
from winchkit.robot.bench.path_time import PathTime
from winchkit.robot.bench.pose_loop import PoseLoop, TrackerLimits, TrackerWatch
from winchkit.robot.bench.trajectory import PlatformTrajectory
from winchkit.robot.forces.force_distribution import null_space
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.profiles.instruments import UNKNOWN
from winchkit.schema.robot_bench import RobotWiring

TRAVEL = 0.01
"""Of each cable in a correction, m: half of the difference of the lengths above which they fit no
pose."""
_ALONG_SPEED, _ALONG_END = 0.02, 1.0
"""Of each cable in a correction during a motion, m/s, and its time after the end, s."""
_LISTENS = 3
"""Longest ages of a pose for which a tracker that shows nothing is waited for."""
_PROBE = 1.0
"""Force by which the elasticity of a cable is tried in the profile, N."""
_SLACK = 0.5
"""Share of the lower limit of the forces, below which a cable counts as slack: as of the set force
of a single winch."""
_PLACES = 200
"""Of a motion at which the uncertainty of the balance is computed: it changes with the pose."""


@dataclass(frozen=True)
class Corrections:
    """What corrections of a platform are made of."""

    robot: Robot
    bench: WinchHost
    winches: Sequence[Winch]
    """In the order of the robot's lines."""
    wiring: RobotWiring

    def readings(self, now: float) -> Array:
        """Valid tensions at the platform end, (n,), N; NaN without one."""
        out = np.full(len(self.winches), np.nan)
        for i, winch in enumerate(self.winches):
            cell, reading = winch.load_cell, winch.tension_reading(now)
            if cell is not None and reading.age <= cell.max_age:
                out[i] = reading.value
        return out

    def balanced(self, pose: Pose) -> Array:
        """Projection on the forces that balance each other at a pose, (n, n)."""
        null = null_space(self.robot.structure(pose)[0])
        return np.asarray(null @ null.T)

    def force_loop(
        self,
        pose: Pose,
        force: Array,
        angles: Array,
        speed: float,
        *,
        axial_stiffness: float | None = None,
        path: PathForces | None = None,
        watched: bool = True,
    ) -> ForceLoop:
        """The control of the forces (1, n) at a pose, or (k, n) along a ``path`` of k poses,
        ``watched`` where readings that contradict the weight trip the bench. Raises NotPermitted
        for a winch without a cell, or forces that its drive does not give."""
        delays = []
        for winch in self.winches:
            winch.require_length()
            cell = winch.load_cell
            if cell is None:
                raise NotPermitted(
                    f"winch {winch.name} has no load cell; the cable forces of a platform are "
                    "corrected by those of all its winches"
                )
            newest = cell.latest
            filtered = 0.0 if newest is None else newest.t_receive - newest.t_sample
            delays.append(filtered + cell.period)
        start, first = pose[:1], force[0]
        self.require_torque(first, angles)
        late = max(winch.wiring.limits.response_time for winch in self.winches)
        stiffness, known = self._stiffness(start, first, angles, axial_stiffness)
        setting = ForceSetting(
            self.robot.names,
            first,
            self.balanced(start),
            stiffness,
            known,
            max(delays) + late,
            float(np.mean(delays)) + self.bench.loop.cycle + late / 2,
            speed,
            min(winch.wiring.limits.acceleration for winch in self.winches),
            np.array([declared_friction(line.profile) for line in self.robot.lines]),
            _SLACK * self.wiring.tension[0],
            self.check(pose, force, angles, stiffness, known=known) if watched else None,
        )
        return ForceLoop(setting, self.readings, self.bench.loop.supervisor.latch, path)

    def along(self, planned: PlatformTrajectory, angles: Array, clock: PathTime) -> Correction:
        """The control of the forces during a motion that begins at motor angles (n,)."""
        structure = self.robot.structure(planned.pose)
        balanced = np.array([null @ null.T for null in map(null_space, structure)])
        feeds = not self._elongation(angles, planned.force[0]).any()
        path = PathForces(clock, float(planned.time[1]), planned.force, balanced, feeds)
        loop = self.force_loop(planned.pose, planned.force, angles, _ALONG_SPEED, path=path)
        lasts = clock.duration + _ALONG_END
        return self.correction([loop], TRAVEL, _ALONG_SPEED, lambda elapsed, _: elapsed < lasts)

    def check(
        self, pose: Pose, force: Array, angles: Array, stiffness: Array, *, known: bool
    ) -> BalanceCheck:
        """What readings at k poses with planned forces (k, n) are compared with; ``angles`` (n,)
        are those of the first pose, ``stiffness`` (n,), N/m, an upper bound where it is not
        ``known``."""
        described = bool(np.all(self._elongation(angles, force[0]) > 0))
        compliance = (1.0 if known else SOFTER) / stiffness
        sources = sources_of(self.robot, self.wiring, compliance, described=described)
        return check_of(self.robot, sources, pose, force, places=_PLACES)

    def require_balance(self, loop: ForceLoop) -> None:
        """Raise NotPermitted where a cell has no reading, or they contradict the weight."""
        shown = self.readings(self.bench.clock.now())
        names = np.array(self.robot.names)
        if not np.isfinite(shown).all():
            raise NotPermitted(
                f"winch {', '.join(names[~np.isfinite(shown)])}: the load cell has no valid "
                "reading; look at its line and its quality, e.g. `winchkit monitor`"
            )
        check, deviation = loop.setting.check, shown - loop.setting.force
        if check is not None and check.size(0, deviation) > MOST:
            raise NotPermitted(
                f"{check.words(0, deviation)[1]}; look for a cell that was tared under load, a "
                "wrong cell, and the mass of the platform in the robot's profile"
            )

    def pose_loop(self, goal: Pose, tracker: TrackerReceiver | None, travel: float) -> PoseLoop:
        """The control of the pose by the tracker. Raises NotPermitted where the tracker's numbers
        are not known, it shows nothing, or the goal is farther than the travel of the cables (m)
        reaches."""
        robot, wiring = self.robot, self.wiring
        by_pose = -robot.structure(goal)[0].T
        spec = robot.profile.instrument.tracker
        if tracker is None or wiring.tracker is None:
            raise NotPermitted(
                "the bench declares no tracker, by which to hold a pose; declare `tracker` in "
                "[robot] (docs/howto/tracker.md)"
            )
        unknown = [
            name for name in ("frame", "reflector", "mounting") if getattr(spec, name) == UNKNOWN
        ]
        if unknown:
            raise NotPermitted(
                f"{', '.join(unknown)} of the tracker is unknown in the profile of "
                f"'{robot.profile.name}'; calibrate the robot, which writes it"
            )
        if robot.hangs:
            raise NotPermitted(
                f"'{robot.profile.name}' hangs on fewer cables than its platform has degrees of "
                "freedom: they do not hold a pose of it"
            )
        limits = TrackerLimits(wiring.tracker.max_age, wiring.speed, wiring.rotation_speed)
        loop = PoseLoop(
            goal,
            by_pose,
            lambda: tracker.newest,
            TrackerWatch(limits),
            self.bench.loop.supervisor.latch,
            numbers=robot.tracker,
        )
        age, clock = wiring.tracker.max_age, self.bench.clock
        if not tracker.since(clock.now() - age):
            clock.sleep(_LISTENS * age)  # it may listen from now on only
        newest = tracker.require(clock.now() - age, wiring.tracker.listen)[-1]
        loop.error = loop.deviation(newest)
        way = by_pose @ loop.error
        worst = int(np.argmax(np.abs(way)))
        if abs(way[worst]) > travel:
            off = float(np.linalg.norm(loop.error[:3]))
            raise NotPermitted(
                f"the tracker shows the platform {off * 1e3:.1f} mm and "
                f"{np.degrees(np.linalg.norm(loop.error[3:])):.2f} deg from the goal: cable "
                f"{robot.names[worst]} would have to move by {abs(way[worst]) * 1e3:.1f} mm (limit "
                f"{travel * 1e3:g} mm, travel of the correction); move there first, or calibrate"
            )
        return loop

    def correction(
        self,
        loops: Sequence[Loop],
        travel: float,
        speed: float,
        lasts: Callable[[float, float], bool],
    ) -> Correction:
        """The correction by loops, within the bounds of the winches."""
        limits = [winch.wiring.limits for winch in self.winches]
        bounds = Bounds(self.robot.names, limits, travel, speed)
        latch = self.bench.loop.supervisor.latch
        return Correction(bounds, loops, lasts, latch, elongating(loops, len(limits)))

    def _stiffness(
        self, pose: Pose, force: Array, angles: Array, axial_stiffness: float | None
    ) -> tuple[Array, bool]:
        """Stiffness of each cable (n,), N/m, declared or by the effects of the profile, and whether
        it is known; else a bound by the profile."""
        robot, declared = self.robot, axial_stiffness or self.wiring.axial_stiffness
        length = robot.lengths(pose)[0]
        if declared is not None:
            return declared / (length + robot.dead_length), True
        softer = self._elongation(angles, force)
        if np.all(softer > 0):
            return 1.0 / softer, True
        cables = [line.profile.cable for line in robot.lines]
        bounds = zip(cables, length.tolist(), strict=True)
        return np.array([greatest_stiffness(one, there, None) for one, there in bounds]), False

    def _elongation(self, angles: Array, force: Array) -> Array:
        """Elongation of each cable per force by the effects of the profile, (n,), m/N."""
        there, more = (self.robot.lengths_at(angles, one) for one in (force, force + _PROBE))
        return np.asarray((more - there)[0] / _PROBE)

    def require_torque(self, force: Array, angles: Array) -> None:
        """Raise NotPermitted where a drive's torque does not hold a cable force (n,)."""
        for winch, pull, angle in zip(self.winches, force.tolist(), angles.tolist(), strict=True):
            drive = self.bench.axes[winch.name].drive
            most = float("nan") if drive is None else drive.limits.torque
            torque = pull * abs(winch.cable.at(angle)[1])
            if torque > most:
                raise NotPermitted(
                    f"winch {winch.name}: the cable force {pull:.0f} N, of the limits `tension` of "
                    f"[robot], needs {torque:.3g} N m at its motor, and the drive gives "
                    f"{most:.3g} N m at most (6072h); lower `tension` of [robot]"
                )


def elongating(loops: Sequence[Loop], count: int) -> Array:
    """What of the cable that loops wind in changes forces and not the pose, (n, n). A change by
    forces that balance each other, and one that the platform follows, are a basis of all
    changes."""
    forces = next((one.setting for one in loops if isinstance(one, ForceLoop)), None)
    poses = next((one.by_pose for one in loops if isinstance(one, PoseLoop)), None)
    if forces is None:
        return np.zeros((count, count))
    if poses is None:
        return np.eye(count)
    elastic = null_space(poses.T) / forces.stiffness[:, None]
    shares = np.linalg.pinv(np.column_stack([elastic, poses]))
    return np.asarray(elastic @ shares[: elastic.shape[1]])

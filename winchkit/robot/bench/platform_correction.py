"""Forces and pose of a platform at rest: trimmed for a time, or held while it is commanded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from winchkit.arguments import positive, require_type
from winchkit.arrays import Array
from winchkit.bench.control.dead_man import DEAD_MAN, DeadMan
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.held_winch import LONGEST_HOLD
from winchkit.bench.host import WinchHost
from winchkit.errors import MotionError, NotPermitted, UsageError
from winchkit.plain_json import finite_or_none
from winchkit.robot.bench.correction import CableCorrection, Correction, HeldCorrection
from winchkit.robot.bench.corrections import TRAVEL, Corrections
from winchkit.robot.bench.force_loop import ForceLoop
from winchkit.robot.bench.platform_pose import PlatformPose, require_finite
from winchkit.robot.bench.pose_loop import PoseLoop
from winchkit.robot.forces.force_distribution import preloaded
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.robot_bench import RobotWiring

if TYPE_CHECKING:
    from winchkit.bench.winch import Winch

_TRIM_SPEED, _TRIM_TIME = 0.005, 5.0
"""m/s and s."""
_HOLD_SPEED = 0.05
"""Of each cable in a correction that is held, m/s: 2 mm, as of 100 N at 50 kN/m, take 0.2 s."""
_MET = 0.1
"""Difference of the forces of named cables from those that balance, N, that is rounding."""
_NO_FORCES = (
    "no cable forces within the limits `tension` of [robot] hold the platform here; move it, or "
    "change the limits"
)
Preload = float | Mapping[str, float]


@dataclass(frozen=True)
class HeldValues:
    """Set-point and measured values of what a platform holds; None for what is not held."""

    force: Mapping[str, float | None] | None = None
    """Set-point by cable, N."""
    measured: Mapping[str, float | None] | None = None
    """Reading by cable, N; None without one."""
    missing: Mapping[str, float | None] | None = None
    """By cable, N: of the forces that balance each other."""
    position_error: float | None = None
    """Mean of the tracker's newest 50 poses, m."""
    rotation_error: float | None = None
    """As ``position_error``, rad."""


class HeldPlatform(PlatformPose):
    """Corrections of the platform at rest, by load cells and tracker."""

    def __init__(
        self, bench: WinchHost, wiring: RobotWiring, robot: Robot, winches: Mapping[str, Winch]
    ) -> None:
        super().__init__(bench, wiring, robot, winches)
        self.corrections = Corrections(robot, bench, self._winches, wiring)
        """Loops of its cells and tracker."""
        self._held: tuple[ForceLoop | PoseLoop, ...] = ()

    def trim(
        self,
        *,
        duration: float = _TRIM_TIME,
        travel: float = TRAVEL,
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
            Of the cables, N; by default that of the profile, else the bound of a steel bar.
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
        _require_positive(
            "trim",
            duration=duration,
            travel=travel,
            speed=speed,
            axial_stiffness=axial_stiffness,
        )
        require_finite("keep", keep)
        if wait:
            self._bench.loop.require_other_thread("trim")
        pose = self.pose
        force = self._forces(pose)[0]
        if not force.any():
            raise NotPermitted(_NO_FORCES)
        if keep is not None:
            force = force + self.corrections.balanced(pose) @ keep
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
        measured = self.corrections.readings(self._bench.clock.now())
        return np.asarray(self.corrections.balanced(pose) @ (measured - self._forces(pose)[0]))

    def hold(
        self,
        *,
        preload: Preload | None = None,
        pose: Pose | None = None,
        duration: float | None = None,
        travel: float = TRAVEL,
        speed: float = _HOLD_SPEED,
        axial_stiffness: float | None = None,
        hold: float = DEAD_MAN,
    ) -> None:
        """Begin to hold the cable forces by the load cells, the pose by the tracker, or both.

        It lasts for ``hold`` seconds; :meth:`refresh` within that time keeps it going, else all
        winches ramp to rest together and are disabled. With ``duration`` it refreshes itself for
        that many seconds and returns at rest. Without a valid reading of every cable it rests;
        cells that contradict the weight, and a tracker that is silent, stands still, jumps or
        contradicts the motor angles, trip the bench (``docs/safety.md``).

        Parameters
        ----------
        preload : float or mapping of str to float, optional
            Forces nearest to this one in all cables, N, or the forces of the cables named, as many
            as the platform leaves free at most; the others balance them.
        pose : Pose, optional
            One pose in the base frame, which the tracker shows within the travel of the cables.
        duration : float, optional
            s.
        travel : float
            Of each cable from its place at the start, either way, m.
        speed : float
            Of each cable, m/s.
        axial_stiffness : float, optional
            Of the cables, N; by default that of the profile. Without either a change of the preload
            is not fed forward, and is slow by the bound of a steel bar.
        hold : float
            Time without a refresh, s, at most 1.

        Raises
        ------
        UsageError
            For numbers that cannot be meant, or with nothing to hold.
        NotPermitted
            For forces that no cables or drives give, a winch without a load cell, an unknown frame
            of the tracker, or a winch that may not move.
        """
        numbers = {"travel": travel, "speed": speed, "axial_stiffness": axial_stiffness}
        _require_positive("hold", **numbers, duration=duration)
        hold = positive("hold", "hold", hold, LONGEST_HOLD)
        if preload is None and pose is None:
            raise UsageError("hold: give a preload, a pose for the tracker, or both")
        if duration is not None:
            self._bench.loop.require_other_thread("hold(duration=...)")
        loops: list[ForceLoop | PoseLoop] = []
        if preload is not None:
            here = self.pose
            force = self._preloaded(here, preload)
            loop = self.corrections.force_loop(
                here, force[None], self._angles()[0], speed, axial_stiffness=axial_stiffness
            )
            self.corrections.require_balance(loop)
            loops.append(loop)
        if pose is not None:
            require_type(pose, Pose, "pose")
            loops.append(self.corrections.pose_loop(pose, self._bench.tracker, travel))
        for winch in self._winches:
            winch.require_new()
            winch.permit(Direction.BOTH)
            winch.require_length()
        dead_man = DeadMan(self._bench.clock.now() + hold)
        common = self.corrections.correction(
            loops, travel, speed, lambda _, now: dead_man.live(now)
        )
        self._start(
            [
                HeldCorrection(common, i, winch.cable, self._bench.axes[winch.name], dead_man)
                for i, winch in enumerate(self._winches)
            ]
        )
        self._held = tuple(loops)
        if duration is not None:
            self._hold_for(duration, hold)

    def refresh(self, hold: float = DEAD_MAN) -> None:
        """Keep what is held going for ``hold`` seconds more; raises as ``Winch.refresh``.

        Parameters
        ----------
        hold : float
            Time without another refresh, s, at most 1.
        """
        for winch in self._winches:
            winch.refresh(hold=hold)

    def release(self) -> None:
        """End what is held by a common ramp now."""
        for winch in self._winches:
            winch.release()

    def set_preload(self, preload: Preload) -> None:
        """Change the preload that is held; raises as :meth:`hold`, MotionError where none is.

        Parameters
        ----------
        preload : float or mapping of str to float
            N.
        """
        loop = next((one for one in self._held if isinstance(one, ForceLoop)), None)
        if loop is None or not self.moving:
            raise MotionError("no preload is held that could be changed; begin with hold")
        here, angles = self.pose, self._angles()[0]
        force = self._preloaded(here, preload)
        self.corrections.require_torque(force, angles)
        own = loop.setting
        check = self.corrections.check(here, force[None], angles, own.stiffness, known=own.known)
        loop.aim(force, check)

    def held(self) -> HeldValues:
        """What is held, or was held last, and how far the platform is from it.

        Raises MotionError where nothing was held.
        """
        if not self._held:
            raise MotionError("nothing was held; begin with hold")
        out = HeldValues()
        for loop in self._held:
            if isinstance(loop, PoseLoop):
                error = loop.mean_error
                out = replace(
                    out,
                    position_error=finite_or_none(float(np.linalg.norm(error[:3]))),
                    rotation_error=finite_or_none(float(np.linalg.norm(error[3:]))),
                )
            else:
                measured = self.corrections.readings(self._bench.clock.now())
                out = replace(
                    out,
                    force=self._by_cable(loop.force),
                    measured=self._by_cable(measured),
                    missing=self._by_cable(loop.mean_error),
                )
        return out

    def _by_cable(self, values: Array) -> dict[str, float | None]:
        return dict(zip(self.robot.names, map(finite_or_none, values.tolist()), strict=True))

    def _hold_for(self, duration: float, hold: float) -> None:
        """Refresh what was just started for a duration (s); returns at rest."""
        clock = self._bench.clock
        end = clock.now() + duration
        while self.moving and (left := end - clock.now()) > 0:
            self.refresh(min(hold, left))
            clock.sleep(min(hold / 4, left))
        self.wait()

    def _preloaded(self, pose: Pose, preload: Preload) -> Array:
        """Cable forces (n,) with a preload at a pose; raises UsageError, NotPermitted."""
        names = self.robot.names
        named = dict(preload) if isinstance(preload, Mapping) else dict.fromkeys(names, preload)
        wanted = np.full(len(names), np.nan)
        for name, value in named.items():
            if name not in names:
                raise UsageError(f"preload: '{name}' is no cable of the robot: {', '.join(names)}")
            wanted[names.index(name)] = positive("hold", "preload", value)
        limits = self.planner.tension
        found = preloaded(self.robot.structure(pose)[0], self.robot.weight(pose)[0], limits, wanted)
        if not np.isfinite(found.value).all():
            raise NotPermitted(_NO_FORCES)
        shown = ", ".join(f"{n} {x:.0f} N" for n, x in zip(names, found.value, strict=True))
        if isinstance(preload, Mapping) and np.nanmax(np.abs(found.value - wanted)) > _MET:
            free = len(names) - self.robot.geometry.degrees
            raise NotPermitted(
                f"cables {', '.join(named)} cannot have these forces at once: the platform leaves "
                f"{max(0, free)} free here, and the nearest that balance its weight are {shown}"
            )
        if not found.feasible:
            raise NotPermitted(
                f"this preload needs the forces {shown}, and `tension` of [robot] is "
                f"{limits.low:g} N to {limits.high:g} N; choose another preload"
            )
        return found.value

    def _trims(
        self,
        pose: Pose,
        force: Array,
        *,
        duration: float = _TRIM_TIME,
        travel: float = TRAVEL,
        speed: float = _TRIM_SPEED,
        axial_stiffness: float | None = None,
        hold: bool,
    ) -> list[CableCorrection]:
        """A correction toward cable forces (n,) at a pose, of each winch."""
        loop = self.corrections.force_loop(
            pose,
            force[None],
            self._angles()[0],
            speed,
            axial_stiffness=axial_stiffness,
            watched=False,
        )
        common = self.corrections.correction(
            [loop], travel, speed, lambda elapsed, _: elapsed < duration
        )
        return self._cable_corrections(common, hold=hold)

    def _cable_corrections(self, common: Correction, *, hold: bool) -> list[CableCorrection]:
        """A correction of all cables, of each winch."""
        return [
            CableCorrection(common, i, winch.cable, self._bench.axes[winch.name], holds=hold)
            for i, winch in enumerate(self._winches)
        ]


def _require_positive(call: str, **numbers: float | None) -> None:
    """Raise UsageError for a number that is given and not positive."""
    for name, value in numbers.items():
        if value is not None:
            positive(call, name, value)

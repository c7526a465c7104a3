"""The platform of a robot as its user moves it: ``bench.robot``."""

from __future__ import annotations

import numpy as np
import scipy.optimize  # loaded with the robot: in motion an import delays the loop
import scipy.spatial.transform  # noqa: F401
from scipy.interpolate import CubicSpline

from winchkit.arguments import require_type
from winchkit.arrays import Array
from winchkit.bench.control.snapshot import Direction
from winchkit.robot.bench.correction import CableCorrection
from winchkit.robot.bench.motion import CableMotion
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.path_time import PathTime
from winchkit.robot.bench.platform_correction import HeldPlatform
from winchkit.robot.bench.platform_pose import require_finite
from winchkit.robot.bench.trajectory import PlatformTrajectory, quick_stop_ramps
from winchkit.robot.geometry.kinematics import Pose


class Platform(HeldPlatform):
    """The platform that the winches of a bench move together.

    All winches start in one cycle, and their targets of a cycle belong to one pose. The profile of
    the robot, not those of the bench file, has the winches' drums.
    """

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
        require_finite("preload", preload)
        present = self._angles()[0] - planned.motor_angle[0]
        kept: Array = present
        if preload is not None and self.planner.wiring.tension_trim == "none":
            kept = preload
        share = planned.distance[:, None] / planned.path.length
        angles = planned.motor_angle + present + share * (kept - present)
        self._permit(planned, angles)
        self._planned = planned
        self._scale_quick_stops(planned)
        curve = CubicSpline(planned.time, angles, bc_type="clamped")
        clock = PathTime(planned, self.planner.wiring.acceleration)
        step = float(planned.time[1])
        mode = self.planner.wiring.tension_trim
        trims: list[CableCorrection] | list[None] = [None] * len(self._winches)
        if mode == "along":
            common = self.corrections.along(planned, self._angles()[0], clock)
            trims = self._cable_corrections(common, hold=hold)
        elif mode == "end":
            trims = self._trims(planned.pose[-1:], planned.force[-1], hold=hold)
        self._start(
            [
                CableMotion(
                    clock,
                    curve.c[:, :, i],
                    step,
                    winch.cable,
                    holds=hold,
                    trim=trim,
                    along=mode == "along",
                )
                for i, (winch, trim) in enumerate(zip(self._winches, trims, strict=True))
            ]
        )
        return kept

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

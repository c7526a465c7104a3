"""Inverse dynamics of a robot in a control cycle: forces, motor angles and torques per tick."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.robot.dynamics.kernels import PLAIN, RobotKernels
from winchkit.robot.geometry.robot import Robot, cables_of
from winchkit.units import GRAVITY


@dataclass(frozen=True, slots=True)
class DynamicTarget:
    """Set-points of one cycle; its sequences are overwritten by the next."""

    force: Any
    """Cable forces, (n,), N."""
    motor_angle: Any
    """(n,), rad."""
    motor_torque: Any
    """Feed-forward: cable force times arm, and the inertia of the winch, (n,), N m."""
    good: bool
    """False where the pose determines no forces: all values are those of the last cycle."""


class DynamicsCycle:
    """Newton-Euler equations, force distribution and winches of one pose per call.

    Parameters
    ----------
    robot : Robot
        Platform with mass, centre of mass and moment of inertia, and its winches.
    initial : (n,) sequence
        Forces to which those of every pose are nearest, N: the middle of their limits.
    period : float
        Of the control cycle, s.
    inertia : (n,) sequence, optional
        Of rotor and gearbox at the motor, kg m²; by default ``motor.inertia`` of the profiles.
    kernels : RobotKernels, optional
        Compiled or plain loops, as of :func:`winchkit.robot.fastest`.

    Notes
    -----
    Motor speeds are differenced over one cycle, so that the torque of the inertia is that of half
    a period earlier. Friction of motor and gearbox is not part of it: it depends on the measured
    speed, and :func:`winchkit.robot.dynamics.dynamics.inverse_dynamics` has it with every other
    effect of the profile.
    """

    __slots__ = (
        "_angles",
        "_body",
        "_forces",
        "_inertia",
        "_initial",
        "_kernels",
        "_lines",
        "_now",
        "_period",
        "_rates",
        "_still",
        "_torques",
        "_work",
        "_wrench",
    )

    def __init__(
        self,
        robot: Robot,
        initial: Sequence[float] | Array,
        period: float,
        *,
        inertia: Sequence[float] | Array | None = None,
        kernels: RobotKernels = PLAIN,
    ) -> None:
        count = len(robot.names)
        if robot.hangs:
            raise UsageError(
                f"{count} lines do not constrain the platform; its forces and motion come from "
                "winchkit.robot.geometry.forward and winchkit.robot.dynamics.integration"
            )
        if not period > 0:
            raise UsageError(f"the period of a control cycle is {period:g} s; it must be above 0")
        own = [winch.motor.inertia or 0.0 for winch in robot.winches]
        given = own if inertia is None else np.asarray(inertia, dtype=float).tolist()
        for name, found in (("inertias", len(given)), ("initial forces", len(initial))):
            if found != count:
                raise UsageError(f"{found} {name} were given for a robot of {count} lines")
        body = robot.platform
        moments = body.inertia or (0.0, 0.0, 0.0)
        array = kernels.array
        self._kernels, self._lines = kernels, kernels.lines(cables_of(robot))
        self._body = array([body.mass, *body.center_of_mass, *moments, 0.0, 0.0, -GRAVITY])
        self._initial = array(np.asarray(initial, dtype=float).tolist())
        self._inertia, self._period, self._now = array(given), period, 0.0
        self._work, self._wrench = kernels.work(count), array([0.0] * 6)
        self._still, self._angles, self._forces, self._torques, self._rates = (
            array([0.0] * count) for _ in range(5)
        )

    def wrench(self, pose: Any, velocity: Any, acceleration: Any) -> Any:
        """Weight and inertial forces about the platform's origin, (6,), N and N m.

        Parameters
        ----------
        pose : (12,) sequence
            As of :func:`winchkit.robot.flat_pose`.
        velocity, acceleration : (6,) sequence
            Of the origin, then angular, base axes.

        Returns
        -------
        (6,) sequence
            Overwritten by the next call; also for ``ElongationCorrection.update``.
        """
        self._kernels.wrench(self._body, pose, velocity, acceleration, self._wrench)
        return self._wrench

    def update(
        self, pose: Any, velocity: Any, acceleration: Any, strains: Any = None
    ) -> DynamicTarget:
        """Set-points of one cycle.

        Parameters
        ----------
        pose : (12,) sequence
            As of :func:`winchkit.robot.flat_pose`.
        velocity, acceleration : (6,) sequence
            Of the origin, then angular, base axes.
        strains : (n,) sequence, optional
            Strains of the cables against home.

        Returns
        -------
        DynamicTarget
            Cable forces, motor angles and torques.
        """
        loops, lines = self._kernels, self._lines
        held = self._still if strains is None else strains
        loads = self.wrench(pose, velocity, acceleration)
        good = bool(loops.forces(lines, pose, self._initial, loads, self._work, self._forces))
        if good:
            loops.winches(
                lines,
                self._work[0],
                held,
                self._forces,
                velocity,
                self._inertia,
                self._now,
                self._rates,
                self._angles,
                self._torques,
            )
        # After a cycle without speeds the next has no difference of speeds.
        self._now = self._period if good else 0.0
        return DynamicTarget(self._forces, self._angles, self._torques, good)

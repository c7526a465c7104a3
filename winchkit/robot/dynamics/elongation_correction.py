"""Correction of a cable robot's kinematics for the elongation of its cables.

Scheme of Fig. 1 of the IPAnema paper: cable forces are estimated from the pose (Eq. 8, with its
sign corrected), strains from the forces (Eq. 4, 5 or 6), and the commanded cable length is reduced
by the elongation. All is relative to a reference pose, at which motors and platform were
referenced, so that the correction is zero there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.elastic import ElongationLaw, LinearLaw
from winchkit.robot.dynamics.cycle import flat_pose
from winchkit.robot.dynamics.kernels import PLAIN, RobotKernels
from winchkit.robot.forces.force_distribution import approximate_forces
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot, cables_of


@dataclass(frozen=True, slots=True)
class Stretch:
    """Elongation of the cables relative to the reference pose, with its causes."""

    strain: Any
    """Of cable and dead length, relative to the reference, (n,)."""
    length: Any
    """δl, (n,), m."""
    forces: Any
    """As Eq. 8 estimates them, (n,), N."""
    good: bool
    """False where the pose gives no forces or no strain: all values are then the last good ones."""
    slack: bool
    """Whether a force is negative, which Eq. 8 does not exclude and a cable cannot carry."""


class ElongationCorrection:
    """Strain and elongation of every cable from a pose."""

    __slots__ = (
        "_array",
        "_at_reference",
        "_dead",
        "_estimate",
        "_forces",
        "_initial",
        "_last",
        "_laws",
        "_lines",
        "_room",
        "_wrench",
    )

    def __init__(
        self,
        robot: Robot,
        laws: Sequence[ElongationLaw],
        reference: Pose,
        initial: Sequence[float] | Array,
        *,
        wrench: Sequence[float] | Array | None = None,
        kernels: RobotKernels = PLAIN,
    ) -> None:
        """Take the elongation laws and the state at the reference pose.

        Parameters
        ----------
        robot
            Kinematic model.
        laws
            One per line.
        reference
            Reference pose.
        initial : (n,) sequence
            Cable forces there, N.
        wrench : (6,) sequence
            Constant wrench on the platform, N and N m; None for its weight at the reference.
        kernels
            Compiled or plain loops.

        Raises
        ------
        UsageError
            For a hanging platform, or where a law has no strain for a force at the reference.
        """
        count = len(robot.names)
        if robot.hangs:
            raise UsageError(
                f"{count} lines: Eq. 8 needs at least {robot.geometry.degrees}; the forces of a "
                "hanging platform come from winchkit.robot.geometry.forward"
            )
        for name, found in (("laws", len(laws)), ("initial forces", len(initial))):
            if found != count:
                raise UsageError(f"{found} {name} were given for a robot of {count} lines")
        weight = robot.weight(reference)[0] if wrench is None else np.asarray(wrench, dtype=float)
        self._laws = [law.strain for law in laws]
        self._lines = kernels.lines(cables_of(robot))
        self._dead = robot.dead_length.tolist()
        self._estimate, self._room = kernels.forces, kernels.work(count)
        self._initial = kernels.array(np.asarray(initial, dtype=float).tolist())
        self._wrench = kernels.array(weight.tolist())
        self._forces = kernels.array([0.0] * count)
        self._at_reference = self._strains(robot, reference, kernels)
        self._array = kernels.array
        there = self._stretch(kernels.array(flat_pose(reference)), self._wrench)
        assert there is not None, "forces and strains were just found here"
        self._last = there

    @classmethod
    def of(
        cls,
        robot: Robot,
        *,
        middle_force: float,
        reference: Pose | None = None,
        kernels: RobotKernels = PLAIN,
    ) -> ElongationCorrection:
        """Correction for linear elasticity, from the ``cable.axial_stiffness`` of every line.

        Parameters
        ----------
        robot
            Kinematic model.
        middle_force
            Forces at the reference are those closest to this that balance the platform's weight, N.
        reference
            Reference pose; None for the home pose.
        kernels
            Compiled or plain loops.

        Raises
        ------
        UsageError
            Where a stiffness is missing.

        Returns
        -------
        ElongationCorrection
            Its :meth:`update` is for the control cycle.
        """
        laws = []
        for line, winch in zip(robot.profile.line, robot.winches, strict=True):
            if winch.cable.axial_stiffness is None:
                raise UsageError(
                    f"{robot.profile.name}: line {line.name} has no cable.axial_stiffness; "
                    "measure it, or hand in a law per line"
                )
            laws.append(LinearLaw(winch.cable.axial_stiffness))
        pose = reference or robot.home
        middle = np.full(len(laws), middle_force)
        initial = approximate_forces(robot.structure(pose), robot.weight(pose), middle)[0]
        return cls(robot, laws, pose, initial, kernels=kernels)

    def update(self, pose: Any, wrench: Any = None) -> Stretch:
        """Elongation at a pose of twelve floats (position, rotation by rows).

        Where it cannot be computed, the last good one is returned, so that a command never jumps.

        Parameters
        ----------
        pose : (12,) sequence of float
            Position, m, and rotation matrix by rows.
        wrench : (6,) sequence of float, optional
            On the platform, N and N m: that of a moving platform, with its inertial forces, as of
            :meth:`winchkit.robot.DynamicsCycle.wrench`; None for the constant one.

        Returns
        -------
        Stretch
            Elongation of each line; ``good`` is false for a repeated one.
        """
        found = self._stretch(pose, self._wrench if wrench is None else wrench)
        if found is None:
            return replace(self._last, good=False)
        self._last = found
        return found

    def _stretch(self, pose: Any, wrench: Any) -> Stretch | None:
        if not self._estimate(self._lines, pose, self._initial, wrench, self._room, self._forces):
            return None
        forces = [float(force) for force in self._forces]
        strains = [
            law(force) - origin
            for law, force, origin in zip(self._laws, forces, self._at_reference, strict=True)
        ]
        if not isfinite(sum(strains)):
            return None
        lengths = [
            strain * (length + dead)
            for strain, length, dead in zip(strains, self._room[0][::7], self._dead, strict=True)
        ]
        make = self._array
        return Stretch(make(strains), make(lengths), make(forces), True, min(forces) < 0.0)

    def _strains(self, robot: Robot, reference: Pose, kernels: RobotKernels) -> list[float]:
        """Strains at the reference pose, to which all others are relative."""
        pose = kernels.array(flat_pose(reference))
        if not self._estimate(
            self._lines, pose, self._initial, self._wrench, self._room, self._forces
        ):
            raise UsageError(
                f"{robot.profile.name}: the structure matrix is singular at the reference pose, so "
                "that no cable forces follow from the wrench; choose another pose"
            )
        strains = []
        for name, law, force in zip(robot.names, self._laws, self._forces, strict=True):
            strains.append(law(float(force)))
            if not isfinite(strains[-1]):
                raise UsageError(
                    f"{robot.profile.name}: line {name}: its elongation law has no strain for "
                    f"{float(force):.4g} N, its force at the reference pose"
                )
        return strains

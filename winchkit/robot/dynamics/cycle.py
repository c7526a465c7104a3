"""Kinematics of a robot in a control cycle: one pose at a time, without numpy's overhead."""

from __future__ import annotations

from typing import Any

import numpy as np

from winchkit.errors import UsageError
from winchkit.robot.dynamics.kernels import PLAIN, RobotKernels
from winchkit.robot.geometry.forward import AGREEMENT
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot, cables_of

_TOLERANCE = 1e-5
"""Last step, m and rad: Newton's method converges quadratically, so that the error after it is of
the order of its square, 1e-10."""
_STEPS = 20
"""At most. Convergence is quadratic, so that one or two suffice from the pose of the cycle before;
20 without an end are lengths that no pose near it has (rule of thumb)."""


def flat_pose(pose: Pose) -> list[float]:
    """The first pose of a batch as twelve floats: position, then the rotation by rows.

    Parameters
    ----------
    pose : Pose
        Pose, of which the first is taken.

    Returns
    -------
    list of float
        12 floats, m and 1.
    """
    return [*pose.position[0].tolist(), *pose.rotation[0].ravel().tolist()]


class RobotCycle:
    """Inverse and forward kinematics of one pose per call.

    Poses are twelve floats as of :func:`flat_pose`; with compiled kernels they and all other
    sequences are float64 arrays, made by ``kernels.array``. What is returned is overwritten by the
    next call.

    Parameters
    ----------
    robot : Robot
        Kinematic model.
    kernels : RobotKernels, optional
        Compiled or plain loops, as of :func:`winchkit.robot.fastest`.
    """

    __slots__ = (
        "_angles",
        "_find",
        "_kernels",
        "_lengths",
        "_lines",
        "_motors",
        "_pose",
        "_still",
        "_work",
    )

    def __init__(self, robot: Robot, kernels: RobotKernels = PLAIN) -> None:
        count = len(robot.names)
        self._kernels = kernels
        self._lines = kernels.lines(cables_of(robot))
        self._motors, self._find = kernels.motors, kernels.find
        self._still = kernels.array([0.0] * count)
        self._lengths = kernels.array([0.0] * count)
        self._angles = kernels.array([0.0] * count)
        self._work = kernels.work(count)
        self._pose = kernels.array(flat_pose(robot.home))

    def motor_angles(self, pose: Any, strains: Any = None) -> Any:
        """Inverse kinematics with strained cables.

        Parameters
        ----------
        pose : (12,) sequence
            As of :func:`flat_pose`.
        strains : (n,) sequence, optional
            Strains of the cables against home.

        Returns
        -------
        (n,) sequence
            Motor angles, rad; NaN for a line whose anchor point lies inside its swivel pulley.
        """
        held = self._still if strains is None else strains
        self._motors(self._lines, pose, held, self._lengths, self._angles)
        return self._angles

    def pose_at(self, lengths: Any) -> Any | None:
        """Forward kinematics from the last pose.

        The time is bounded, so that nothing is searched from other starts: begin at
        :meth:`start_from` the pose of ``robot.poses_at``, also after None.

        Parameters
        ----------
        lengths : (n,) sequence
            Geometric cable lengths, m.

        Returns
        -------
        (12,) sequence or None
            As of :func:`flat_pose`; None where the iteration ends at no pose that meets every
            length to 20 mm, or to 10 nm after a step of more than 0.1 m or rad. The last pose is
            then kept.

        Raises
        ------
        UsageError
            For fewer than six lines.
        """
        if len(self._lines) < 6:
            raise UsageError(
                f"{len(self._lines)} lines do not constrain the platform; compute its pose by "
                "winchkit.robot.geometry.forward"
            )
        pose = self._pose.copy()
        lines, work = self._lines, self._work
        if self._find(lines, lengths, pose, work, _TOLERANCE, AGREEMENT, _STEPS) < 0:
            return None
        self._pose = pose
        return pose

    def start_from(self, pose: Any) -> None:
        """Set the pose (12) from which :meth:`pose_at` starts.

        Parameters
        ----------
        pose : (12,) array
            Position, m, and rotation matrix by rows.
        """
        self._pose = self._kernels.array(np.asarray(pose, dtype=float).tolist())

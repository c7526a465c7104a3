"""Prediction errors of a robot's model: poses by motor angles alone against measured ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.calibration.robot.equations import Equations
from winchkit.model.robot import Pose, forward, rotation_of
from winchkit.model.robot.pose_estimation import start_pose
from winchkit.model.robot.rotation import rotation_vector

__all__ = ["PoseErrors", "errors_at", "rms", "start_of"]

_ROUNDS = 4


@dataclass(frozen=True)
class PoseErrors:
    """Predicted against measured poses."""

    distance: Array
    """(p,), m; NaN where no position was measured or no pose was found."""
    angle: Array
    """(p,), rad; NaN where the rotation was not measured whole."""
    place: NDArray[np.str_]
    """Run and row of each pose, (p,)."""
    unfound: int
    """Number of poses for which the forward kinematics did not converge."""


def errors_at(equations: Equations, values: Array) -> PoseErrors:
    """Predict every pose from its motor angles, and compare it with the measured one.

    Parameters
    ----------
    equations : Equations
        Of the p poses to predict.
    values : (q,) array
        Parameters in fitted units.
    """
    pose, unfound = _poses(equations, values)
    measured = equations.measured
    distance = np.linalg.norm(pose.position - measured.position, axis=1)
    angle = np.full(len(distance), np.nan)
    whole = np.all(np.isfinite(measured.angles), axis=1) & np.isfinite(pose.rotation[:, 0, 0])
    seen = np.swapaxes(rotation_of(*measured.angles[whole].T), 1, 2)
    angle[whole] = np.linalg.norm(rotation_vector(pose.rotation[whole] @ seen), axis=1)
    return PoseErrors(distance, angle, measured.place, unfound)


def rms(values: Sequence[float] | Array) -> float:
    """Root of the mean square of finite values; NaN without any.

    Parameters
    ----------
    values : array, any shape
        Values; NaN is ignored.

    Returns
    -------
    float
        In the unit of the values.
    """
    known = np.asarray(values)[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _poses(equations: Equations, values: Array) -> tuple[Pose, int]:
    """Forward kinematics from the measured pose or home, with strains by fixed-point iteration."""
    geometry, slack = equations.geometry(values), equations.by_drum(values)
    dead, measured = equations.robot.dead_length, equations.measured
    start = start_of(equations)
    given, platform = slack, equations.platform(values)
    rounds = 1 if equations.parameters.law is None or equations.forces.middle is None else _ROUNDS
    for _ in range(rounds):
        if (strain := equations.strain(values, start)) is not None:
            given = (slack + strain.value * dead) / (1 - strain.value)
        found = forward(geometry, given, start, platform)
        # A search that did not converge starts again from home.
        start = _where(found.converged.astype(bool), found.pose, equations)
    known = np.all(np.isfinite(measured.motor_angle), axis=1)
    return found.pose, int(np.count_nonzero(known & ~found.converged.astype(bool)))


def _where(good: NDArray[np.bool_], pose: Pose, equations: Equations) -> Pose:
    home = equations.robot.home
    return Pose(
        np.where(good[:, None], pose.position, home.position),
        np.where(good[:, None, None], pose.rotation, home.rotation),
    )


def start_of(equations: Equations) -> Pose:
    """Measured positions and rotations; those of the home pose where one was not measured whole."""
    measured = equations.measured
    whole = np.all(np.isfinite(measured.angles), axis=1, keepdims=True)
    angles = np.where(whole, measured.angles, np.nan)
    return start_pose(measured.position, angles, equations.robot.home)

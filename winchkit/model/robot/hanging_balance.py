"""Static equilibrium of a hanging platform as constraint equations of its poses.

A platform on fewer than six cables stands where their forces balance its weight. With the structure
matrix Aᵀ, the measured cable forces f and the wrench w of the weight, six equations

    S (Aᵀ f + w) = 0,      S = diag(1, 1, 1, 1/ρ, 1/ρ, 1/ρ)

with the rms distance ρ of the anchor points from the platform's origin, so that all rows are
forces. They determine the tilt that the cables leave free, so that their derivatives by pose, exit
and anchor points are needed: central differences of 1 µm and 1 µrad.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.model.robot.constraints import Constraint, wrench_residual
from winchkit.model.robot.kinematics import Geometry, Pose, structure_matrix
from winchkit.model.robot.pose_estimation import moved_pose
from winchkit.model.robot.wrench import gravity_wrench, weight_by_payload
from winchkit.schema.profiles.robot import PlatformSpec

__all__ = ["hanging_balance"]

_STEP = 1e-6


def hanging_balance(
    geometry: Geometry, pose: Pose, tension: Array, platform: PlatformSpec
) -> Constraint:
    """Wrench of measured cable forces and weight, (p, 6), N.

    Parameters
    ----------
    geometry : Geometry
        Geometry of n lines.
    pose : Pose
        The p poses.
    tension : (p, n) array
        Measured cable forces, N; NaN where missing.
    platform : PlatformSpec
        Mass and centre of mass.

    Returns
    -------
    Constraint
        ``by_robot`` has ``payload``, (p, 6, 4), and ``exit_point`` and ``anchor_point``,
        (p, 6, 3 n).
    """
    lever = float(np.sqrt(np.mean(np.sum(geometry.anchor_point**2, axis=1))))
    scale = np.repeat([1.0, 1.0 / max(lever, _STEP)], 3)

    def wrench(own: Geometry, at: Pose) -> Array:
        structure = structure_matrix(own, at.position, at.rotation)
        return scale * wrench_residual(structure, tension, gravity_wrench(platform, at.rotation))

    def shifted(points: Array, index: int, by: float) -> Array:
        out = points.copy()
        out.ravel()[index] += by
        return out

    by_pose = np.empty((*pose.position.shape[:1], 6, 6))
    for index in range(6):
        step = np.zeros((len(pose.position), 6))
        step[:, index] = _STEP
        ends = [wrench(geometry, moved_pose(pose, sign * step)) for sign in (1.0, -1.0)]
        by_pose[..., index] = (ends[0] - ends[1]) / (2 * _STEP)
    by = {"payload": scale[:, None] * weight_by_payload(platform, pose.rotation)}
    for name, points in (
        ("exit_point", geometry.exit_point),
        ("anchor_point", geometry.anchor_point),
    ):
        part = np.empty((len(pose.position), 6, points.size))
        for index in range(points.size):
            ends = [
                wrench(replace(geometry, **{name: shifted(points, index, sign * _STEP)}), pose)
                for sign in (1.0, -1.0)
            ]
            part[..., index] = (ends[0] - ends[1]) / (2 * _STEP)
        by[name] = part
    return Constraint(wrench(geometry, pose), by_pose, {}, by)

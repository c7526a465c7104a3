"""Static equilibrium of a hanging platform as constraint equations of its poses.

A platform on fewer than six cables stands where their forces balance its weight. With the structure
matrix Aᵀ, the measured cable forces f and the wrench w of the weight, six equations

    S (Aᵀ f + w) = 0,      S = diag(1, 1, 1, 1/ρ, 1/ρ, 1/ρ)

with the rms distance ρ of the anchor points from the platform's origin, so that all rows are
forces. They determine the tilt that the cables leave free, so that their derivatives by pose, exit
and anchor points and swivel radii are needed: central differences of 1 µm and 1 µrad.
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

__all__ = ["hanging_balance", "hanging_residual"]

_STEP = 1e-6


def hanging_residual(
    geometry: Geometry, pose: Pose, tension: Array, platform: PlatformSpec
) -> Array:
    """Residuals of :func:`hanging_balance` without their derivatives, (p, 6), N.

    Parameters
    ----------
    geometry : Geometry
        Geometry of n lines.
    pose : Pose
        The p poses.
    tension : (p, n) array
        Cable forces, N; NaN where missing.
    platform : PlatformSpec
        Mass and centre of mass.
    """
    structure = structure_matrix(geometry, pose.position, pose.rotation)
    weight = gravity_wrench(platform, pose.rotation)
    return _scale(geometry) * wrench_residual(structure, tension, weight)


def _scale(geometry: Geometry) -> Array:
    """Diagonal of S, (6,)."""
    lever = float(np.sqrt(np.mean(np.sum(geometry.anchor_point**2, axis=1))))
    return np.repeat([1.0, 1.0 / max(lever, _STEP)], 3)


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
        ``by_robot`` has ``payload``, (p, 6, 4), ``tension``, (p, 6, n), ``exit_point`` and
        ``anchor_point``, (p, 6, 3 n), and ``swivel_radius``, (p, 6, n).
    """
    scale = _scale(geometry)

    def pulls(own: Geometry, at: Pose) -> Array:
        """Wrench of each cable's force, (p, 6, n)."""
        structure = structure_matrix(own, at.position, at.rotation)
        return np.asarray(scale[:, None] * structure * tension[:, None, :])

    def wrench(at: Pose) -> Array:
        weight = scale * gravity_wrench(platform, at.rotation)
        return np.asarray(pulls(geometry, at).sum(axis=2) + weight)

    by_pose = np.empty((len(pose.position), 6, 6))
    for index in range(6):
        step = np.zeros((len(pose.position), 6))
        step[:, index] = _STEP
        ends = [wrench(moved_pose(pose, sign * step)) for sign in (1.0, -1.0)]
        by_pose[..., index] = (ends[0] - ends[1]) / (2 * _STEP)
    by = {
        "payload": scale[:, None] * weight_by_payload(platform, pose.rotation),
        "tension": scale[:, None] * structure_matrix(geometry, pose.position, pose.rotation),
    }
    # Each cable's wrench depends on its own points alone, so that all lines are moved at once.
    for name in ("exit_point", "anchor_point", "swivel_radius"):
        values = getattr(geometry, name)
        parts = []
        for move in _moves(values):
            ends = [
                pulls(replace(geometry, **{name: values + sign * move}), pose)
                for sign in (1.0, -1.0)
            ]
            parts.append((ends[0] - ends[1]) / (2 * _STEP))
        by[name] = np.stack(parts, axis=-1).reshape(len(pose.position), 6, values.size)
    return Constraint(wrench(pose), by_pose, {}, by)


def _moves(values: Array) -> list[Array]:
    """Steps of one coordinate of all lines each."""
    if values.ndim == 1:
        return [np.full_like(values, _STEP)]
    return [np.tile(row, (len(values), 1)) for row in _STEP * np.eye(values.shape[1])]

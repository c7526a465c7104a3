"""Balance of cable forces and weight at the platform, as constraint equations of its poses.

``force_basis`` whitens the balance (IPAnema paper, Eq. 7): the wrench Aᵀ f + w of measured cable
forces f and weight w is multiplied by a matrix V with V Aᵀ A Vᵀ = 1, so that each row has the
variance of one force reading. The derivatives of V Aᵀ by pose and geometry are left out: the wrench
that is left over is small.

``hanging_balance``. A platform on fewer cables than degrees of freedom stands where their forces
balance its weight:

    S (Aᵀ f + w) = 0,      S = diag(1, 1, 1, 1/ρ, 1/ρ, 1/ρ)

with the rms distance ρ of the anchor points from the platform's origin, so that all rows are
forces. They determine the tilt that the cables leave free, so that their derivatives by pose and
geometry are needed: central differences of 1 µm and 1 µrad.

References
----------
IPAnema paper: docs/papers.md.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.geometry.constraints import Constraint
from winchkit.robot.geometry.kinematics import Geometry, Pose, lever_of, structure_matrix
from winchkit.robot.geometry.pose_estimation import moved_pose
from winchkit.robot.geometry.wrench import gravity_wrench, weight_by_payload
from winchkit.schema.profiles.robot import PlatformSpec

_SEEN = 1e-3
"""Singular values of a structure matrix below this share of the largest count as zero: about its
relative error by a millimetre of geometry in a metre, so that what is left there is no force. A
platform on four cables that hangs in the middle of its frame has one of zero."""

_STEP = 1e-6
"""m and rad, of central differences: the truncation (1e-12) and the rounding (2e-16/1e-6) stay
below 1e-9 of a force. Also the least lever arm of a platform's anchor points, m."""


def wrench_residual(structure: Array, tension: Array, weight: Array) -> Array:
    """Wrench Aᵀ f + w that cable forces (p, n) and weight (p, 6) leave over, (p, 6), N and N m."""
    return np.asarray((structure @ tension[..., None])[..., 0] + weight)


def force_basis(structure: Array) -> tuple[Array, Array]:
    """Matrices V = S⁻¹ Uᵀ (p, k, 6) from a wrench to whitened forces, and W (p, n, k) to the least
    change of cable forces that carries them, of Aᵀ = U S Wᵀ. A row is NaN where the cables cannot
    carry its wrench, so that hanging and guided platforms keep the rows that they do carry."""
    good = np.all(np.isfinite(structure), axis=(1, 2))
    left, size, right = np.linalg.svd(
        np.where(good[:, None, None], structure, 0.0), full_matrices=False
    )
    seen = size > _SEEN * np.maximum(size[:, :1], 1e-300)
    inverse = np.where(seen, 1 / np.where(seen, size, 1.0), np.nan)
    to_forces = np.asarray(inverse[..., None] * np.swapaxes(left, 1, 2))
    return to_forces, np.asarray(np.swapaxes(right, 1, 2))


def hanging_residual(
    geometry: Geometry,
    pose: Pose,
    tension: Array,
    platform: PlatformSpec,
    inertial: Array | float = 0.0,
) -> Array:
    """Residuals of :func:`hanging_balance` without their derivatives, (p, 6), N."""
    structure = structure_matrix(geometry, pose.position, pose.rotation)
    weight = gravity_wrench(platform, pose.rotation) + inertial
    return wrench_scale(geometry) * wrench_residual(structure, tension, weight)


def wrench_scale(geometry: Geometry) -> Array:
    """Diagonal of S, (6,)."""
    return np.repeat([1.0, 1.0 / max(lever_of(geometry), _STEP)], 3)


def hanging_balance(
    geometry: Geometry,
    pose: Pose,
    tension: Array,
    platform: PlatformSpec,
    inertial: Array | float = 0.0,
) -> Constraint:
    """Wrench of measured cable forces (p, n), of the weight and of the inertial forces (p, 6), by
    pose, payload, cable forces and the geometry of all lines; (p, 6), N."""
    scale = wrench_scale(geometry)

    def pulls(own: Geometry, at: Pose) -> Array:
        """Wrench of each cable's force, (p, 6, n)."""
        structure = structure_matrix(own, at.position, at.rotation)
        return np.asarray(scale[:, None] * structure * tension[:, None, :])

    def wrench(at: Pose) -> Array:
        weight = scale * (gravity_wrench(platform, at.rotation) + inertial)
        return np.asarray(pulls(geometry, at).sum(axis=2) + weight)

    by_pose = np.empty((len(pose.position), 6, 6))
    for index in range(6):
        step = np.zeros((len(pose.position), 6))
        step[:, index] = _STEP * geometry.free[index]
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


def resting_balance(
    geometry: Geometry, pose: Pose, platform: PlatformSpec, inertial: Array | float = 0.0
) -> Constraint:
    """:func:`hanging_balance` without measured forces: the part of the wrench that no forces of
    cables and guides carry, (p, k, ...), N. The forces are those that leave least of it, whose
    derivatives do not count to the first order (variable projection, Kaufman's form)."""
    scale = wrench_scale(geometry)
    pulls = scale[:, None] * structure_matrix(geometry, pose.position, pose.rotation)
    weight = scale * (gravity_wrench(platform, pose.rotation) + inertial)
    guides = np.eye(6)[:, ~np.asarray(geometry.free, dtype=bool)]
    held = np.broadcast_to(guides, (len(pulls), *guides.shape))
    carried = np.nan_to_num(np.concatenate([pulls, held], axis=2))
    tension = -(np.linalg.pinv(carried) @ weight[..., None])[:, : pulls.shape[2], 0]
    left, _, _ = np.linalg.svd(carried)
    uncarried = np.swapaxes(left[..., carried.shape[2] :], 1, 2)
    found = hanging_balance(geometry, pose, tension, platform, inertial)
    return Constraint(
        (uncarried @ found.residual[..., None])[..., 0],
        uncarried @ found.by_pose,
        {},
        {name: uncarried @ part for name, part in found.by_robot.items()},
    )


def _moves(values: Array) -> list[Array]:
    """Steps of one coordinate of all lines each."""
    if values.ndim == 1:
        return [np.full_like(values, _STEP)]
    return [np.tile(row, (len(values), 1)) for row in _STEP * np.eye(values.shape[1])]

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
geometry are needed. A cable with direction u from pulley to platform and lever arm a pulls with
−f (u, a × u), of which the derivatives are

    d(u) = U δ + u_r dr,      d(a × u) = a × d(u) − u × d(a)

where δ is the anchor's displacement in the base frame, U = ∂²L/∂δ² and u_r those of
``direction_change``, and d(a) the part of δ by the platform's rotation and by the anchor point.

References
----------
IPAnema paper: docs/papers.md.
"""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import skew
from winchkit.robot.geometry.constraints import Constraint
from winchkit.robot.geometry.hessian import direction_change
from winchkit.robot.geometry.kinematics import Geometry, Pose, lever_of, structure_matrix
from winchkit.robot.geometry.wrench import gravity_wrench, weight_by_payload, weight_by_rotation
from winchkit.schema.profiles.robot import PlatformSpec

_SEEN = 1e-3
"""Singular values of a structure matrix below this share of the largest count as zero: about its
relative error by a millimetre of geometry in a metre, so that what is left there is no force. A
platform on four cables that hangs in the middle of its frame has one of zero."""

_LEAST_LEVER = 1e-6
"""Least lever arm of a platform's anchor points, m, so that a platform that is a point has one."""


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
    return np.repeat([1.0, 1.0 / max(lever_of(geometry), _LEAST_LEVER)], 3)


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
    structure = structure_matrix(geometry, pose.position, pose.rotation)
    weight = gravity_wrench(platform, pose.rotation) + inertial
    arm = np.einsum("pij,nj->pni", pose.rotation, geometry.anchor_point)
    change = direction_change(geometry, pose.position, pose.rotation)
    size = -tension[..., None, None] * (scale * geometry.free)[:, None]

    def wrench(turned: Array, moved_arm: Array | float) -> Array:
        """Derivative of each cable's wrench by k variables, (p, n, 6, k), that change the cable's
        direction and the anchor's lever arm by these, (p, n, 3, k)."""
        moment = skew(arm) @ turned - skew(change.direction) @ moved_arm
        return np.asarray(size * np.concatenate([turned, moment], axis=2))

    by_place = wrench(change.by_anchor, np.zeros((3, 3)))
    turning, with_platform = -skew(arm), np.broadcast_to(pose.rotation[:, None], (*arm.shape, 3))
    by_turn = wrench(change.by_anchor @ turning, turning)
    by_pose = np.concatenate([by_place, by_turn], axis=3).sum(axis=1)
    by_pose[..., 3:] += scale[:, None] * weight_by_rotation(platform, pose.rotation)
    by_line = {
        "exit_point": -by_place,
        "anchor_point": wrench(change.by_anchor @ with_platform, with_platform),
        "swivel_radius": wrench(change.by_radius[..., None], np.zeros((3, 1))),
    }
    by = {
        "payload": scale[:, None] * weight_by_payload(platform, pose.rotation),
        "tension": scale[:, None] * structure,
        **{name: _all_lines(part) for name, part in by_line.items()},
    }
    residual = scale * wrench_residual(structure, tension, weight)
    return Constraint(residual, by_pose * geometry.free, {}, by)


def _all_lines(part: Array) -> Array:
    """(p, n, 6, k) as the columns of all lines beside each other, (p, 6, n k)."""
    return np.moveaxis(part, 1, 2).reshape(len(part), 6, -1)


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

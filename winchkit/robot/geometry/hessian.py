"""Second derivatives of cable lengths, for hanging platforms: their stiffness and equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import cross, skew
from winchkit.robot.geometry.kinematics import Geometry, sensitivities, wrap_angle


def length_hessian(geometry: Geometry, position: Array, rotation: Array) -> Array:
    """Second derivatives of the lengths by position and rotation vector, (p, n, 6, 6).

    The rotation vector's own second order is ½ ω × (ω × R b).
    """
    change = direction_change(geometry, position, rotation)
    unit = change.direction
    arm = np.einsum("pij,nj->pni", rotation, geometry.anchor_point)
    swing = np.concatenate([np.broadcast_to(np.eye(3), (*arm.shape, 3)), -skew(arm)], axis=-1)
    out = np.einsum("pnai,pnab,pnbj->pnij", swing, change.by_anchor, swing)
    product = arm[..., :, None] * unit[..., None, :]
    inner = np.sum(arm * unit, axis=-1)[..., None, None]
    out[..., 3:, 3:] += (product + np.swapaxes(product, -1, -2)) / 2 - inner * np.eye(3)
    return np.asarray(out * _outer(geometry.free))


@dataclass(frozen=True)
class DirectionChange:
    """Directions of the cables from pulley to platform with their derivatives, base axes."""

    direction: Array
    """Unit vectors, the lengths' derivatives by the anchors' places, (p, n, 3)."""
    by_anchor: Array
    """By the anchor's place in the base frame, symmetric, (p, n, 3, 3), 1/m."""
    by_radius: Array
    """By the line's own swivel radius, (p, n, 3), 1/m."""


def direction_change(geometry: Geometry, position: Array, rotation: Array) -> DirectionChange:
    """Derivatives of the cables' directions, whatever coordinates guides hold.

    An anchor that moves across the cable in the pulley's plane turns the free cable by δ/free; one
    that moves square to that plane turns the pulley by δ/distance from the axis. The derivative by
    the radius is that of ∂L/∂r = wrap − sin wrap by the anchor's place.
    """
    by = sensitivities(geometry, position, rotation)
    unit, axis = -by.exit_point, geometry.swivel_axis
    arm = np.einsum("pij,nj->pni", rotation, geometry.anchor_point)
    wrap = wrap_angle(geometry, position, rotation)[..., None]
    seen = arm + position[:, None] - geometry.exit_point
    along = np.sum(seen * axis, axis=-1, keepdims=True)
    outward = seen - along * axis
    distance = np.linalg.norm(outward, axis=-1, keepdims=True)
    radius = geometry.swivel_radius[:, None]
    square = (distance - radius) ** 2 + along**2 - radius**2
    # No cable leads to an anchor within its pulley.
    free = np.sqrt(np.where(square >= 0.0, square, np.nan))
    away = outward / np.where(distance > 0, distance, 1.0)
    # On the swivel axis the limit is that of a straight cable.
    side = np.where(
        distance > 1e-12, np.sin(wrap) / np.where(distance > 0, distance, 1.0), 1 / free
    )
    away = np.where(distance > 1e-12, away, _any_square_to(axis))
    inplane = np.cos(wrap) * away - np.sin(wrap) * axis
    across = cross(axis, away)
    by_anchor = _outer(inplane) / free[..., None] + _outer(across) * side[..., None]
    return DirectionChange(unit, by_anchor, (1 - np.cos(wrap)) / free * inplane)


def _outer(vector: Array) -> Array:
    return np.asarray(vector[..., :, None] * vector[..., None, :])


def _any_square_to(axis: Array) -> Array:
    other = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    square = cross(axis, other)
    return np.asarray(square / np.linalg.norm(square, axis=1, keepdims=True))

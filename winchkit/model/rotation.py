"""Rotations of the platform: angles, rotation vectors, quaternions and matrices, in batches.

Matrices turn platform coordinates into base coordinates. A rotation vector is a small turn in the
base frame: R' = exp([ω]×) R.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array

_SERIES = 0.1
"""Angle below which coefficients come from their power series, rad: error below 1e-10."""


def rotation_of(roll: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> Array:
    """R = Rz(yaw) Ry(pitch) Rx(roll), angles of shape (...), rad; returns (..., 3, 3).

    Parameters
    ----------
    roll, pitch, yaw : array_like, (...)
        Angles, rad.

    Returns
    -------
    (..., 3, 3) array
        From platform to base axes.
    """
    turns = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (roll, pitch, yaw)))
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in turns)
    rows = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def angles_of(rotation: ArrayLike) -> Array:
    """Roll, pitch and yaw of rotations (..., 3, 3); returns (..., 3), rad.

    At a pitch of a right angle only yaw ∓ roll is defined; roll is then zero.

    Parameters
    ----------
    rotation : array_like, (..., 3, 3)
        Rotations.

    Returns
    -------
    (..., 3) array
        Roll, pitch and yaw, rad.
    """
    r = np.asarray(rotation, dtype=float)
    flat = np.hypot(r[..., 0, 0], r[..., 1, 0])
    pitch = np.arctan2(-r[..., 2, 0], flat)
    upright = flat < 1e-12
    roll = np.where(upright, 0.0, np.arctan2(r[..., 2, 1], r[..., 2, 2]))
    yaw = np.where(
        upright, np.arctan2(-r[..., 0, 1], r[..., 1, 1]), np.arctan2(r[..., 1, 0], r[..., 0, 0])
    )
    return np.stack([roll, pitch, yaw], axis=-1)


def skew(vector: ArrayLike) -> Array:
    """[v]× with [v]× w = v × w, of vectors (..., 3); returns (..., 3, 3)."""
    v = np.asarray(vector, dtype=float)
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def cross(a: Array, b: Array) -> Array:
    """Cross products a × b of vectors (..., 3) that broadcast, by components: for the few poses of
    a control cycle or of a calibration a third of the time of ``numpy.cross``."""
    if object in (a.dtype, b.dtype):
        return np.cross(a, b)  # Of traced values, whose operations are their own.
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    out = np.empty(np.broadcast(a, b).shape)
    out[..., 0] = ay * bz - az * by
    out[..., 1] = az * bx - ax * bz
    out[..., 2] = ax * by - ay * bx
    return out


def rotation_by(vector: ArrayLike) -> Array:
    """exp([ω]×) of rotation vectors (..., 3), rad (Rodrigues); returns (..., 3, 3)."""
    v = np.asarray(vector, dtype=float)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    cross = skew(v)
    # sinc keeps both factors exact for small angles.
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.asarray(np.eye(3) + first * cross + second * (cross @ cross))


def mean_rotation(rotation: Array) -> Array:
    """Rotation nearest to the mean of rotation matrices (p, 3, 3), in the Frobenius norm; (3, 3).
    Moakher, M. (2002). Means and averaging in the group of rotations. SIAM J. Matrix Anal. Appl.
    24."""
    left, _, right = np.linalg.svd(np.mean(rotation, axis=0))
    return np.asarray(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right)


def rotation_vector(rotation: ArrayLike) -> Array:
    """The rotation vector of rotations (..., 3, 3), at most π long; returns (..., 3), rad."""
    q = quaternion_of(rotation)
    sine = np.linalg.norm(q[..., 1:], axis=-1)
    angle = 2 * np.arctan2(sine, q[..., 0])
    tiny = sine < 1e-12
    scale = np.where(tiny, 2.0, angle / np.where(tiny, 1.0, sine))
    return np.asarray(q[..., 1:] * scale[..., None])


def rotation_rates(vector: Array, first: Array, second: Array) -> tuple[Array, Array]:
    """Angular velocity ω, dR = [ω]× R, and its derivative of R = exp([φ]×) R0, by φ and its
    derivatives φ' and φ'' by any parameter, (..., 3).

    ω = φ' + b φ × φ' + c φ × (φ × φ'), with b = (1 − cos θ)/θ², c = (θ − sin θ)/θ³ and θ = ‖φ‖.
    """
    square = np.sum(vector * vector, axis=-1, keepdims=True)
    angle = np.sqrt(square)
    large = angle > _SERIES
    t = np.where(large, angle, 1.0)
    sine, cosine = np.sin(t), np.cos(t)

    def either(closed: Array, one: float, two: float, three: float) -> Array:
        return np.where(large, closed, one + square * (two + square * three))

    b = either((1 - cosine) / t**2, 1 / 2, -1 / 24, 1 / 720)
    c = either((t - sine) / t**3, 1 / 6, -1 / 120, 1 / 5040)
    # b' and c' by θ, over θ; θ θ' is φ · φ'.
    b_rate = either((t * sine - 2 * (1 - cosine)) / t**4, -1 / 12, 1 / 180, -1 / 6720)
    c_rate = either((3 * sine - t * cosine - 2 * t) / t**5, -1 / 60, 1 / 1260, -1 / 60480)
    along = np.sum(vector * first, axis=-1, keepdims=True)
    across, bent = cross(vector, first), cross(vector, second)
    twice = cross(vector, across)
    velocity = first + b * across + c * twice
    acceleration = (
        second
        + b * bent
        + c * (cross(first, across) + cross(vector, bent))
        + along * (b_rate * across + c_rate * twice)
    )
    return velocity, acceleration


def rotation_from_quaternion(quaternion: ArrayLike) -> Array:
    """Rotations of quaternions (..., 4) as w, x, y, z, of any length but zero; (..., 3, 3)."""
    q = np.asarray(quaternion, dtype=float)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    product = skew(q[..., 1:])
    return np.asarray(np.eye(3) + 2 * q[..., :1, None] * product + 2 * (product @ product))


def quaternion_of(rotation: ArrayLike) -> Array:
    """Unit quaternions w, x, y, z with w ≥ 0 of rotations (..., 3, 3); returns (..., 4)."""
    r = np.asarray(rotation, dtype=float)
    xx, yy, zz = r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]
    a, b, c = (
        r[..., 2, 1] - r[..., 1, 2],
        r[..., 0, 2] - r[..., 2, 0],
        r[..., 1, 0] - r[..., 0, 1],
    )
    d, e, f = (
        r[..., 1, 0] + r[..., 0, 1],
        r[..., 0, 2] + r[..., 2, 0],
        r[..., 2, 1] + r[..., 1, 2],
    )
    # Four times q qᵀ: each row is the quaternion, scaled; the longest is the exact one.
    rows = np.stack(
        [
            np.stack([1 + xx + yy + zz, a, b, c], axis=-1),
            np.stack([a, 1 + xx - yy - zz, d, e], axis=-1),
            np.stack([b, d, 1 - xx + yy - zz, f], axis=-1),
            np.stack([c, e, f, 1 - xx - yy + zz], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(rows, largest[..., None, None], axis=-2)[..., 0, :]
    unit = row / np.linalg.norm(row, axis=-1, keepdims=True)
    return np.asarray(np.where(unit[..., :1] < 0, -unit, unit))


def angle_rates(rotation: Array) -> Array:
    """Derivatives of roll, pitch and yaw by a rotation vector in the base frame, (p, 3, 3)."""
    _, pitch, yaw = angles_of(rotation).T
    cp, sp, cy, sy = np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    zero, one = np.zeros_like(cp), np.ones_like(cp)
    # Near a pitch of 90 degrees roll and yaw are not separate: their rates are infinite.
    level = np.where(np.abs(cp) > 1e-6, cp, np.nan)
    rows = (
        (cy / level, sy / level, zero),
        (-sy, cy, zero),
        (cy * sp / level, sy * sp / level, one),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

"""Rotation matrices of roll, pitch and yaw, of a rotation vector, and their quaternions."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.sim.mechanics import rotated

_UNTURNED = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def rotation(roll: float, pitch: float, yaw: float) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), (3, 3)."""
    turn = turned((roll, 0.0, 0.0))
    return np.asarray(turned((0.0, 0.0, yaw)) @ turned((0.0, pitch, 0.0)) @ turn)


def turned(vector: tuple[float, float, float]) -> Array:
    """Matrix exponential of a rotation vector, rad."""
    out = [0.0] * 9
    rotated(*vector, _UNTURNED, out)
    return np.array(out).reshape(3, 3)


def quaternion(matrix: Array) -> tuple[float, float, float, float]:
    """Unit quaternion w, x, y, z with w ≥ 0: the eigenvector of Bar-Itzhack (2000)."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    symmetric = np.array(
        [
            [a + e + i, h - f, c - g, d - b],
            [h - f, a - e - i, d + b, c + g],
            [c - g, d + b, e - a - i, f + h],
            [d - b, c + g, f + h, i - a - e],
        ]
    )
    vector = np.linalg.eigh(symmetric)[1][:, -1]
    w, x, y, z = (vector if vector[0] >= 0 else -vector).tolist()
    return w, x, y, z

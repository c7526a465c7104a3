"""The CABTIVE paper's own method: every evaluation searches every pose again, and derivatives are
central differences of that search. Kept as the baseline that it is; scipy does both searches.

One outer Jacobian is timed: two evaluations a parameter over all poses. What the paper's search
takes is that times its iterations, 25 when it was run to the end once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from robot_poses.truth import ANCHOR, EXIT, HOME, TURNS, UPPER
from winchkit.arrays import Array

ITERATIONS = 25
LINES = 8
_TURN = 2 * np.pi
_STEP = 1e-6


@dataclass(frozen=True)
class NestedProblem:
    """Motor angles (p, 8) and positions (p, 3) as measured."""

    motor_angle: Array
    position: Array

    def residual(self, values: Array) -> Array:
        """Predicted less measured positions, (3 p,): the paper's Eq. 5 within its Eq. 6."""
        home = _lengths(values, np.array([*HOME, 0.0, 0.0, 0.0]))
        out = np.empty_like(self.position)
        for j, angles in enumerate(self.motor_angle):
            given = home - (_wound(values, _TURN * TURNS + angles) - _wound(values, _TURN * TURNS))
            start = np.array([*self.position[j], 0.0, 0.0, 0.0])

            def off(pose: Array, given: Array = given) -> Array:
                return _lengths(values, pose) - given

            found = least_squares(off, start, jac="3-point", xtol=1e-10, ftol=1e-14, gtol=1e-14)
            out[j] = found.x[:3] - self.position[j]
        return out.ravel()

    def jacobian(self, values: Array, columns: int) -> Array:
        """Central differences by the first ``columns`` parameters, (3 p, columns)."""
        out = np.empty((self.position.size, columns))
        for k in range(columns):
            step = np.zeros_like(values)
            step[k] = _STEP
            out[:, k] = (self.residual(values + step) - self.residual(values - step)) / (2 * _STEP)
        return out


def nominal(exit_point: Array, anchor_point: Array) -> Array:
    """The 65 parameters to start from, (65,), m: points, winding radii, pulley radii, diameter."""
    radii = np.concatenate([np.full(LINES, 0.06), np.full(LINES, 0.0086), [0.00048]])
    assert exit_point.shape == anchor_point.shape == (LINES, len(EXIT)) == (LINES, len(ANCHOR))
    return np.concatenate([exit_point.ravel(), anchor_point.ravel(), radii])


def _lengths(values: Array, pose: Array) -> Array:
    exits, anchors = values[:24].reshape(LINES, 3), values[24:48].reshape(LINES, 3)
    radius = values[56:64]
    cr, cp, cy = np.cos(pose[3:])
    sr, sp, sy = np.sin(pose[3:])
    rotation = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    seen = pose[:3] + anchors @ rotation.T - exits
    upright = np.where(np.arange(LINES) < UPPER, 1.0, -1.0)
    away, along = np.hypot(seen[:, 0], seen[:, 1]) - radius, upright * seen[:, 2]
    free = np.sqrt(away**2 + along**2 - radius**2)
    return np.asarray(free + radius * (np.arctan2(away, along) + np.arctan2(radius, free)))


def _wound(values: Array, angle: Array | float) -> Array:
    radius, growth = values[48:56], values[64]
    n = np.floor(np.asarray(angle) / _TURN)
    full = _TURN * (n * radius + growth * n * (n - 1) / 2)
    return np.asarray((angle - _TURN * n) * (radius + n * growth) + full)

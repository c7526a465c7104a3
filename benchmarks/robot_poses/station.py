"""A tracker as it truly stands: another frame, a reflector off the origin, a scale, an IMU.

Rows of :mod:`robot_poses.truth` as such an instrument shows them; nothing is shared with winchkit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robot_poses.truth import HOME, Row, Vector, turn
from winchkit.arrays import Array

__all__ = ["Station", "about"]

_ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Station:
    """What an instrument that was set up anew shows of a pose."""

    angle: float = 0.0
    """Turn of the readings about the robot's home pose, deg."""
    axis: Vector = (1.0, 2.0, 3.0)
    shift: Vector = _ZERO
    """Of the readings at home, m."""
    reflector: Vector = _ZERO
    """On the platform, m."""
    ppm: float = 0.0
    """Scale about the instrument, which stands three metres from the robot."""
    turns_rotation: bool = True
    """Whether the angles are measured in the same frame; an IMU's are not."""
    tracker: float = 2e-5
    """Standard deviation of a coordinate, m."""
    imu: float = 1e-3
    """Standard deviation of an angle, rad."""

    @property
    def rotation(self) -> Array:
        """Rodrigues' rotation of the readings, (3, 3)."""
        x, y, z = np.array(self.axis) / np.linalg.norm(self.axis)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        turned = math.radians(self.angle)
        cosine, sine = math.cos(turned), math.sin(turned)
        return np.asarray(np.eye(3) + sine * cross + (1 - cosine) * cross @ cross)

    def show(self, rows: Sequence[Row], seed: int) -> list[Row]:
        """Readings of the rows' true poses with the instrument's noise."""
        rng, turned, home = np.random.default_rng(seed), self.rotation, np.array(HOME)
        stand, out = home + np.array((3.0, 0.0, 0.0)), []
        for row in rows:
            platform = np.array(turn(*row.angles))
            seen = np.array(row.position) + platform @ np.array(self.reflector)
            seen = stand + (1 + self.ppm * 1e-6) * (seen - stand)
            seen = home + np.array(self.shift) + turned @ (seen - home)
            shown = turned @ platform if self.turns_rotation else platform
            x, y, z = (seen + rng.normal(0, self.tracker, 3)).tolist()
            a, b, c = (np.array(_angles(shown)) + rng.normal(0, self.imu, 3)).tolist()
            out.append(replace(row, seen_position=(x, y, z), seen_angles=(a, b, c)))
        return out


def about(angle: float, point: Vector = _ZERO, axis: Vector = (1.0, 2.0, 3.0)) -> Station:
    """A frame that is turned about another point than home."""
    turned = Station(angle, axis).rotation
    home = np.array(HOME)
    x, y, z = (turned @ (home - point) - (home - point)).tolist()
    return Station(angle, axis, (x, y, z))


def _angles(rotation: Array) -> Vector:
    """Roll, pitch and yaw of Rz(yaw) Ry(pitch) Rx(roll)."""
    return (
        math.atan2(rotation[2, 1], rotation[2, 2]),
        -math.asin(max(-1.0, min(1.0, rotation[2, 0]))),
        math.atan2(rotation[1, 0], rotation[0, 0]),
    )

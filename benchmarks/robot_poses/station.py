"""A tracker as it truly stands: another frame, a reflector off the origin, a scale, an IMU.

Rows of :mod:`robot_poses.truth` as such an instrument shows them; nothing is shared with winchkit.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robot_poses.hidden import Case, balanced
from robot_poses.truth import HOME, Noise, Row, Vector, csv, poses, turn
from winchkit.arrays import Array

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
    """Scale about the origin of its frame."""
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
        out = []
        for row in rows:
            platform = np.array(turn(*row.angles))
            seen = np.array(row.position) + platform @ np.array(self.reflector)
            seen = home + np.array(self.shift) + turned @ (seen - home)
            seen = (1 + self.ppm * 1e-6) * seen
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


def observed(
    case: Case,
    station: Station,
    *,
    count: int = 60,
    repeats: int | None = None,
    seed: int = 1,
    angles: bool = True,
    tension: bool = True,
) -> str:
    """A run of a robot with something hidden, as the instrument shows it."""
    again = case.repeats if repeats is None else repeats
    rows = [
        balanced(case, row, random.Random(seed * 1000 + n))
        for n, row in enumerate(poses(case.truth, count, seed, noise=Noise(0, 0, 0, 0, 0, 0, 0)))
    ]
    rng = np.random.default_rng(seed + 77)
    shown = [
        replace(
            row,
            motor_angle=tuple((np.array(row.motor_angle) + rng.normal(0, 1e-4, 8)).tolist()),
            tension=tuple((np.array(row.tension) + rng.normal(0, 0.3, 8)).tolist()),
        )
        for row in station.show([*rows, *rows[:again]], seed)
    ]
    return csv(shown, angles=angles, tension=tension)


def _angles(rotation: Array) -> Vector:
    """Roll, pitch and yaw of Rz(yaw) Ry(pitch) Rx(roll)."""
    return (
        math.atan2(rotation[2, 1], rotation[2, 2]),
        -math.asin(max(-1.0, min(1.0, rotation[2, 0]))),
        math.atan2(rotation[1, 0], rotation[0, 0]),
    )

"""A log of a robot in motion: a smooth path, cable forces that carry and accelerate the platform.

Nothing is shared with winchkit. The platform's mass is at its origin and has no moment of inertia.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from robot_poses.hidden import BASE, MASS, _arm, _slope
from robot_poses.truth import GRAVITY, HOME, Row, Truth, Vector, turn
from winchkit.arrays import Array

_STEP = 1e-3
_ORIGIN: Vector = (0.0, 0.0, 0.0)


def place(time: float, speed: float = 1.0) -> tuple[Vector, Vector]:
    """Position, m, and roll, pitch, yaw, rad, at a time, s."""
    w = speed * time
    x = 0.07 * math.sin(1.1 * w)
    y = 0.07 * math.sin(1.7 * w + 0.5) - 0.07 * math.sin(0.5)
    z = 0.06 * math.sin(1.3 * w)
    angles = (0.12 * math.sin(0.9 * w), 0.12 * math.sin(1.4 * w), 0.12 * math.sin(0.7 * w))
    return (HOME[0] + x, HOME[1] + y, HOME[2] + z), angles


def log(
    path: Path,
    *,
    truth: Truth = BASE,
    count: int = 160,
    rate: float = 20.0,
    delay: float = 0.0,
    mass: float = MASS,
    home: tuple[float, ...] = (0.0,) * 8,
    cell: Callable[[Array], Array] | None = None,
    seed: int = 1,
    cell_noise: float = 0.3,
) -> Path:
    """Write a log: the tracker shows the pose of ``delay`` seconds before each row."""
    rng, rows = np.random.default_rng(seed), []
    for k in range(count):
        t = k / rate
        at, angles = place(t)
        force = _forces(truth, t, mass, rng)
        turned = turn(*angles)
        motor = []
        for i in range(8):
            angle = truth.motor_angle(i, at, turned, float(force[i]))
            motor.append(angle + home[i] / _arm(truth, i, angle))
        seen_at, seen_angles = place(t - delay)
        shown = force if cell is None else cell(force)
        values = [
            t,
            *(np.array(motor) + rng.normal(0, 1e-4, 8)),
            *(np.array(seen_at) + rng.normal(0, 2e-5, 3)),
            *(np.array(seen_angles) + rng.normal(0, 3e-4, 3)),
            *(shown + rng.normal(0, cell_noise, 8)),
        ]
        rows.append(",".join(f"{value:.9g}" for value in values))
    head = ["time [s]", *(f"{i + 1}.motor_angle [rad]" for i in range(8))]
    head += [f"platform_{axis} [m]" for axis in "xyz"]
    head += [f"platform_{axis} [rad]" for axis in ("roll", "pitch", "yaw")]
    head += [f"{i + 1}.tension [N]" for i in range(8)]
    path.write_text("\n".join([",".join(head), *rows]) + "\n")
    return path


def _forces(truth: Truth, time: float, mass: float, rng: np.random.Generator) -> Array:
    """Cable forces near slowly changing ones that balance weight and inertia (virtual work)."""
    here, angles = (np.array(part) for part in place(time))
    ends = [np.array(place(time + step)[0]) for step in (_STEP, -_STEP)]
    acceleration = (ends[0] - 2 * here + ends[1]) / _STEP**2
    wrench = np.zeros(6)
    wrench[:3] = mass * (np.array([0.0, 0.0, -GRAVITY]) - acceleration)
    x, y, z = here.tolist()
    a, b, c = angles.tolist()
    row = Row((x, y, z), (a, b, c), (), (x, y, z), (a, b, c), (), (), ())
    slope = _slope(truth, row)
    start = 50.0 + 15.0 * np.sin(0.8 * time + np.arange(8))
    return np.asarray(start + np.linalg.pinv(slope) @ (wrench - slope @ start))

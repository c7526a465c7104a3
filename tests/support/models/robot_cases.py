"""Robots to compute with, random ones and the papers'."""

from __future__ import annotations

from functools import cache

import numpy as np

from winchkit.catalog import find
from winchkit.model.rotation import rotation_by
from winchkit.robot import Geometry, Pose, Robot, robot_of
from winchkit.schema.read import read_robot

Array = np.ndarray


@cache
def shipped(name: str) -> Robot:
    """A robot of profiles/."""
    return robot_of(read_robot(find("profiles", name)))


def random_geometry(seed: int, lines: int = 8) -> Geometry:
    """Exit points on a sphere of 3 m, any swivel axes, pulleys of up to 0.1 m."""
    rng = np.random.default_rng(seed)
    axis, out = rng.normal(size=(2, lines, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    return Geometry(
        3.0 * out, rng.uniform(-0.3, 0.3, (lines, 3)), rng.uniform(0.0, 0.1, lines), axis
    )


def random_poses(seed: int, count: int, size: float = 1.0) -> Pose:
    """Anywhere within a cube, turned any way."""
    rng = np.random.default_rng(seed)
    return Pose(rng.uniform(-size, size, (count, 3)), rotation_by(rng.normal(size=(count, 3))))


def near(robot: Robot, seed: int, count: int, shift: float = 0.1, turn: float = 0.1) -> Pose:
    """Poses around a robot's home."""
    rng = np.random.default_rng(seed)
    return Pose(
        robot.home.position + rng.uniform(-shift, shift, (count, 3)),
        rotation_by(rng.uniform(-turn, turn, (count, 3))) @ robot.home.rotation,
    )

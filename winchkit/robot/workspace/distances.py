"""Distances of a robot's cables from each other and from bodies, along their straight parts.

The distance of a point from a convex body, negative inside, is a convex function; along a straight
cable its least value is found by golden section, exactly for boxes and cylinders. That of two
cables is the distance of two line segments.

References
----------
C. Ericson, *Real-Time Collision Detection*, 2005, 5.1.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from winchkit.arrays import Array
from winchkit.model.rotation import rotation_of
from winchkit.robot.geometry.kinematics import Pose, straight_cables
from winchkit.robot.geometry.robot import Robot
from winchkit.schema.robot_bench import BodySpec

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
_SECTIONS = 32
"""Each leaves 0.62 of the interval: 2e-7 of a cable's length in the end."""
_ENDS = 2.0
"""Length of cable at either end that does not count, in clearances: a cable that leaves a body, or
another cable, at more than 30 degrees is a clearance away from there."""


@dataclass(frozen=True)
class Distances:
    """Least distances at p poses, of each pair of cables and of each cable from each body."""

    between: tuple[str, ...]
    """What each of the c distances is between, in words."""
    distance: Array
    """Between surfaces, (p, c), m; negative where they intersect; NaN where a cable has no way."""
    point: Array
    """Where a distance is least, (p, c, 3), m, base frame."""
    clearance: float
    """Least distance that is wanted, m."""

    def text(self, row: int, column: int) -> str:
        """A distance with its place and the limit.

        Parameters
        ----------
        row, column : int
            Pose, and distance.

        Returns
        -------
        str
            In words.
        """
        x, y, z = self.point[row, column]
        apart = self.distance[row, column]
        words = f"are {apart * 1e3:.0f} mm apart" if apart > 0 else "intersect"
        return (
            f"{self.between[column]} {words} near x {x:.3f} m, y {y:.3f} m, z {z:.3f} m; "
            f"clearance of [robot] is {self.clearance * 1e3:.3g} mm"
        )


def distances(robot: Robot, bodies: Sequence[BodySpec], pose: Pose, clearance: float) -> Distances:
    """Distances of cables from each other and from bodies.

    Parameters
    ----------
    robot : Robot
        Cables count with their diameters where the winches have these, else as lines.
    bodies : sequence of BodySpec
        Boxes and cylinders in the base frame or on the platform.
    pose : Pose
        The p poses.
    clearance : float
        Two of it at either end of a cable do not count, m.

    Returns
    -------
    Distances
        Pairs of cables first, then each body with each cable.
    """
    start, end = straight_cables(robot.geometry, pose)
    length = np.linalg.norm(end - start, axis=2, keepdims=True)
    share = np.minimum(_ENDS * clearance / length, 0.5)
    start, end = start + share * (end - start), end - share * (end - start)
    radius = np.array([(winch.cable.diameter or 0.0) / 2 for winch in robot.winches])
    names = robot.names
    pairs = np.array(list(combinations(range(len(names)), 2)), dtype=int).reshape(-1, 2)
    one, two = pairs.T
    apart, point = _of_segments((start[:, one], end[:, one]), (start[:, two], end[:, two]))
    between = [f"cables {names[i]} and {names[j]}" for i, j in pairs.tolist()]
    parts, points = [apart - radius[one] - radius[two]], [point]
    for body in bodies:
        away, near = _from_body(body, pose, start, end)
        between += [f"cable {name} and {body.name}" for name in names]
        parts.append(away - radius)
        points.append(near)
    return Distances(
        tuple(between), np.concatenate(parts, axis=1), np.concatenate(points, axis=1), clearance
    )


def _of_segments(one: tuple[Array, Array], two: tuple[Array, Array]) -> tuple[Array, Array]:
    """Distances of line segments, (...), and the middles of their shortest connections."""
    (p, first), (q, last) = one, two
    along, across, gap = first - p, last - q, p - q
    a, e, b, c, f = (
        np.maximum(np.sum(u * v, axis=-1), floor)
        for u, v, floor in (
            (along, along, np.finfo(float).tiny),
            (across, across, np.finfo(float).tiny),
            (along, across, -np.inf),
            (along, gap, -np.inf),
            (across, gap, -np.inf),
        )
    )
    square = a * e - b * b
    parallel = square <= 1e-12 * a * e
    s = np.where(parallel, 0.0, (b * f - c * e) / np.where(parallel, 1.0, square)).clip(0, 1)
    t = ((b * s + f) / e).clip(0, 1)
    s = ((b * t - c) / a).clip(0, 1)
    here, there = p + s[..., None] * along, q + t[..., None] * across
    return np.linalg.norm(here - there, axis=-1), (here + there) / 2


def _from_body(body: BodySpec, pose: Pose, start: Array, end: Array) -> tuple[Array, Array]:
    """Least distance of each segment from a body, (p, n), and the points of the segments."""
    centre, turn = np.array(body.position), rotation_of(*body.rotation)
    if body.on == "platform":
        turned = pose.rotation @ turn
        origin = (pose.position + pose.rotation @ centre)[:, None]
    else:
        turned, origin = turn[None], centre
    begin, stop = ((points - origin) @ turned for points in (start, end))

    def away(share: Array) -> Array:
        return _signed(body, begin + share[..., None] * (stop - begin))

    low, high = np.zeros(start.shape[:2]), np.ones(start.shape[:2])
    inner, outer = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_inner, at_outer = away(inner), away(outer)
    for _ in range(_SECTIONS):
        left = at_inner < at_outer
        low, high = np.where(left, low, inner), np.where(left, outer, high)
        kept = np.where(left, inner, outer)
        new = np.where(left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        at_kept, at_new = np.where(left, at_inner, at_outer), away(new)
        inner, outer = np.where(left, new, kept), np.where(left, kept, new)
        at_inner, at_outer = np.where(left, at_new, at_kept), np.where(left, at_kept, at_new)
    share = (low + high) / 2
    return away(share), start + share[..., None] * (end - start)


def _signed(body: BodySpec, point: Array) -> Array:
    """Distance of points in the axes of a body, negative inside, (...)."""
    if body.size is not None:
        beyond = np.abs(point) - np.array(body.size) / 2
    else:
        assert body.radius is not None, "the file's rules"
        assert body.height is not None, "the file's rules"
        radial = np.hypot(point[..., 0], point[..., 1]) - body.radius
        beyond = np.stack([radial, np.abs(point[..., 2]) - body.height / 2], axis=-1)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return np.asarray(outside + np.minimum(beyond.max(axis=-1), 0.0))

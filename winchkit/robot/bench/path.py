"""Paths of the platform: lines, arcs and blended corners, by their length.

A pose is a point of six coordinates: position (m), and rotation vector from the rotation at the
beginning of the path, in base axes, times a length ρ. With ρ = speed limit / rotation speed limit,
the platform's speed limit along the path is its limit of rotation too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by, rotation_rates, rotation_vector
from winchkit.robot.geometry.kinematics import Pose

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_SPACING = 2e-3
"""Of samples along the path, m."""
_FEWEST = 33
"""On each piece of a path: a curve of half a turn in 32 chords is off by 0.1 % of its radius."""
_FEWEST_OF_CORNER = 65
"""The speed along corners of up to 154 degrees is right to 0.4 %; with 33 samples, to 2 %."""
_SAME = 1e-7
"""Points closer than this are one, m."""
_STRAIGHT = 1e-6
"""Sine of the angle at which three points lie on a line."""
_MOST_ROTATION = 2.8
"""From the rotation at the beginning of the path, rad: the rotation vector is unique below π."""


@dataclass(frozen=True)
class Waypoint:
    """A pose to go to, on a line or an arc."""

    position: Array
    """(3,), m."""
    rotation: Array
    """From platform to base axes, (3, 3)."""
    via: Array | None = None
    """Position on the arc to it, (3,), m; None for a line."""
    blend: float = 0.0
    """Distance from it at which the path leaves for the next waypoint, m; 0 stops there."""


@dataclass(frozen=True)
class PlatformPath:
    """A smooth path by its length s."""

    length: float
    """m; rotation counts as ρ times its angle."""
    curvature: float
    """Largest, 1/m."""
    start: Array
    """Rotation at its beginning, (3, 3)."""
    scale: float
    """ρ, m."""
    curve: CubicSpline
    """Six coordinates by s."""

    def pose(self, distance: Array) -> Pose:
        """Poses at distances (k,) along the path, m."""
        point = self.curve(distance)
        return Pose(point[:, :3], rotation_by(point[:, 3:] / self.scale) @ self.start)

    def derivatives(self, distance: Array) -> tuple[Array, Array]:
        """First and second derivative of the pose by s, (k, 6) each: of the position, then angular
        in base axes."""
        point, first, second = (self.curve(distance, order) for order in range(3))
        turning = rotation_rates(*(one[:, 3:] / self.scale for one in (point, first, second)))
        return np.hstack([first[:, :3], turning[0]]), np.hstack([second[:, :3], turning[1]])


def paths_through(start: Pose, waypoints: Sequence[Waypoint], scale: float) -> list[PlatformPath]:
    """Smooth paths from a pose through waypoints, each from a stop to the next one, but for those
    of length zero. A corner is a Bézier curve of degree five with no curvature at its ends, of at
    most half of the adjacent lines. Raises UsageError for an arc through points on a line, or a
    rotation beyond 160 degrees."""
    here = Waypoint(start.position[0], start.rotation[0])
    paths = []
    group: list[Waypoint] = []
    for waypoint in waypoints:
        group.append(waypoint)
        if waypoint.blend == 0.0 or waypoint is waypoints[-1]:
            path = _path(here, group, scale)
            if path is not None:
                paths.append(path)
            here, group = waypoint, []
    return paths


def _path(start: Waypoint, waypoints: Sequence[Waypoint], scale: float) -> PlatformPath | None:
    from scipy.interpolate import CubicSpline

    knots = [_point(start, start, scale), *(_point(start, one, scale) for one in waypoints)]
    largest = max(float(np.linalg.norm(knot[3:])) / scale for knot in knots)
    if largest > _MOST_ROTATION:
        raise UsageError(
            f"the platform would turn by {np.degrees(largest):.0f} deg on one path; at most "
            f"{np.degrees(_MOST_ROTATION):.0f} deg are planned at once, so stop between"
        )
    pieces = [piece for piece in _pieces(knots, waypoints) if len(piece)]
    if not pieces:
        return None
    points = np.concatenate(pieces)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    kept = np.concatenate([[True], steps > _SAME / _FEWEST])
    points = points[kept]
    if len(points) < 3:
        return None
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    curve = CubicSpline(length, points)
    fine = np.linspace(0.0, length[-1], 2 * len(length))
    curvature = float(np.max(np.linalg.norm(curve(fine, 2), axis=1)))
    return PlatformPath(float(length[-1]), curvature, start.rotation, scale, curve)


def _point(start: Waypoint, one: Waypoint, scale: float) -> Array:
    turned = rotation_vector(one.rotation @ start.rotation.T)
    return np.concatenate([one.position, scale * turned])


def _pieces(knots: Sequence[Array], waypoints: Sequence[Waypoint]) -> list[Array]:
    """Samples of lines, arcs and corners, in order."""
    out: list[Array] = []
    here = knots[0]
    for n, waypoint in enumerate(waypoints):
        goal = knots[n + 1]
        if waypoint.via is not None:
            out.append(_arc(here, waypoint.via, goal))
            here = goal
            continue
        leave = goal
        following = knots[n + 2] if n + 2 < len(knots) else None
        if waypoint.blend > 0 and following is not None:
            leave = _toward(goal, knots[n], waypoint.blend)
            enter = _toward(goal, following, waypoint.blend)
            out += [_line(here, leave), _corner(leave, goal, enter)]
            here = enter
            continue
        out.append(_line(here, leave))
        here = leave
    return out


def _toward(corner: Array, other: Array, distance: float) -> Array:
    """Point at a distance from a corner, at most half way to the other point."""
    span = float(np.linalg.norm(other - corner))
    share = min(distance / span, 0.5) if span > _SAME else 0.0
    return np.asarray(corner + share * (other - corner))


def _share(length: float, fewest: int = _FEWEST) -> Array:
    return np.linspace(0.0, 1.0, max(fewest, int(np.ceil(length / _SPACING)) + 1))


def _line(start: Array, end: Array) -> Array:
    length = float(np.linalg.norm(end - start))
    if length < _SAME:
        return np.empty((0, 6))
    return np.asarray(start + _share(length)[:, None] * (end - start))


def _corner(start: Array, corner: Array, end: Array) -> Array:
    length = float(np.linalg.norm(corner - start) + np.linalg.norm(end - corner))
    u = _share(length, _FEWEST_OF_CORNER)[:, None]
    v = 1 - u
    first, last = (start + corner) / 2, (end + corner) / 2
    inner = 10 * u**2 * v**3 * corner + 10 * u**3 * v**2 * corner
    outer = v**5 * start + 5 * u * v**4 * first + 5 * u**4 * v * last + u**5 * end
    return np.asarray(inner + outer)


def _arc(start: Array, via: Array, end: Array) -> Array:
    """Circular arc through three positions; the rotation changes in proportion."""
    a, b, c = start[:3], via, end[:3]
    first, second = b - a, c - a
    normal = np.cross(first, second)
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    square = float(normal @ normal)
    if size < _SAME**2 or np.sqrt(square) <= _STRAIGHT * size:
        raise UsageError(
            "an arc goes through three positions that are not on a line; "
            f"via = {np.round(b, 4).tolist()} m is on the line to the end"
        )
    across = np.cross(normal, first) * (second @ second) + np.cross(second, normal) * (
        first @ first
    )
    centre = a + across / (2 * square)
    radius = a - centre
    axis = normal / np.sqrt(square)
    side = np.cross(axis, radius)
    angle = float(np.arctan2((c - centre) @ side, (c - centre) @ radius)) % (2 * np.pi)
    share = _share(angle * float(np.linalg.norm(radius)))
    turned = share[:, None] * angle
    position = centre + np.cos(turned) * radius + np.sin(turned) * side
    rotation = start[3:] + share[:, None] * (end[3:] - start[3:])
    return np.concatenate([position, rotation], axis=1)

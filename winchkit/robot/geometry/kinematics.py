"""Inverse kinematics of a cable robot with swivel pulleys, with all first derivatives.

The cable reaches its pulley along ``swivel_axis`` and first touches it in ``exit_point``; the
pulley's centre lies ``swivel_radius`` from there, square to the axis, towards the anchor. With x
the anchor's distance from the axis, y its coordinate along it, r the radius and D = hypot(x − r, y)

    free = √(D² − r²),  wrap = atan2(x − r, y) + atan2(r, free),  length = r wrap + free

(A. Pott, *Influence of pulley kinematics on cable-driven parallel robots*, 2012). With radius zero
the exit point is fixed. All is in SI and in batches of p poses of a robot with n lines.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.rotation import cross, rotation_by, rotation_of, rotation_vector
from winchkit.robot.geometry.loops import LEAST_WRAP

if TYPE_CHECKING:
    from winchkit.schema.profiles.robot import RobotProfile

_CHUNK = 1024
"""Poses: an array of eight cables is then 64 KB, and a dozen of them fit the second-level cache (1
MB)."""


@dataclass(frozen=True)
class Geometry:
    """Exit points, anchor points and swivel pulleys of n lines."""

    exit_point: Array
    """In the base frame, (n, 3), m."""
    anchor_point: Array
    """In the platform frame, (n, 3), m."""
    swivel_radius: Array
    """(n,), m; zero is a fixed exit point."""
    swivel_axis: Array
    """Unit vectors of the cable's direction when it reaches the pulley, base frame, (n, 3)."""
    free: Array = field(default_factory=lambda: np.ones(6))
    """1 for each degree of freedom of the platform, by position and rotation vector in base axes, 0
    for a coordinate that guides hold; (6,). Derivatives by the latter are zero, since the platform
    cannot move there, and so are their rows of structure matrices, where guides balance."""

    @property
    def degrees(self) -> int:
        """Number of degrees of freedom of the platform; fewer cables leave it hanging."""
        return int(np.count_nonzero(self.free))

    @property
    def size(self) -> float:
        """Largest distance of two exit points, m."""
        between = self.exit_point[:, None] - self.exit_point
        return float(np.max(np.linalg.norm(between, axis=2)))


@dataclass(frozen=True)
class Pose:
    """Poses of the platform, one or p of them."""

    position: Array
    """Of the platform frame's origin in the base frame, (p, 3), m."""
    rotation: Array
    """Platform to base, (p, 3, 3)."""

    def __getitem__(self, rows: slice | np.bool_ | NDArray[Any] | list[int]) -> Pose:
        """Some of the poses, by a slice, a mask or indices."""
        return Pose(self.position[rows], self.rotation[rows])


@dataclass(frozen=True)
class Sensitivities:
    """First derivatives of one quantity per line, such as its length."""

    position: Array
    """By the platform's position, (p, n, 3)."""
    rotation: Array
    """By a small rotation vector in the base frame, (p, n, 3), per rad."""
    exit_point: Array
    """By the line's own exit point, (p, n, 3)."""
    anchor_point: Array
    """By the line's own anchor point, (p, n, 3)."""
    swivel_radius: Array
    """By the line's own swivel radius, (p, n)."""


def lever_of(geometry: Geometry) -> float:
    """Rms distance of the anchor points from the platform's origin, m."""
    return float(np.sqrt(np.mean(np.sum(geometry.anchor_point**2, axis=1))))


def by_pose(by: Sensitivities) -> Array:
    """Derivatives by position and rotation vector beside each other, (p, n, 6)."""
    return np.concatenate([by.position, by.rotation], axis=-1)


class _Tangent(NamedTuple):
    """The cable around its pulley: arrays of shape (p, n), vectors by component."""

    arm: tuple[Array, Array, Array]
    """Anchor point relative to the platform's origin, in base axes."""
    outward: tuple[Array, Array, Array]
    """From the axis to the anchor, perpendicular to the axis, not normalised."""
    distance: Array
    """Length of ``outward``."""
    free: Array
    wrap: Array
    cosine: Array
    sine: Array


def geometry_of(profile: RobotProfile) -> Geometry:
    """The geometry that a robot's profile declares; its axes become unit vectors."""
    axis = np.array([line.swivel_axis for line in profile.line], dtype=float)
    return Geometry(
        np.array([line.exit_point for line in profile.line], dtype=float),
        np.array([line.anchor_point for line in profile.line], dtype=float),
        np.array([line.swivel_radius for line in profile.line], dtype=float),
        axis / np.linalg.norm(axis, axis=1, keepdims=True),
        np.array(profile.platform.free),
    )


def home_of(profile: RobotProfile) -> Pose:
    """The home pose that a robot's profile declares, (1, 3) and (1, 3, 3).

    Parameters
    ----------
    profile : RobotProfile
        The robot.

    Returns
    -------
    Pose
        One pose.
    """
    rotation = rotation_of(*profile.home.rotation)
    return Pose(np.array([profile.home.position], dtype=float), rotation[None])


def guided(pose: Pose, home: Pose, free: Array) -> Pose:
    """Poses with those coordinates of ``home``, one pose, that guides hold."""
    if free.all():
        return pose
    turned = rotation_vector(pose.rotation @ home.rotation[0].T) * free[3:]
    place = np.where(free[:3] > 0, pose.position, home.position)
    return Pose(place, rotation_by(turned) @ home.rotation)


def _tangent(geometry: Geometry, position: Array, rotation: Array) -> _Tangent:
    """Tangents from anchor points to pulleys; NaN where an anchor lies inside its pulley."""
    b, e, s = geometry.anchor_point.T, geometry.exit_point, geometry.swivel_axis
    r = geometry.swivel_radius
    arm = (rotation[:, 0] @ b, rotation[:, 1] @ b, rotation[:, 2] @ b)
    seen = [arm[k] + (position[:, k, None] - e[:, k]) for k in range(3)]
    along = seen[0] * s[:, 0] + seen[1] * s[:, 1] + seen[2] * s[:, 2]
    hx, hy, hz = (seen[k] - along * s[:, k] for k in range(3))
    distance = np.sqrt(hx * hx + hy * hy + hz * hz)
    over = distance - r
    square = over * over + along * along
    free = np.sqrt(np.where(square >= r * r, square - r * r, np.nan))
    # Sum of DESIGN's two angles by one complex product: over + i along turned by the tangent's.
    sine, cosine = over * free + along * r, along * free - over * r
    wrap = np.arctan2(sine, cosine)
    # Round the back of the pulley the sum of the two passes half a turn.
    wrap += np.where(wrap < LEAST_WRAP, 2 * np.pi, 0.0)
    return _Tangent(arm, (hx, hy, hz), distance, free, wrap, cosine, sine)


def lengths(geometry: Geometry, position: Array, rotation: Array) -> Array:
    """Lengths from exit point to anchor point with the arc on the pulley.

    Parameters
    ----------
    geometry : Geometry
        Of n lines.
    position : (p, 3) array
        Of the platform's origin in the base frame, m.
    rotation : (p, 3, 3) array
        From platform to base axes.

    Returns
    -------
    (p, n) array
        m; NaN where an anchor point lies inside its pulley.
    """
    out = np.empty((len(position), len(geometry.exit_point)))
    # In pieces that fit the processor's cache: half the time for many poses.
    for start in range(0, len(position), _CHUNK):
        piece = slice(start, start + _CHUNK)
        t = _tangent(geometry, position[piece], rotation[piece])
        np.multiply(geometry.swivel_radius, t.wrap, out=t.wrap)
        np.add(t.wrap, t.free, out=out[piece])
    return out


def wrap_angle(geometry: Geometry, position: Array, rotation: Array) -> Array:
    """Wrap angle of the cable on its swivel pulley, (p, n), rad."""
    return _tangent(geometry, position, rotation).wrap


def sensitivities(geometry: Geometry, position: Array, rotation: Array) -> Sensitivities:
    """Derivatives of :func:`lengths`, arguments as there.

    Notes
    -----
    With u the cable's direction from pulley to platform:

    ∂L/∂c = u, ∂L/∂ω = (R b) × u, ∂L/∂p = −u, ∂L/∂b = Rᵀ u, ∂L/∂r = wrap − sin wrap.
    """
    return linearised(geometry, position, rotation)[1]


def linearised(geometry: Geometry, position: Array, rotation: Array) -> tuple[Array, Sensitivities]:
    """:func:`lengths` and :func:`sensitivities` together."""
    t = _tangent(geometry, position, rotation)
    # D²: sine and cosine are those of the product of two numbers of modulus D.
    scale = t.free * t.free + geometry.swivel_radius * geometry.swivel_radius
    scale = np.where(scale > 0, scale, np.nan)
    sine, cosine = t.sine / scale, t.cosine / scale
    unit = np.stack([sine * h for h in _unit(t)], axis=-1)
    unit += cosine[..., None] * geometry.swivel_axis
    length = geometry.swivel_radius * t.wrap + t.free
    return length, _by_anchor(geometry, unit, t, rotation, t.wrap - sine)


def straight_cables(geometry: Geometry, pose: Pose) -> tuple[Array, Array]:
    """Ends of the cables between pulley and platform, (p, n, 3) each, m, in the base frame; NaN
    where an anchor lies inside its pulley."""
    t = _tangent(geometry, pose.position, pose.rotation)
    away = -linearised(geometry, pose.position, pose.rotation)[1].exit_point
    end = np.stack(t.arm, axis=-1) + pose.position[:, None]
    return end - t.free[..., None] * away, end


def swivel_angle(geometry: Geometry, position: Array, rotation: Array) -> Array:
    """Angle of the swivelling pulley about its axis, right-handed.

    Parameters
    ----------
    geometry : Geometry
        Geometry of n lines.
    position : (p, 3) array
        Of the platform's origin in the base frame, m.
    rotation : (p, 3, 3) array
        From platform to base axes.

    Returns
    -------
    (p, n) array
        rad, within ±π. Zero is the direction of the base axis that is most nearly perpendicular to
        the swivel axis (x for a vertical one), projected; NaN where the anchor lies on the axis.
    """
    t = _tangent(geometry, position, rotation)
    outward = np.stack(t.outward, axis=-1)
    zero, quarter = _swivel_frame(geometry.swivel_axis)
    angle = np.arctan2(np.sum(outward * quarter, axis=-1), np.sum(outward * zero, axis=-1))
    return np.asarray(np.where(t.distance > 0, angle, np.nan))


def swivel_sensitivities(geometry: Geometry, position: Array, rotation: Array) -> Sensitivities:
    """Derivatives of :func:`swivel_angle`, rad per m and rad per rad.

    Parameters
    ----------
    geometry : Geometry
        Geometry of n lines.
    position : (p, 3) array
        Of the platform's origin in the base frame, m.
    rotation : (p, 3, 3) array
        From platform to base axes.

    Returns
    -------
    Sensitivities
        Derivatives per line.
    """
    t = _tangent(geometry, position, rotation)
    across = cross(geometry.swivel_axis, np.stack(_unit(t), axis=-1))
    distance = np.where(t.distance > 0, t.distance, np.nan)
    by_anchor = across / distance[..., None]
    return _by_anchor(geometry, by_anchor, t, rotation, np.zeros_like(t.wrap))


def structure_matrix(geometry: Geometry, position: Array, rotation: Array) -> Array:
    """Structure matrices Aᵀ: their product with the cable forces is the wrench on the platform.

    Parameters
    ----------
    geometry : Geometry
        Geometry of n lines.
    position : (p, 3) array
        Of the platform's origin in the base frame, m.
    rotation : (p, 3, 3) array
        From platform to base axes.

    Returns
    -------
    (p, 6, n) array
        Forces first, then moments about the platform's origin, base axes; Aᵀ f + w = 0 at rest
        (IPAnema paper, Eq. 7). Rows of coordinates that guides hold are zero.
    """
    return -by_pose(sensitivities(geometry, position, rotation)).transpose(0, 2, 1)


def _unit(t: _Tangent) -> list[Array]:
    """``outward`` of length one; zero for an anchor on the axis."""
    distance = np.where(t.distance > 0, t.distance, 1.0)
    return [h / distance for h in t.outward]


def _by_anchor(
    geometry: Geometry, gradient: Array, t: _Tangent, rotation: Array, radius: Array
) -> Sensitivities:
    """Derivatives of a quantity whose gradient by the anchor's place in the base is known."""
    arm = np.stack(t.arm, axis=-1)
    turned = gradient @ rotation
    by_rotation = cross(arm, gradient) * geometry.free[3:]
    return Sensitivities(gradient * geometry.free[:3], by_rotation, -gradient, turned, radius)


def _swivel_frame(axis: Array) -> tuple[Array, Array]:
    """Directions of swivel angles zero and a quarter turn, each (n, 3)."""
    least = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    zero = least - np.sum(least * axis, axis=1, keepdims=True) * axis
    zero /= np.linalg.norm(zero, axis=1, keepdims=True)
    return zero, cross(axis, zero)

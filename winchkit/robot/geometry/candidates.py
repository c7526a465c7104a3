"""Poses at which an iteration came to rest: which of several is the one of given cable lengths."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.robot.geometry.kinematics import Geometry, Pose, by_pose, sensitivities
from winchkit.robot.geometry.wrench import gravity_wrench, is_carried
from winchkit.schema.profiles.robot import PlatformSpec

RESOLUTION = 1e-8
"""Difference of lengths, m, up to which they are met exactly: a hundred times the last step, below
the resolution of any drum's encoder."""
BETTER = 3.0
"""Ratio of two poses' residuals above which the pose with the smaller one is the solution: errors
of the two spare lengths of eight cables have it by chance in one case of ten."""
_DISTINCT = 1e-2
"""Distance, m and rad, from which on two poses are two solutions. Near a singular pose lengths of
16 m are the same to `RESOLUTION` over 0.6 mm, the root of 2 · 16 m · 1e-8 m."""


@dataclass(frozen=True)
class Candidates:
    """One pose of p where an iteration came to rest; the arrays are changed in place."""

    position: Array
    rotation: Array
    worst: Array
    """Largest residual, (p,), m; infinite without a pose."""
    apart: Array
    """Distance from the start, m and rad, (p,)."""

    @classmethod
    def none(cls, many: int) -> Candidates:
        """No pose yet."""
        return cls(
            np.full((many, 3), np.nan),
            np.full((many, 3, 3), np.nan),
            np.full(many, np.inf),
            np.full(many, np.inf),
        )

    @property
    def pose(self) -> Pose:
        """The poses."""
        return Pose(self.position, self.rotation)

    def pose_where(self, good: NDArray[np.bool_]) -> Pose:
        """The poses, NaN elsewhere."""
        position = np.where(good[:, None], self.position, np.nan)
        return Pose(position, np.where(good[:, None, None], self.rotation, np.nan))

    def put(self, rows: NDArray[np.intp], other: Candidates, which: NDArray[np.bool_]) -> None:
        """Replace the poses of ``rows`` by those of ``which`` among as many others."""
        for mine, theirs in zip(_arrays(self), _arrays(other), strict=True):
            mine[rows[which]] = theirs[which]

    def of(self, rows: NDArray[np.intp]) -> Candidates:
        """The poses of some rows."""
        return Candidates(*(mine[rows] for mine in _arrays(self)))

    def before(self, other: Candidates) -> NDArray[np.bool_]:
        """Whether each is preferred: it meets the lengths better, or as well and is nearer."""
        mine, theirs = np.maximum(self.worst, RESOLUTION), np.maximum(other.worst, RESOLUTION)
        return np.asarray((mine < theirs) | ((mine == theirs) & (self.apart < other.apart)))


def _arrays(found: Candidates) -> tuple[Array, ...]:
    return found.position, found.rotation, found.worst, found.apart


def distance(one: Pose, other: Pose) -> Array:
    """Distance of two poses and rotation from one to the other, added, m and rad, (p,)."""
    turned = np.linalg.norm(one.rotation - other.rotation, axis=(1, 2)) / np.sqrt(2)
    return np.asarray(np.linalg.norm(one.position - other.position, axis=1) + turned)


def admit(new: Candidates, best: Candidates, other: Candidates, rows: NDArray[np.intp]) -> None:
    """Put new candidates of some rows to the first or second place where they are preferred."""
    old = best.of(rows)
    distinct = ~(distance(new.pose, old.pose) <= _DISTINCT)
    first = np.isfinite(new.worst) & new.before(old)
    other.put(rows, old, first & distinct)
    best.put(rows, new, first)
    other.put(rows, new, distinct & ~first & new.before(other.of(rows)))


def are_rivals(best: Candidates, other: Candidates) -> NDArray[np.bool_]:
    """Whether the second pose of each meets the lengths as well as the first, (p,)."""
    return np.asarray(other.worst <= BETTER * np.maximum(best.worst, RESOLUTION))


def prefer_carried(
    geometry: Geometry,
    platform: PlatformSpec,
    found: tuple[Candidates, Candidates],
    limit: float,
) -> None:
    """Exchange two poses where only the second can carry the weight, of whatever size, and meets
    the lengths as well as the first or to within ``limit``, m."""
    best, other = found
    meets = are_rivals(best, other) | (other.worst <= limit)
    rows = np.flatnonzero(np.isfinite(other.worst) & meets)
    first, second = best.of(rows), other.of(rows)
    heavy = replace(platform, mass=platform.mass or 1.0)

    def carried(found: Candidates) -> NDArray[np.bool_]:
        slope = by_pose(sensitivities(geometry, found.position, found.rotation))
        return is_carried(slope, gravity_wrench(heavy, found.rotation) * geometry.free)

    better = ~carried(first) & carried(second) if len(rows) else np.zeros(0, dtype=bool)
    best.put(rows, second, better)
    other.put(rows, first, better)

"""Forward kinematics: the platform's pose from cable lengths.

With as many cables as degrees of freedom, or more, that hold all of these, the pose is the
least-squares solution of the lengths (Gauss-Newton, after twelve steps Newton). With fewer, the
platform hangs where its potential energy is least under the constraint of the lengths (sequential
quadratic programming; Lagrange's multipliers are the cable forces); a cable whose force would be
negative is slack, and its length is a bound and not an equation (active set).

The squares of the lengths have local minima beside the pose. A pose whose lengths are not met is
therefore searched from other starts: for each rotation of a lattice about the start, the position
is fitted to the lengths, and the iteration begins at those that meet them best. Of two poses that
meet them as well, such as mirror images above and below the exit points, the one is preferred in
which the cables can carry the platform's weight.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot.geometry.candidates import (
    BETTER,
    RESOLUTION,
    Candidates,
    admit,
    are_rivals,
    distance,
    prefer_carried,
)
from winchkit.robot.geometry.hessian import length_hessian
from winchkit.robot.geometry.kinematics import (
    Geometry,
    Pose,
    by_pose,
    lengths,
    linearised,
    sensitivities,
)
from winchkit.robot.geometry.wrench import gravity_wrench, weight_hessian
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.units import GRAVITY

_TOLERANCE = 1e-10
"""Last step, m and rad: above rounding (1e-15 on 1 m), a thousandth of the resolution of a laser
tracker (0.1 µm)."""
_RANK = 1e-7
"""Singular values of the length derivatives below this share of the largest count as zero; its
square is `_RIDGE`, so that both forms of the equations leave out the same motions."""
_WEAK = 1e-2
"""The same share for hanging platforms beside a singular pose, such as a level one on four cables
in two planes of symmetry: there no motion changes one combination of the lengths, and lengths that
are a micrometre inconsistent have no pose (rule of thumb)."""
_FLAT = 1e-9
"""Curvatures of the energy below this share of the largest count as zero: above the rounding
(1e-16) of the largest, and no step along them (rule of thumb)."""
_LONGEST = (0.5, 0.2, 0.08, 0.03)
"""Longest step, m and rad, in each of the first dozens of iterations: shorter ones end an
oscillation between two poses (rule of thumb)."""
_EARLY, _PATIENCE = 12, 9
"""Iterations with one longest step, and between two tests of the taut cables (rule of thumb: Newton
converges in fewer than nine where the set is right)."""
_RIDGE = 1e-14
"""Of a normal matrix with a unit diagonal: fifty times its rounding (2e-16), so that it can be
solved where a motion keeps every length."""
_LOOSE = 1e-11
"""Eigenvalue of the same matrix from which on a motion changes lengths: 3e-6 of a singular value,
above what the last step leaves of a singular pose (rule of thumb)."""
_PUSH, _SHORT = 1e-9, 1e-9
"""Force, as a share of the platform's weight, and excess length, m, up to which a cable is neither
pushing nor too short: ten times the last step."""
AGREEMENT = 0.02
"""Largest difference between given and geometric length at a pose, m: a larger one is a wrong
reference, a slipped or a slack cable (rule of thumb: four standard deviations of the exit points'
prior)."""
_SPACING, _WIDEST = 0.35, 1.6
"""Lattice of the starts' rotation vectors, rad: every rotation is within 0.3 rad of one, from where
99 % of the iterations end in the solution of a robot with pulleys in space; a platform turned by
more than a quarter of a turn from the start has crossed its cables."""
_PLACING, _PULLED = 4, 1e-2
"""Steps that fit the position of each start, and their damping as a share of a cable: after four
the rest is below what the lattice's spacing leaves (rule of thumb)."""
_STARTS = 32
"""Starts of one pose: where exit points lie in a plane, half of them end in the solution, so that
one pose in 4e9 is missed."""
_USUAL, _OUTLYING = 0.1, 2.5e-5
"""Quantile of the residuals of many poses that is the scale of their lengths' errors even where
most are local minima, and share of poses with normal errors whose residual stands out."""
_PIECE = 32
"""Poses whose starts are computed at once: 20 MB with eight cables."""


@dataclass(frozen=True)
class PosesFound:
    """Poses for given cable lengths; NaN where none meets them."""

    pose: Pose
    converged: NDArray[np.bool_]
    """(p,), true where the iteration converged to rounding and the lengths are met."""
    residual: Array
    """Given less geometric length, (p, n), m, at the pose that meets them best, even where that is
    not within the tolerance."""
    other: Pose
    """A second pose that meets the lengths as well; NaN where the search met none."""
    forces: Array
    """Cable forces of a hanging platform, (p, n), N, zero in a slack cable; NaN where cables hold
    all degrees of freedom, since they may be tight to any degree."""
    steps: int


def forward(
    geometry: Geometry,
    given: Array,
    start: Pose,
    platform: PlatformSpec | None = None,
    steps: int = 100,
    *,
    tolerance: float = AGREEMENT,
    search: float | Literal["outlying"] = RESOLUTION,
) -> PosesFound:
    """Solve the forward kinematics of p poses.

    Parameters
    ----------
    geometry : Geometry
        Of n lines.
    given : (p, n) array
        Cable lengths, m.
    start : Pose
        Where the iteration starts, one pose or p; coordinates that guides hold keep its values.
    platform : PlatformSpec, optional
        Mass and centre of mass, needed for fewer cables than degrees of freedom.
    steps : int
        Most steps.
    tolerance : float
        Largest residual of a length that is met, m; infinite for the pose that fits best.
    search : float or "outlying"
        Largest residual without a search from other starts, m: ``tolerance`` where the start is
        near the pose, negative for a search that also finds other solutions of every pose.
        "outlying", for many poses of measured lengths, is the residual that errors of the size
        that a tenth of them have exceed in one of 4e4. Hanging platforms are not searched.

    Returns
    -------
    PosesFound
        NaN where no pose within a quarter turn of the start meets the lengths.

    Raises
    ------
    UsageError
        For fewer cables than degrees of freedom without a platform's mass.
    """
    count = len(geometry.exit_point)
    given = np.atleast_2d(np.asarray(given, dtype=float))
    if given.shape[1] != count:
        raise UsageError(f"{given.shape[1]} lengths were given for a robot of {count} lines")
    hanging = count < geometry.degrees
    if hanging and (platform is None or platform.mass <= 0):
        raise UsageError(
            f"{count} lines leave the platform {geometry.degrees - count} degrees of freedom, "
            "whose rest position depends on its weight; give [platform] mass"
        )
    many = len(given)
    begin = Pose(
        np.broadcast_to(start.position, (many, 3)), np.broadcast_to(start.rotation, (many, 3, 3))
    )
    search_all = _PoseSearch(geometry, given, platform if hanging else None)
    best, forces, taken = search_all.run(begin, steps)
    other = Candidates.none(many)
    if hanging and len(rows := np.flatnonzero(~np.isfinite(best.worst))):
        at = begin[rows]
        again, forces[rows], _ = _PoseSearch(geometry, given[rows], platform, _WEAK).run(at, steps)
        best.put(rows, again, np.ones(len(rows), dtype=bool))
    if not hanging:
        spare = count - geometry.degrees
        limit = _outlying(best.worst, spare) if search == "outlying" else search
        unmet = np.flatnonzero(np.all(np.isfinite(given), axis=1) & ~(best.worst <= limit))
        for first in range(0, len(unmet), _PIECE):
            rows = unmet[first : first + _PIECE]
            _search_further(geometry, given, begin, (best, other), rows, search=limit)
        # A model's own errors reach further than normal ones.
        most = BETTER * limit if search == "outlying" else limit
        prefer_carried(geometry, platform or PlatformSpec(), (best, other), most)
    residual = given - lengths(geometry, best.position, best.rotation)
    converged = (best.worst <= tolerance) & np.isfinite(best.worst)
    rivals = converged & are_rivals(best, other)
    forces[~converged] = np.nan
    found, second = best.pose_where(converged), other.pose_where(rivals)
    return PosesFound(found, converged, residual, second, forces, taken)


def _search_further(
    geometry: Geometry,
    given: Array,
    start: Pose,
    found: tuple[Candidates, Candidates],
    rows: NDArray[np.intp],
    *,
    search: float,
) -> None:
    """Search some poses from other starts; changes the best candidate and the second one."""
    best, other = found
    begin = start[rows]
    starts = _starts(geometry, given[rows], begin)
    left, tried, most = np.arange(len(rows)), 0, starts.position.shape[1]
    while tried < most and len(left := left[~(best.worst[rows[left]] <= search)]):
        # In rounds of 1, 1, 2, 4 … starts: one suffices for most, and more at once cost less each.
        round_ = slice(tried, min(max(1, 2 * tried), most))
        tried, count = round_.stop, round_.stop - round_.start
        at = Pose(
            starts.position[left, round_].reshape(-1, 3),
            starts.rotation[left, round_].reshape(-1, 3, 3),
        )
        pulled = np.repeat(given[rows[left]], count, axis=0)
        ends, *_ = _PoseSearch(geometry, pulled, None).run(at, _EARLY * len(_LONGEST))
        for number in range(count):
            new = ends.of(np.arange(number, len(left) * count, count))
            new.apart[:] = distance(new.pose, begin[left])
            admit(new, best, other, rows[left])


def _outlying(worst: Array, spare: int) -> float:
    """Residual that stands out among those of many poses with ``spare`` redundant lengths, m."""
    from scipy.special import chdtri

    usual = float(np.quantile(worst, _USUAL)) if len(worst) else 0.0
    if not spare or not np.isfinite(usual):
        return RESOLUTION
    times = np.sqrt(chdtri(spare, _OUTLYING) / chdtri(spare, 1 - _USUAL))
    return max(float(times) * usual, RESOLUTION)


@lru_cache(maxsize=8)
def _lattice(free: tuple[float, ...]) -> Array:
    """Rotations of the starts relative to the given one, (k, 3, 3), about the free base axes."""
    count = int(_WIDEST / _SPACING) + 1
    vectors = _SPACING * (np.indices((2 * count + 1,) * 3).reshape(3, -1).T - count)
    kept = ~np.any(vectors * (1 - np.array(free)), axis=1)
    return rotation_by(vectors[kept & (np.linalg.norm(vectors, axis=1) <= _WIDEST)])


def _starts(geometry: Geometry, given: Array, start: Pose) -> Pose:
    """Poses from which the search begins, (p, s, 3) and (p, s, 3, 3), the best first. Each rotation
    has the position that meets the lengths best, from either side of the plane nearest to the exit
    points: where they lie in it, lengths say nothing of the side."""
    moved = geometry.free[:3] > 0
    lattice = _lattice(tuple(geometry.free[3:].tolist()))
    rotation = np.tile(lattice @ start.rotation[:, None], (1, 2, 1, 1))
    arm = np.swapaxes(rotation @ geometry.anchor_point.T, 2, 3) - geometry.exit_point
    middle = geometry.exit_point.mean(axis=0)
    normal = np.zeros(3)
    normal[moved] = np.linalg.svd((geometry.exit_point - middle)[:, moved])[2][-1]
    behind = start.position - 2 * ((start.position - middle) @ normal)[:, None] * normal
    sides = np.stack([start.position, behind], axis=1)
    position = np.repeat(sides, rotation.shape[1] // 2, axis=1)
    for _ in range(_PLACING):
        cable = position[:, :, None] + arm
        length = np.maximum(np.linalg.norm(cable, axis=3), np.finfo(float).tiny)
        unit = cable / length[..., None] * moved
        turned = np.swapaxes(unit, 2, 3)
        right = turned @ (given[:, None] - length)[..., None]
        position = position + np.linalg.solve(turned @ unit + _PULLED * np.eye(3), right)[..., 0]
    length = np.linalg.norm(position[:, :, None] + arm, axis=3)
    cost = np.sum((given[:, None] - length) ** 2, axis=2)
    order = np.argsort(cost, axis=1)[:, :_STARTS]
    return Pose(
        np.take_along_axis(position, order[..., None], axis=1),
        np.take_along_axis(rotation, order[..., None, None], axis=1),
    )


class _Cables(NamedTuple):
    """Active set of each pose: taut cables, and the cable tightened last."""

    taut: NDArray[np.bool_]
    tightened: NDArray[np.intp]


@dataclass(frozen=True)
class _PoseSearch:
    geometry: Geometry
    given: Array
    platform: PlatformSpec | None
    rank: float = _RANK
    """Share of the largest singular value below which one is zero, of a hanging platform."""

    def run(self, start: Pose, steps: int) -> tuple[Candidates, Array, int]:
        """Step all poses until each has converged or has failed; with the forces and the steps."""
        many = len(self.given)
        position, rotation = start.position.copy(), start.rotation.copy()
        forces = np.full_like(self.given, np.nan)
        cables = _Cables(np.ones_like(self.given, dtype=bool), np.full(many, -1))
        converged = np.zeros(many, dtype=bool)
        going = np.flatnonzero(np.all(np.isfinite(self.given), axis=1))
        taken = 0
        while len(going) and taken < steps:
            taken += 1
            at, late = Pose(position[going], rotation[going]), taken > _EARLY
            step, forces[going] = self._step(at, self.given[going], cables.taut[going], late)
            step = _no_longer(step, _LONGEST[min(taken // _EARLY, len(_LONGEST) - 1)])
            position[going] += step[:, :3]
            rotation[going] = rotation_by(step[:, 3:]) @ rotation[going]
            size = np.linalg.norm(step, axis=1)
            still = size < _TOLERANCE
            # Lengths that cannot all be taut have no fixed point: test the set in between too.
            asked = still | (taken % _PATIENCE == 0)
            which = going[asked]
            there = Pose(position[which], rotation[which])
            still[asked] &= self._settle(there, forces[which], cables, which)
            converged[going[still]] = True
            going = going[~still & np.isfinite(size)]
        if self.platform is None:
            there = Pose(position[converged], rotation[converged])
            converged[converged] = _holds(self.geometry, there)
        position[~converged], rotation[~converged] = np.nan, np.nan
        there = Pose(position, rotation)
        residual = self.given - lengths(self.geometry, position, rotation)
        # A slack cable is longer than the distance that it spans.
        size = np.where(cables.taut, np.abs(residual), -residual)
        worst = np.where(converged, np.max(size, axis=1), np.inf)
        return Candidates(position, rotation, worst, distance(there, start)), forces, taken

    def _settle(
        self, at: Pose, forces: Array, cables: _Cables, which: NDArray[np.intp]
    ) -> NDArray[np.bool_]:
        """Whether the active set is right; else slackens or tightens one cable of each pose."""
        if self.platform is None:
            return np.ones(len(which), dtype=bool)
        taut, row = cables.taut[which], np.arange(len(which))
        excess = lengths(self.geometry, at.position, at.rotation) - self.given[which]
        push = np.where(taut, -forces / (self.platform.mass * GRAVITY), -np.inf)
        short = np.where(taut, -np.inf, excess)
        # The cable tightened last is slackened last, or the set would alternate without end.
        other = np.where(np.arange(push.shape[1]) == cables.tightened[which, None], -np.inf, push)
        push = np.where(np.max(other, axis=1, keepdims=True) > _PUSH, other, push)
        worst, missing = np.argmax(push, axis=1), np.argmax(short, axis=1)
        slacken = push[row, worst] > _PUSH
        tighten = ~slacken & (short[row, missing] > _SHORT)
        cables.taut[which[slacken], worst[slacken]] = False
        cables.taut[which[tighten], missing[tighten]] = True
        cables.tightened[which[tighten]] = missing[tighten]
        return np.asarray(~slacken & ~tighten)

    def _step(
        self, at: Pose, given: Array, taut: NDArray[np.bool_], late: bool
    ) -> tuple[Array, Array]:
        """Next step of position and rotation vector, (p, 6), and the cable forces, (p, n)."""
        length, by = linearised(self.geometry, at.position, at.rotation)
        slope, missing = by_pose(by), given - length
        good = np.all(np.isfinite(slope), axis=(1, 2)) & np.all(np.isfinite(missing), axis=1)
        step, forces = np.full((len(given), 6), np.nan), np.full_like(given, np.nan)
        there = at[good]
        if self.platform is not None:
            held = np.where(taut, missing, 0.0)[good]
            slope = np.where(taut[..., None], slope, 0.0)[good]
            step[good], found = self._hanging(self.platform, there, slope, held)
            forces[good] = np.where(taut[good], found, 0.0)
        else:
            bend = self._bend(there, missing[good]) if late else 0.0
            step[good] = _downhill(slope[good], missing[good], bend)
        return step, forces

    def _bend(self, at: Pose, missing: Array) -> Array:
        """Second-order term of Newton's method, which converges faster where lengths disagree."""
        bend = length_hessian(self.geometry, at.position, at.rotation)
        return -np.asarray(np.einsum("pn,pnij->pij", missing, bend))

    def _hanging(
        self, platform: PlatformSpec, at: Pose, slope: Array, missing: Array
    ) -> tuple[Array, Array]:
        """Step that meets the lengths, and a Newton step of the energy in their null space."""
        weight = gravity_wrench(platform, at.rotation)
        left, values, right = np.linalg.svd(slope)
        count = slope.shape[1]
        keep = values > self.rank * values[:, :1]
        inverse = np.where(keep, 1 / np.where(keep, values, 1.0), 0.0)
        # slope⁺ = V S⁺ Uᵀ; the rest of V spans the motions that keep every length.
        range_ = np.swapaxes(right[:, :count], 1, 2) * inverse[:, None]
        pseudo = range_ @ np.swapaxes(left, 1, 2)
        forces = (np.swapaxes(pseudo, 1, 2) @ weight[..., None])[..., 0]
        meet = (pseudo @ missing[..., None])[..., 0]
        bend = weight_hessian(platform, at.rotation) + np.einsum(
            "pn,pnij->pij", forces, length_hessian(self.geometry, at.position, at.rotation)
        )
        dead = np.concatenate([~keep, np.ones((len(keep), 6 - count), dtype=bool)], axis=1)
        null = np.swapaxes(right, 1, 2) * dead[:, None]
        down = weight - (bend @ meet[..., None])[..., 0]
        reduced = np.swapaxes(null, 1, 2) @ bend @ null
        stiff, axes = np.linalg.eigh(reduced)
        # Turned uphill curvature leads to a rest that is stable; no curvature, no step.
        size = np.abs(stiff)
        flat = size <= _FLAT * np.max(size, axis=1, keepdims=True)
        pull = (np.swapaxes(axes, 1, 2) @ np.swapaxes(null, 1, 2) @ down[..., None])[..., 0]
        slide = np.where(flat, 0.0, pull / np.where(flat, 1.0, size))
        return meet + (null @ axes @ slide[..., None])[..., 0], forces


def _no_longer(step: Array, longest: float) -> Array:
    """Limit steps to a length, m and rad."""
    size = np.linalg.norm(step, axis=1, keepdims=True)
    return np.asarray(step * (longest / np.maximum(size, longest)))


def _downhill(slope: Array, missing: Array, bend: Array | float) -> Array:
    """Least-squares step, (p, 6); with ``bend`` Newton's with positive curvatures."""
    turned = np.swapaxes(slope, 1, 2)
    right = turned @ missing[..., None]
    matrix, scale = _balanced(turned @ slope)
    if isinstance(bend, float):
        step = np.linalg.solve(matrix + _RIDGE * np.eye(6), right / scale[..., None])
    else:
        curved = matrix + bend / scale[:, :, None] / scale[:, None, :]
        stiff, axes = np.linalg.eigh(curved)
        pull = np.swapaxes(axes, 1, 2) @ (right / scale[..., None])
        step = axes @ (pull / np.maximum(np.abs(stiff), _RIDGE)[..., None])
    return np.asarray(step[..., 0] / scale)


def _balanced(matrix: Array) -> tuple[Array, Array]:
    """Normal matrix scaled to a unit diagonal, and the scales."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=1, axis2=2), np.finfo(float).tiny))
    return matrix / scale[:, :, None] / scale[:, None, :], scale


def _holds(geometry: Geometry, at: Pose) -> NDArray[np.bool_]:
    """Whether the cables hold all degrees of freedom, (p,)."""
    slope = by_pose(sensitivities(geometry, at.position, at.rotation))
    normal = np.swapaxes(slope, 1, 2) @ slope + np.diag(1 - geometry.free)
    stiff = np.linalg.eigvalsh(_balanced(normal)[0])
    return np.asarray(stiff[:, 0] > _LOOSE)

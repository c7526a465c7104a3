"""Forward kinematics: the platform's pose from cable lengths.

    found = forward(geometry, lengths, start, platform=PlatformSpec(mass=3.0))
    found.pose.position[found.converged]

With six cables or more that hold all six degrees of freedom the pose is the least-squares solution
of the lengths (Gauss-Newton, after twelve steps Newton). With fewer, the platform hangs where its
potential energy is least under the constraint of the lengths (sequential quadratic programming;
Lagrange's multipliers are the cable forces); a cable whose force would be negative is slack, and
its length is a bound and not an equation (active set).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.rotation import rotation_by
from winchkit.robot.geometry.hessian import length_hessian
from winchkit.robot.geometry.kinematics import Geometry, Pose, lengths, linearised
from winchkit.robot.geometry.wrench import gravity_wrench, weight_hessian
from winchkit.schema.profiles.robot import PlatformSpec
from winchkit.units import GRAVITY

_TOLERANCE = 1e-10
"""Last step, m and rad: above rounding (1e-15 on 1 m), a thousandth of the resolution of a laser
tracker (0.1 µm)."""
_RANK = 1e-7
"""Singular values of the length derivatives below this share of the largest count as zero; its
square is `_RIDGE`, so that both forms of the equations leave out the same motions."""
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


@dataclass(frozen=True)
class Found:
    """Poses for given cable lengths; NaN where the iteration did not converge."""

    pose: Pose
    converged: Array
    """(p,), true where the iteration converged to rounding."""
    residual: Array
    """Given less geometric length, (p, n), m."""
    forces: Array
    """Cable forces of a hanging platform, (p, n), N, zero in a slack cable; NaN with six or
    more cables, which may be tight to any degree."""
    steps: int


def forward(
    geometry: Geometry,
    given: Array,
    start: Pose,
    platform: PlatformSpec | None = None,
    steps: int = 100,
) -> Found:
    """Solve the forward kinematics of p poses.

    Parameters
    ----------
    geometry : Geometry
        Of n lines.
    given : (p, n) array
        Cable lengths, m.
    start : Pose
        Where the iteration starts, one pose or p.
    platform : PlatformSpec, optional
        Mass and centre of mass, needed for fewer than six cables.
    steps : int
        Most steps.

    Returns
    -------
    Found
        NaN where the iteration did not converge.

    Raises
    ------
    UsageError
        For fewer than six cables without a platform's mass.
    """
    count = len(geometry.exit_point)
    given = np.atleast_2d(np.asarray(given, dtype=float))
    if given.shape[1] != count:
        raise UsageError(f"{given.shape[1]} lengths were given for a robot of {count} lines")
    hanging = count < 6
    if hanging and (platform is None or platform.mass <= 0):
        raise UsageError(
            f"{count} lines leave the platform {6 - count} degrees of freedom, whose rest position "
            "depends on its weight; give [platform] mass"
        )
    search = _Search(geometry, given, platform if hanging else None)
    return search.run(start, steps)


class _Cables(NamedTuple):
    """Active set of each pose: taut cables, and the cable tightened last."""

    taut: NDArray[np.bool_]
    tightened: NDArray[np.intp]


@dataclass(frozen=True)
class _Search:
    geometry: Geometry
    given: Array
    platform: PlatformSpec | None

    def run(self, start: Pose, steps: int) -> Found:
        """Step all poses until each has converged or has failed."""
        many = len(self.given)
        position = np.broadcast_to(start.position, (many, 3)).copy()
        rotation = np.broadcast_to(start.rotation, (many, 3, 3)).copy()
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
        residual = self.given - lengths(self.geometry, position, rotation)
        for found in (position, rotation, forces, residual):
            found[~converged] = np.nan
        return Found(Pose(position, rotation), converged, residual, forces, taken)

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
        slope, missing = np.concatenate([by.position, by.rotation], axis=-1), given - length
        good = np.all(np.isfinite(slope), axis=(1, 2)) & np.all(np.isfinite(missing), axis=1)
        step, forces = np.full((len(given), 6), np.nan), np.full_like(given, np.nan)
        there = Pose(at.position[good], at.rotation[good])
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
        keep = values > _RANK * values[:, :1]
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
    """Whether the cables hold all six degrees of freedom, (p,)."""
    by = linearised(geometry, at.position, at.rotation)[1]
    slope = np.concatenate([by.position, by.rotation], axis=-1)
    stiff = np.linalg.eigvalsh(_balanced(np.swapaxes(slope, 1, 2) @ slope)[0])
    return np.asarray(stiff[:, 0] > _LOOSE)

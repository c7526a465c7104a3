"""Noise of each kind of measurement of a robot before effects are selected.

Variance components (:mod:`winchkit.robot.identification.variance_components`) of

* contrasts of repeated poses (pure error), where they have at least 24 degrees of freedom;
* else residuals with the pose, the geometry and the strongest directions of all candidate effects
  projected out (saturated model), so that an effect outside the catalogue counts as noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.input_denoising import contrasts
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.robot.diagnosis.equations import POSED
from winchkit.robot.identification.variance_components import START as COMMON
from winchkit.robot.identification.variance_components import re_estimated

START: Mapping[str, float] = {
    **{kind: COMMON[kind] for kind in ("closure", "position", "rotation", "swivel")},
    "gauge": COMMON["cable_length"],
    "tension": COMMON["balance"],
    "statics": COMMON["balance"],
}
"""Standard deviations at the start of the iteration, SI, by kind of residual."""
_LEAST = 1e-3
"""Lower limit of a standard deviation over its start."""
_ROUNDS = 12
"""Iterations at most; numerical."""
_SETTLED = 0.01
"""Relative change of a standard deviation at which the iteration ends."""
_LEAST_REDUNDANCY = 8.0
"""Redundancy from which a kind's standard deviation is estimated; rule of thumb."""
_REPEATS_LEAST = 24.0
"""Degrees of freedom of repeats from which on they are used (rule of thumb)."""
_ROWS_EACH = 2
"""Least degrees of freedom per projected direction (rule of thumb)."""


@dataclass(frozen=True)
class PoseNoise:
    """Standard deviations by kind, SI, and their degrees of freedom."""

    sigma: Mapping[str, float]
    dof: Mapping[str, float]
    """Degrees of freedom of lengths and of tensions, by output."""
    from_repeats: bool
    unexplained: Mapping[str, float]
    """Standard deviations of the saturated model by kind, SI."""

    @property
    def least(self) -> dict[str, float]:
        """Standard deviations that instruments surely have: without repeats those of usual ones."""
        if self.from_repeats:
            return dict(self.sigma)
        return {kind: min(own, START[kind]) for kind, own in self.sigma.items()}


@dataclass(frozen=True)
class Stack:
    """Residuals of several kinds and the columns that may explain them, SI."""

    kind: Mapping[str, Array]
    """Residuals, (p, k) each, NaN where nothing was measured."""
    by_pose: Mapping[str, Array]
    """Derivatives by the pose, (p, k, 6)."""
    columns: Mapping[str, Array]
    """Columns of geometry and candidate effects, (p, k, m)."""


def repeated_differences(stack: Stack, pose: NDArray[np.intp]) -> Stack | None:
    """Helmert contrasts of rows that repeat a pose; None without any.

    Geometry and effects are the same at all repeats of a pose and take no part.

    ``stack``: of p rows. ``pose`` (p,).
    """
    groups = [np.flatnonzero(pose == n) for n in range(int(pose.max()) + 1)]
    many = [g for g in groups if len(g) > 1]
    if not many:
        return None
    kind, by = {}, {}
    for name, values in stack.kind.items():
        kind[name] = np.concatenate([contrasts(values[g])[1] for g in many])
    for name, slope in stack.by_pose.items():
        by[name] = np.concatenate([np.repeat(slope[g[:1]], len(g) - 1, axis=0) for g in many])
    nothing = {name: np.zeros((*values.shape, 0)) for name, values in kind.items()}
    return Stack(kind, by, nothing)


def noise_of(stack: Stack, repeats: Stack | None) -> PoseNoise:
    """Noise by kind, from repeats where they have enough degrees of freedom."""
    left, free = _components(stack)
    if repeats is not None:
        sigma, dof = _components(repeats)
        if dof.get("cable_length", 0.0) >= _REPEATS_LEAST:
            return PoseNoise(sigma, dof, from_repeats=True, unexplained=left)
    return PoseNoise(left, free, from_repeats=False, unexplained=left)


def _components(stack: Stack) -> tuple[dict[str, float], dict[str, float]]:
    sigma = {kind: START[kind] for kind in stack.kind}
    dof: dict[str, float] = {}
    posed = [kind for kind in POSED if kind in stack.kind]
    for _ in range(_ROUNDS):
        before = dict(sigma)
        own = _round(stack, posed, sigma)
        dof["cable_length"] = sum(own.values())
        if "tension" in stack.kind:
            dof["tension"] = sum(_round(stack, ["tension"], sigma).values())
        if all(abs(sigma[k] - before[k]) <= _SETTLED * before[k] for k in sigma):
            break
    return sigma, dof


def _round(stack: Stack, kinds: Sequence[str], sigma: dict[str, float]) -> dict[str, float]:
    """Re-estimate each kind's ``sigma`` in place; returns their redundancies."""
    known = np.concatenate([np.isfinite(stack.kind[k]) for k in kinds], axis=1)
    residual = np.concatenate([stack.kind[k] / sigma[k] for k in kinds], axis=1)
    residual = np.where(known, residual, 0.0)
    columns = np.concatenate([stack.columns[k] / sigma[k] for k in kinds], axis=1)
    columns = np.where(known[..., None], columns, 0.0)
    used = np.zeros_like(residual)
    if kinds[0] in stack.by_pose:
        slope = np.concatenate([stack.by_pose[k] / sigma[k] for k in kinds], axis=1)
        basis = _pose_basis(np.where(known[..., None], slope, 0.0))
        residual = residual - (basis @ (np.swapaxes(basis, 1, 2) @ residual[..., None]))[..., 0]
        columns = columns - basis @ (np.swapaxes(basis, 1, 2) @ columns)
        used += np.sum(basis**2, axis=2)
    flat = columns.reshape(residual.size, columns.shape[2])
    free = float(np.count_nonzero(known) - np.sum(used))
    own = _strongest(flat, int(free) // _ROWS_EACH)
    residual = residual - (own @ (own.T @ residual.reshape(-1))).reshape(residual.shape)
    used += np.sum(own**2, axis=1).reshape(used.shape)
    out, at = {}, 0
    for kind in kinds:
        part = slice(at, at + stack.kind[kind].shape[1])
        at = part.stop
        here = known[:, part]
        found = re_estimated(
            sigma[kind],
            residual[:, part][here],
            used[:, part][here],
            least_redundancy=_LEAST_REDUNDANCY,
            least=_LEAST * START[kind],
        )
        sigma[kind], out[kind] = found.sigma, max(found.redundancy, 0.0)
    return out


def _pose_basis(slope: Array) -> Array:
    """Orthonormal basis of each pose's columns (p, r, 6), zero beyond its rank; (p, r, 6)."""
    left, size, _ = np.linalg.svd(slope, full_matrices=False)
    return np.asarray(left * (size > 1e-9 * np.maximum(size[:, :1], 1e-300))[:, None, :])


def _strongest(columns: Array, most: int) -> Array:
    """Orthonormal basis of the ``most`` strongest directions of columns scaled to length one."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    # Columns of rounding errors would be scaled to length one too.
    there = size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)
    return orthonormal(columns[:, there], most)

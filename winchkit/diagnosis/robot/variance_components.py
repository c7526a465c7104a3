"""How noisy each kind of measurement of a robot is: variance components (Helmert, Förstner).

From differences of repeated poses where there are enough of them; else from what no effect of the
catalogue and no geometry can explain, so that an effect outside the catalogue counts as noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.robot.equations import POSED

__all__ = ["START", "PoseNoise", "Stack", "contrasts", "noise_of", "repeated_differences"]

START: Mapping[str, float] = {
    "rope": 5e-5,
    "position": 5e-5,
    "rotation": 2e-3,
    "swivel": 2e-3,
    "gauge": 1e-4,
    "tension": 1.0,
}
"""Standard deviations before anything is known, SI."""
_LEAST = 1e-3
_ROUNDS = 12
_SETTLED = 0.01
_FREE_LEAST = 8.0
_SHARE_LEAST = 0.02
_REPEATS_LEAST = 24.0
_ROWS_EACH = 2


@dataclass(frozen=True)
class PoseNoise:
    """Standard deviations by kind, SI, and how well they are known."""

    sigma: Mapping[str, float]
    dof: Mapping[str, float]
    """Degrees of freedom of lengths and of tensions, by output."""
    from_repeats: bool
    unexplained: Mapping[str, float]
    """By kind what neither geometry nor any known effect explains."""


@dataclass(frozen=True)
class Stack:
    """Residuals of several kinds with what they depend on, NaN-free; SI."""

    kind: Mapping[str, Array]
    """(p, k) each, NaN where unknown."""
    by_pose: Mapping[str, Array]
    """(p, k, 6)."""
    columns: Mapping[str, Array]
    """What may explain them, (p, k, m)."""


def repeated_differences(stack: Stack, pose: NDArray[np.intp]) -> Stack | None:
    """Contrasts of rows that take one pose; what explains a pose explains no difference."""
    groups = [np.flatnonzero(pose == n) for n in range(int(pose.max()) + 1)]
    many = [g for g in groups if len(g) > 1]
    if not many:
        return None
    kind, by = {}, {}
    for name, values in stack.kind.items():
        kind[name] = np.concatenate([contrasts(values[g]) for g in many])
    for name, slope in stack.by_pose.items():
        by[name] = np.concatenate([np.repeat(slope[g[:1]], len(g) - 1, axis=0) for g in many])
    nothing = {name: np.zeros((*values.shape, 0)) for name, values in kind.items()}
    return Stack(kind, by, nothing)


def noise_of(stack: Stack, repeats: Stack | None) -> PoseNoise:
    """Noise by kind, from repeats where they say enough."""
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
    """One step towards each kind's own scatter; returns what the fit leaves free of each."""
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
        count = np.count_nonzero(known[:, part])
        left = float(np.sum((1 - used[:, part])[known[:, part]]))
        out[kind] = max(left, 0.0)
        if left >= max(_FREE_LEAST, _SHARE_LEAST * count):
            square = float(np.sum(residual[:, part] ** 2)) / left
            sigma[kind] = max(sigma[kind] * float(np.sqrt(square)), _LEAST * START[kind])
    return out


def _pose_basis(slope: Array) -> Array:
    """Orthonormal directions of (p, r, 6) that a pose can take up, zero where fewer; (p, r, 6)."""
    left, size, _ = np.linalg.svd(slope, full_matrices=False)
    return np.asarray(left * (size > 1e-9 * np.maximum(size[:, :1], 1e-300))[:, None, :])


def _strongest(columns: Array, most: int) -> Array:
    """Orthonormal basis of at most ``most`` directions of columns, each counted alike."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    there = size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)
    scaled = columns[:, there] / size[there]
    if not scaled.shape[1]:
        return np.zeros((len(columns), 0))
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > 1e-8 * values[-1]
    kept[: max(0, len(values) - most)] = False
    return np.asarray(scaled @ (vectors[:, kept] / np.sqrt(values[kept])))


def contrasts(values: Array) -> Array:
    """Orthonormal differences among k rows, (k − 1, …), each as noisy as one row (Helmert)."""
    return np.stack(
        [
            (values[:j].sum(axis=0) - j * values[j]) / np.sqrt(j * (j + 1))
            for j in range(1, len(values))
        ]
    )

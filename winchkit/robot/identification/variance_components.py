"""Variance components: the standard deviation of each kind of measurement from residuals.

Helmert's estimate in Förstner's iterative form. With whitened residuals v of a kind and their
redundancy numbers 1 − h (h: leverage, the share of an equation that the fit uses up)

    σ² ← σ² Σ v² / Σ (1 − h)

repeated with new weights until it settles: the sum of squares of a kind then equals the number of
its equations that the fit leaves free. A kind with hardly any redundancy keeps its value.

A calibration has the residuals of its fit, with the leverages of poses and parameters together. A
diagnosis, which does not know yet what is missing from its model, has

* contrasts of repeated poses (pure error), where they have at least 24 degrees of freedom;
* else residuals with the pose, the geometry and the strongest directions of all candidate effects
  projected out (saturated model), so that an effect outside the catalogue counts as noise.

References
----------
F. R. Helmert, *Die Ausgleichungsrechnung nach der Methode der kleinsten Quadrate*, 1907.
W. Förstner, *Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten*, AVN 86, 1979.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.input_denoising import contrasts
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.robot.identification.bundle_adjustment import (
    Rows,
    Solution,
    Weights,
    leverage,
    stacked,
)


@dataclass(frozen=True)
class KindNoise:
    """Start and lower limit of a kind's standard deviation."""

    unit: str
    start: float
    least: float = 1e-7


NOISE = {
    "closure": KindNoise("m", 5e-5),
    "position": KindNoise("m", 5e-5),
    "rotation": KindNoise("rad", 2e-3),
    "swivel": KindNoise("rad", 2e-3),
    "cable_length": KindNoise("m", 1e-4),
    "balance": KindNoise("N", 1.0, 1e-4),
    "tension": KindNoise("N", 1.0, 1e-4),
}
"""By kind of equation; starts are rules of thumb: a laser tracker, a drum's encoder, angles by a
tracker, a load cell. ``tension`` is the part of the balance that cable forces can carry."""
START: Mapping[str, float] = {kind: own.start for kind, own in NOISE.items()}
"""Standard deviations at the start of the iteration, SI, by kind of equation."""

_LEAST_SHARE = 0.02
"""Least redundancy of a kind as a share of its equations: below it rounding decides."""
_OF_A_FIT = 12.0
"""Degrees of freedom: a standard deviation from twelve is known to 20 % (1/√(2·12)); with fewer the
declared one is better."""
_OF_A_SATURATED_FIT = 8.0
"""The same of a saturated fit, which has fewer (rule of thumb)."""
_LEAST = 1e-3
"""Lower limit of a standard deviation of a diagnosis over its start."""
_ROUNDS = 12
"""Iterations at most; numerical."""
_SETTLED = 0.01
"""Relative change of a standard deviation at which the iteration ends."""
_REPEATS_LEAST = 24.0
"""Degrees of freedom of repeats from which on they are used (rule of thumb)."""
_ROWS_EACH = 2
"""Least degrees of freedom per projected direction (rule of thumb)."""


@dataclass(frozen=True)
class Component:
    """Estimate of one kind's standard deviation."""

    sigma: float
    """SI."""
    redundancy: float
    """Σ (1 − h), degrees of freedom."""


def re_estimated(
    sigma: float, residual: Array, leverage: Array, *, least_redundancy: float, least: float
) -> Component:
    """One step of the iteration for one kind of measurement, of whitened residuals; ``sigma`` is
    kept below ``least_redundancy`` degrees of freedom, and below 2 % of their number."""
    free = float(np.sum(1 - leverage))
    if free < max(least_redundancy, _LEAST_SHARE * len(residual)):
        return Component(sigma, free)
    variance = float(np.sum(residual**2)) / free
    return Component(max(sigma * float(np.sqrt(variance)), least), free)


def re_estimated_weights(
    solution: Solution, weights: Weights, given: Mapping[str, float]
) -> Weights:
    """Weights with the standard deviation of every kind that was not given, re-estimated."""
    stack, used = solution.linear.stack, leverage(solution.linear)
    sigma = dict(weights.sigma)
    for kind, part in stack.kinds.items():
        if kind not in given:
            known = stack.known[:, part]
            sigma[kind] = re_estimated(
                sigma[kind],
                stack.residual[:, part][known],
                used[:, part][known],
                least_redundancy=_OF_A_FIT,
                least=NOISE[kind].least,
            ).sigma
    return Weights(sigma)


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


def noise_of(rows: Sequence[Rows], pose: NDArray[np.intp]) -> PoseNoise:
    """Noise by kind, from repeats where they have enough degrees of freedom."""
    left, free = _components(rows)
    if repeats := repeated_differences(rows, pose):
        sigma, dof = _components(repeats)
        if dof.get("cable_length", 0.0) >= _REPEATS_LEAST:
            return PoseNoise(sigma, dof, from_repeats=True, unexplained=left)
    return PoseNoise(left, free, from_repeats=False, unexplained=left)


def repeated_differences(rows: Sequence[Rows], pose: NDArray[np.intp]) -> list[Rows]:
    """Helmert contrasts of rows that repeat a pose, in which geometry and effects take no part;
    empty without any."""
    groups = [np.flatnonzero(pose == n) for n in range(int(pose.max()) + 1)]
    many = [g for g in groups if len(g) > 1]
    if not many:
        return []
    first = np.concatenate([np.repeat(g[:1], len(g) - 1) for g in many])
    return [
        Rows(
            own.kind,
            np.concatenate([contrasts(own.residual[g])[1] for g in many]),
            own.by_pose[first],
            np.zeros((len(first), own.residual.shape[1], 0)),
        )
        for own in rows
    ]


def _components(rows: Sequence[Rows]) -> tuple[dict[str, float], dict[str, float]]:
    """Standard deviations by kind, and degrees of freedom by output."""
    sigma = {own.kind: START[own.kind] for own in rows}
    tension = [own for own in rows if own.kind == "tension"]
    outputs = {"cable_length": [own for own in rows if own.kind != "tension"], "tension": tension}
    dof: dict[str, float] = {}
    for _ in range(_ROUNDS):
        before = dict(sigma)
        for output, own in outputs.items():
            if own:
                found = _round(own, sigma)
                sigma |= {kind: component.sigma for kind, component in found.items()}
                dof[output] = sum(max(one.redundancy, 0.0) for one in found.values())
        if all(abs(sigma[k] - before[k]) <= _SETTLED * before[k] for k in sigma):
            break
    return sigma, dof


def _round(rows: Sequence[Rows], sigma: Mapping[str, float]) -> dict[str, Component]:
    """Re-estimate each kind beside its pose and the strongest directions of the columns."""
    columns = rows[0].by_values
    assert columns is not None
    stack = stacked(rows, Weights(sigma), np.ones(columns.shape[2]))
    basis = _pose_basis(stack.by_pose)
    turned = np.swapaxes(basis, 1, 2)
    residual = stack.residual - (basis @ (turned @ stack.residual[..., None]))[..., 0]
    columns = stack.by_values - basis @ (turned @ stack.by_values)
    used = np.sum(basis**2, axis=2)
    free = float(np.count_nonzero(stack.known) - np.sum(used))
    own = _strongest(columns.reshape(residual.size, -1), int(free) // _ROWS_EACH)
    residual = residual - (own @ (own.T @ residual.reshape(-1))).reshape(residual.shape)
    used = used + np.sum(own**2, axis=1).reshape(used.shape)
    return {
        kind: re_estimated(
            sigma[kind],
            residual[:, part][stack.known[:, part]],
            used[:, part][stack.known[:, part]],
            least_redundancy=_OF_A_SATURATED_FIT,
            least=_LEAST * START[kind],
        )
        for kind, part in stack.kinds.items()
    }


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

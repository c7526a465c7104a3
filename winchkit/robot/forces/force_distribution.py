"""Distribution of cable forces within limits: three methods, and wrench feasibility.

At rest Aᵀ f + w = 0 with the structure matrix Aᵀ (6, n) and the wrench w (6,) on the platform.
Each method approximates the solution closest to the middle of the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError

_RANK = 1e-9
"""Singular values below this share of the largest count as zero: far above rounding (1e-16), far
below those of a robot that can be controlled (rule of thumb)."""
_BALANCE = 1e-9
"""Residual wrench as a share of the wrench and the forces: a million times their rounding, and less
than 1 µN on 1 kN."""
_WITHIN = 1e-9
"""Share of the range between the limits by which a force may pass one by rounding: less than 1 µN
on 1 kN."""


@dataclass(frozen=True)
class ForceLimits:
    """Least and greatest cable force, N: one for all lines or one each, (n,)."""

    low: float | Array
    """N; below it a cable counts as slack."""
    high: float | Array
    """N."""

    def spread(self, count: int) -> tuple[Array, Array]:
        """Both limits per line; raises UsageError where low is not below high.

        Parameters
        ----------
        count : int
            Number of lines.

        Returns
        -------
        tuple of two (count,) arrays
            Lower and upper limits, N.
        """
        low = np.broadcast_to(np.asarray(self.low, dtype=float), (count,))
        high = np.broadcast_to(np.asarray(self.high, dtype=float), (count,))
        if not np.all(low < high):
            raise UsageError(f"force limits: low {self.low} N is not below high {self.high} N")
        return low, high

    def between(self, count: int) -> tuple[Array, Array]:
        """Both limits per line; raises UsageError where one is infinite.

        Parameters
        ----------
        count : int
            Number of lines.

        Returns
        -------
        tuple of two (count,) arrays
            Lower and upper limits, N.
        """
        low, high = self.spread(count)
        if not np.all(np.isfinite(low) & np.isfinite(high)):
            raise UsageError("force limits must be finite: the forces aim at their middle")
        return low, high


@dataclass(frozen=True)
class Forces:
    """Cable forces of one pose."""

    value: Array
    """(n,), N; also where they are not feasible; NaN without a solution."""
    feasible: bool
    """Whether they balance the wrench within the limits."""
    residual: float
    """Norm of Aᵀ f + w, N and N m."""


@dataclass(frozen=True)
class Feasibility:
    """Whether some cable forces within the limits balance a wrench."""

    feasible: bool
    margin: float
    """Largest distance that all forces can have from their limits at once, N; negative where the
    limits would have to be wider by that much; NaN where no forces balance the wrench."""


def approximate_forces(structure: Array, wrench: Array, initial: Array) -> Array:
    """Forces that balance a wrench and are nearest to given ones.

    Parameters
    ----------
    structure : (p, 6, n) array
        Structure matrices Aᵀ.
    wrench : (6,) or (p, 6) array
        w, N and N m.
    initial : (n,) or (p, n) array
        Forces f_i, N, for example at another pose.

    Returns
    -------
    (p, n) array
        f = f_i − A⁺ᵀ (w + Aᵀ f_i), N.

    Notes
    -----
    IPAnema paper, Eq. 8, with the sign corrected so that its Eq. 7 holds.
    """
    missing = wrench + (structure @ np.asarray(initial)[..., None])[..., 0]
    change = np.linalg.pinv(structure, rcond=_RANK) @ missing[..., None]
    return np.asarray(initial - change[..., 0])


def closed_form(structure: Array, wrench: Array, limits: ForceLimits) -> Forces:
    """Closed-form distribution, which may lie outside the limits.

    Parameters
    ----------
    structure : (6, n) array
        Aᵀ.
    wrench : (6,) array
        w, N and N m.
    limits : ForceLimits
        Both finite.

    Returns
    -------
    Forces
        f = f_m − A⁺ᵀ (w + Aᵀ f_m) with the middle f_m of the limits.

    References
    ----------
    A. Pott, T. Bruckmann, L. Mikelsons, *Closed-form force distribution for parallel wire robots*,
    2009.
    """
    low, high = limits.between(structure.shape[1])
    return _judge(_nearest(structure, wrench, (low + high) / 2), structure, wrench, low, high)


def improved_closed_form(structure: Array, wrench: Array, limits: ForceLimits) -> Forces:
    """Closed form in turns: the force farthest outside its limits is fixed at the limit.

    Parameters as of :func:`closed_form`. Finds more than that, and less than :func:`quadratic`.

    References
    ----------
    A. Pott, *An improved force distribution algorithm for over-constrained cable-driven parallel
    robots*, 2014.
    """
    low, high = limits.between(structure.shape[1])
    value = np.array((low + high) / 2)
    free, held = np.ones(len(value), dtype=bool), np.linalg.matrix_rank(structure)
    while True:
        known = wrench + structure[:, ~free] @ value[~free]
        value[free] = _nearest(structure[:, free], known, ((low + high) / 2)[free])
        beyond = np.where(free, np.maximum(low - value, value - high), -np.inf)
        worst = int(np.argmax(beyond))
        if beyond[worst] <= _WITHIN * (high[worst] - low[worst]) or np.sum(free) <= held:
            return _judge(value, structure, wrench, low, high)
        value[worst] = low[worst] if value[worst] < low[worst] else high[worst]
        free[worst] = False


def quadratic(structure: Array, wrench: Array, limits: ForceLimits) -> Forces:
    """Solution within the limits closest to their middle: min ‖f − f_m‖², if there is any.

    Parameters as of :func:`closed_form`.

    Notes
    -----
    With an orthonormal null space N of Aᵀ, f = f_c + N λ from the closed form f_c, and the problem
    is one of least distance, min ‖λ‖ within the limits, which non-negative least squares solves
    exactly.

    References
    ----------
    C. Lawson, R. Hanson, *Solving Least Squares Problems*, ch. 23.
    """
    low, high = limits.between(structure.shape[1])
    centre = _nearest(structure, wrench, (low + high) / 2)
    null = null_space(structure)
    step = _least_distance(
        np.concatenate([null, -null]), np.concatenate([low - centre, centre - high])
    )
    value = np.full(len(low), np.nan) if step is None else centre + null @ step
    return _judge(value, structure, wrench, low, high)


def preloaded(structure: Array, wrench: Array, limits: ForceLimits, preload: Array) -> Forces:
    """Solution f₀ + N (N_k)⁺ (p − f₀)_k with wanted forces p in the cables k, NaN in the others,
    changed least from :func:`quadratic`. Wanted forces that contradict each other are met with the
    least sum of squares; NaN where none within the limits balance the wrench."""
    low, high = limits.between(structure.shape[1])
    start, null, given = (
        quadratic(structure, wrench, limits),
        null_space(structure),
        ~np.isnan(preload),
    )
    share = np.linalg.pinv(null[given], rcond=_RANK) @ (preload - start.value)[given]
    return _judge(start.value + null @ share, structure, wrench, low, high)


def distributed_forces(structure: Array, wrench: Array, limits: ForceLimits) -> Array:
    """Cable forces within the limits that are closest to their middle, for many poses.

    Parameters
    ----------
    structure : (k, 6, n) array
        Structure matrices Aᵀ.
    wrench : (k, 6) array
        w, N and N m.
    limits : ForceLimits
        Both finite.

    Returns
    -------
    (k, n) array
        N; NaN in the rows where no forces within the limits balance the wrench.

    Notes
    -----
    The closed form is the solution wherever it is within the limits, and is computed for all rows
    at once; :func:`quadratic` computes the other rows.
    """
    low, high = limits.between(structure.shape[2])
    out = np.full(structure.shape[::2], np.nan)
    known = np.isfinite(structure).all(axis=(1, 2)) & np.isfinite(wrench).all(axis=1)
    closed = approximate_forces(structure[known], wrench[known], (low + high) / 2)
    missing = (structure[known] @ closed[..., None])[..., 0] + wrench[known]
    size = np.linalg.norm(closed, axis=1) + np.linalg.norm(wrench[known], axis=1)
    solved = ((low <= closed) & (closed <= high)).all(axis=1)
    solved &= np.linalg.norm(missing, axis=1) <= _BALANCE * np.maximum(size, 1.0)
    out[known] = np.where(solved[:, None], closed, np.nan)
    for k in np.flatnonzero(known)[~solved].tolist():
        found = quadratic(structure[k], wrench[k], limits)
        if found.feasible:
            out[k] = found.value
    return out


def wrench_feasibility(structure: Array, wrench: Array, limits: ForceLimits) -> Feasibility:
    """Whether forces within the limits balance a wrench, and the largest margin to the limits.

    Parameters as of :func:`closed_form`; a limit may be infinite.

    Notes
    -----
    A linear programme: the margin is maximised, at most 1000 times the largest force in it.
    """
    from scipy.optimize import linprog

    count = structure.shape[1]
    low, high = limits.spread(count)
    scale = _scale(structure, wrench, low, high)
    above, below = np.isfinite(low), np.isfinite(high)
    eye, ones = np.eye(count), np.ones((count, 1))
    found = linprog(
        np.append(np.zeros(count), -1.0),
        A_ub=np.concatenate(
            [np.hstack([-eye, ones])[above], np.hstack([eye, ones])[below]], axis=0
        ),
        b_ub=np.concatenate([-low[above], high[below]]) / scale,
        A_eq=np.hstack([structure, np.zeros((6, 1))]),
        b_eq=-wrench / scale,
        bounds=[(None, None)] * count + [(None, 1e3)],
        method="highs",
    )
    best = found.x
    margin = float("nan") if best is None else float(best[-1]) * scale
    return Feasibility(bool(margin >= -_WITHIN * scale), margin)


def steepest_force(force: Array, distance: Array) -> float:
    """Largest change of a cable force per length of a path, N/m.

    Parameters
    ----------
    force : (k, n) array
        Cable forces along the path, N; NaN where there are none.
    distance : (k,) array
        Along the path, increasing, m.

    Returns
    -------
    float
        NaN without two neighbouring samples. A distribution that jumps shows a value that grows in
        proportion as the samples become denser; that of a continuous one has a limit.
    """
    slope = np.abs(np.diff(force, axis=0)) / np.diff(distance)[:, None]
    known = slope[np.isfinite(slope)]
    return float(known.max()) if len(known) else float("nan")


def null_space(structure: Array) -> Array:
    """Orthonormal basis of the cable forces that balance each other, (n, n − rank)."""
    _, values, right = np.linalg.svd(structure)
    rank = int(np.sum(values > _RANK * values[0]))
    return np.asarray(right[rank:].T)


def _nearest(structure: Array, wrench: Array, middle: Array) -> Array:
    """Least-squares solution closest to ``middle``."""
    missing = wrench + structure @ middle
    return np.asarray(middle - np.linalg.pinv(structure, rcond=_RANK) @ missing)


def _least_distance(slope: Array, least: Array) -> Array | None:
    """Shortest x with ``slope`` x ≥ ``least``, or None where there is none."""
    from scipy.optimize import nnls

    if np.all(least <= 0):
        return np.zeros(slope.shape[1])
    scale = float(np.max(np.abs(least)))
    matrix = np.vstack([slope.T, least / scale])
    target = np.zeros(len(matrix))
    target[-1] = 1.0
    dual, _ = nnls(matrix, target, maxiter=50 * matrix.shape[1])
    rest = matrix @ dual - target
    if np.linalg.norm(rest) < _WITHIN:
        return None
    return np.asarray(-rest[:-1] / rest[-1] * scale)


def _scale(structure: Array, wrench: Array, low: Array, high: Array) -> float:
    """Largest force of the problem, N, by which it is scaled."""
    limits = np.abs(np.concatenate([low, high]))
    sizes = np.append(limits[np.isfinite(limits)], np.linalg.norm(wrench[:3]))
    return float(np.max(sizes, initial=0.0)) or 1.0


def _judge(value: Array, structure: Array, wrench: Array, low: Array, high: Array) -> Forces:
    residual = float(np.linalg.norm(structure @ value + wrench))
    slack = _WITHIN * (high - low)
    within = bool(np.all((value >= low - slack) & (value <= high + slack)))
    size = float(np.linalg.norm(wrench) + np.linalg.norm(value)) if within else np.inf
    return Forces(value, within and residual <= _BALANCE * max(size, 1.0), residual)

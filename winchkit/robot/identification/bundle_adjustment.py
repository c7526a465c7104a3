"""Levenberg-Marquardt fit of all poses and parameters, with priors and bounds.

With whitened residuals r, their derivatives A by pose (p blocks of 6 columns) and B by parameters
in standard deviations of their priors, whose distance from their nominal values is x,

    [AᵀA  AᵀB    ] [pose step ]      [Aᵀ r    ]
    [BᵀA  BᵀB + 1] [parameters] = −  [Bᵀ r + x]

Every equation belongs to one pose, so that AᵀA is block diagonal (6 by 6) and the equations are
reduced to the parameters by the Schur complement BᵀB − BᵀA (AᵀA)⁻¹ AᵀB.

References
----------
B. Triggs et al., *Bundle Adjustment – A Modern Synthesis*, 2000. P. J. Huber, *Robust Statistics*,
1981 (weights of the loss as iteratively reweighted least squares).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.robot.geometry.constraints import Constraint
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.pose_estimation import Iteration, estimated_pose, moved_pose

Mask = NDArray[np.bool_]
Progress = Callable[[int, float], None]
"""Called with a step's number and the cost after it."""

HUBER = 1.345
"""Scale of Huber's loss in standard deviations, of 95 % efficiency for normal residuals."""
_STEPS = 60
"""Rule of thumb: about ten from a start within the priors, and each rejected step counts too."""
_DONE = 1e-3
"""Fall of the cost: half of the square of an estimate's change in standard deviations, so that 1e-3
is a change of 0.045."""
_POSE_DAMPING, _ROUNDING = 1.0, 1e-13
"""1/m² and 1/rad², and a share of the trace, above rounding: a direction of the pose that no
reading determines stays where it is."""
_MOST_DAMPED = 1e8
"""In prior informations: the step is then shorter than 1e-8 of the gradient, and rounding alone
keeps the cost from falling."""
_PLACING = Iteration(damping=_POSE_DAMPING, relative_damping=_ROUNDING, tolerance=1e-7, steps=30)


class Unknowns(Protocol):
    """Parameters that are estimated, each with a Gaussian prior and bounds; (q,) each."""

    @property
    def nominal(self) -> Array:
        """Means of the priors."""

    @property
    def std(self) -> Array:
        """Standard deviations of the priors; zero for a parameter that is held."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds."""


@dataclass(frozen=True)
class BundleState:
    """Point at which the equations are evaluated: parameters (q,), and p poses."""

    values: Array
    pose: Pose


@dataclass(frozen=True)
class Rows:
    """Equations of one kind at p poses, NaN in the residual where nothing was measured."""

    kind: str
    residual: Array
    """Model less measurement, (p, k)."""
    by_pose: Array
    """Derivative by position and rotation vector, (p, k, 6)."""
    by_values: Array | None
    """Derivative by the parameters, (p, k, q); None where it is zero."""


class BundleEquations(Protocol):
    """Observation equations of poses as functions of parameters and poses."""

    @property
    def parameters(self) -> Unknowns:
        """The parameters."""

    def constraints(self, state: BundleState) -> Iterable[tuple[str, Constraint]]:
        """Equations by kind with derivatives by the pose at least."""

    def rows(self, state: BundleState) -> Iterable[Rows]:
        """Equations by kind with derivatives by the vector of parameters."""


@dataclass(frozen=True)
class Weights:
    """Standard deviation of each kind of equation, and whether the loss is Huber's."""

    sigma: Mapping[str, float]
    robust: bool = False


@dataclass(frozen=True)
class Stack:
    """Equations of all kinds beside each other, whitened, and weighted by the loss."""

    kinds: dict[str, slice]
    known: Mask
    """(p, r), where there is a measurement."""
    residual: Array
    """(p, r)."""
    by_pose: Array
    """(p, r, 6)."""
    by_values: Array
    """By the scaled parameters, (p, r, q)."""


@dataclass(frozen=True)
class ReducedEquations:
    """Equations linearised at a state and reduced to the parameters."""

    stack: Stack
    cost: float
    prior: Array
    """Parameters less nominal values in standard deviations of the prior, (q,)."""
    factor: Array
    """Inverse Cholesky factors of the poses' normal matrices, (p, 6, 6)."""
    information: Array
    """Information matrix of the scaled parameters, without the prior, (q, q)."""
    gradient: Array
    """Gradient of the cost by the scaled parameters, poses eliminated, with the prior, (q,)."""
    poses_held: tuple[Array, Array]
    """Information and gradient without the prior where the poses are held, which no damping
    changes, (q, q) and (q,)."""

    def damped(self, damping: float) -> ReducedEquations:
        """The same equations with the poses damped as the parameters are: a pose with few
        measurements has the longest step of its own."""
        if damping == 0.0:
            return self
        return _reduced(self.cost, self.prior, self.stack, self.poses_held, damping)

    @property
    def pose_free(self) -> Array:
        """Derivatives by the parameters with the pose projected out, (p, r, q)."""
        half = self.factor @ np.swapaxes(self.stack.by_pose, 1, 2)
        return np.asarray(
            self.stack.by_values - np.swapaxes(half, 1, 2) @ (half @ self.stack.by_values)
        )


@dataclass(frozen=True)
class Solution:
    """End of a fit."""

    state: BundleState
    linear: ReducedEquations
    held: NDArray[np.int_]
    """(q,): −1 at the lower bound, 1 at the upper one, 0 between."""
    steps: int
    converged: bool


def place(equations: BundleEquations, state: BundleState, weights: Weights) -> BundleState:
    """Estimate the poses alone, with least squares and the parameters of the state."""

    def whitened(pose: Pose) -> tuple[Array, Array]:
        found = list(equations.constraints(BundleState(state.values, pose)))
        residual = np.concatenate([c.residual / weights.sigma[kind] for kind, c in found], axis=1)
        by_pose = np.concatenate([c.by_pose / weights.sigma[kind] for kind, c in found], axis=1)
        known = np.isfinite(residual) & np.all(np.isfinite(by_pose), axis=2)
        residual[~known], by_pose[~known] = 0.0, 0.0
        return residual, by_pose

    return BundleState(state.values, estimated_pose(whitened, state.pose, _PLACING))


def solve(
    equations: BundleEquations,
    state: BundleState,
    weights: Weights,
    progress: Progress | None = None,
) -> Solution:
    """Fit poses and parameters by Levenberg and Marquardt's method with bounds. A step to where an
    equation has no finite value, so that its measurement would no longer count, is rejected.

    A fall of the cost of ½ is one standard deviation of an estimate. ``converged`` is false after
    60 steps or where no step reduces the cost.
    """
    scale = equations.parameters.std
    linear = linearise(equations, state, weights)
    damping, held = 0.0, np.zeros(len(scale), dtype=int)
    for count in range(1, _STEPS + 1):
        slow = linear.damped(damping)
        values, held = _bounded_step(equations, state, slow, damping)
        change = np.divide(values - state.values, scale, out=np.zeros_like(scale), where=scale > 0)
        trial = moved(state, values, _pose_steps(slow, change))
        found = linearise(equations, trial, weights)
        gain = linear.cost - found.cost
        if not gain >= -_DONE or np.any(linear.stack.known & ~found.stack.known):
            if damping > _MOST_DAMPED:
                return Solution(state, linear, held, count, converged=False)
            damping = max(10 * damping, 1e-3)
            continue
        state, linear, damping = trial, found, damping / 10 if damping > 1e-6 else 0.0
        if progress is not None:
            progress(count, linear.cost)
        if gain < _DONE * (1 + 1e-6 * linear.cost):
            return Solution(state, linear, held, count, converged=True)
    return Solution(state, linear, held, _STEPS, converged=False)


def moved(state: BundleState, values: Array, step: Array) -> BundleState:
    """State with other parameters and with poses moved by (p, 6)."""
    return BundleState(values, moved_pose(state.pose, step))


def linearise(equations: BundleEquations, state: BundleState, weights: Weights) -> ReducedEquations:
    """Whiten the equations at a state and reduce them to the parameters; residual and derivatives
    are zero without a measurement or a finite value."""
    scale = equations.parameters.std
    stack = stacked(equations.rows(state), weights, scale)
    prior = np.divide(
        state.values - equations.parameters.nominal,
        scale,
        out=np.zeros_like(scale),
        where=scale > 0,
    )
    loss = stack.residual**2
    if weights.robust:
        size = np.abs(stack.residual)
        loss = np.where(size > HUBER, 2 * HUBER * size - HUBER**2, loss)
        root = np.sqrt(HUBER / np.maximum(size, HUBER))
        stack = replace(
            stack,
            residual=stack.residual * root,
            by_pose=stack.by_pose * root[..., None],
            by_values=stack.by_values * root[..., None],
        )
    cost = 0.5 * (float(np.sum(loss)) + float(prior @ prior))
    flat = stack.by_values.reshape(-1, stack.by_values.shape[2])
    return _reduced(cost, prior, stack, (flat.T @ flat, flat.T @ stack.residual.reshape(-1)))


def stacked(equations: Iterable[Rows], weights: Weights, scale: Array) -> Stack:
    """Equations of all kinds beside each other, whitened, by parameters in units of ``scale``."""
    kinds, parts, at = {}, [], 0
    for rows in equations:
        kinds[rows.kind] = slice(at, at + rows.residual.shape[1])
        at += rows.residual.shape[1]
        parts.append((rows, 1 / weights.sigma[rows.kind]))
    residual = np.concatenate([rows.residual * w for rows, w in parts], axis=1)
    by_pose = np.concatenate([rows.by_pose * w for rows, w in parts], axis=1)
    by_values = np.zeros((*residual.shape, len(scale)))
    for rows, w in parts:
        if rows.by_values is not None:
            np.multiply(rows.by_values, w * scale, out=by_values[:, kinds[rows.kind]])
    known = np.isfinite(residual) & np.all(np.isfinite(by_pose), axis=2)
    known &= np.all(np.isfinite(by_values), axis=2)
    if not np.all(known):
        residual[~known], by_pose[~known], by_values[~known] = 0.0, 0.0, 0.0
    return Stack(kinds, known, residual, by_pose, by_values)


def _reduced(
    cost: float,
    prior: Array,
    stack: Stack,
    poses_held: tuple[Array, Array],
    damping: float = 0.0,
) -> ReducedEquations:
    many, _, count = stack.by_values.shape
    turned = np.swapaxes(stack.by_pose, 1, 2)
    normal = turned @ stack.by_pose
    # Unmeasured directions of a pose do not change.
    firm = _POSE_DAMPING + _ROUNDING * np.trace(normal, axis1=1, axis2=2)
    normal[:, range(6), range(6)] *= 1 + damping
    normal[:, range(6), range(6)] += firm[:, None]
    factor = np.linalg.inv(np.linalg.cholesky(normal))
    half = factor @ turned
    coupled = (half @ stack.by_values).reshape(6 * many, count)
    information = poses_held[0] - coupled.T @ coupled
    seen = (half @ stack.residual[..., None]).reshape(6 * many)
    gradient = poses_held[1] - coupled.T @ seen + prior
    return ReducedEquations(stack, cost, prior, factor, information, gradient, poses_held)


def _pose_steps(linear: ReducedEquations, change: Array) -> Array:
    """Steps of the poses that belong to a change of the scaled parameters, (p, 6)."""
    left = linear.stack.residual + linear.stack.by_values @ change
    gradient = np.swapaxes(linear.stack.by_pose, 1, 2) @ left[..., None]
    turned = np.swapaxes(linear.factor, 1, 2)
    return np.asarray(-(turned @ (linear.factor @ gradient))[..., 0])


def _bounded_step(
    equations: BundleEquations, state: BundleState, linear: ReducedEquations, damping: float
) -> tuple[Array, NDArray[np.int_]]:
    """Parameters after a damped step, and the bounds that are active: those beyond a bound are put
    on it, and the step of the others is computed again (active set)."""
    scale = equations.parameters.std
    low, high = equations.parameters.bounds
    held = np.zeros(len(scale), dtype=int)
    matrix = linear.information + np.eye(len(scale))
    matrix[range(len(scale)), range(len(scale))] *= 1 + damping
    change = np.zeros(len(scale))
    for _ in range(len(scale)):
        free = held == 0
        right = -linear.gradient - matrix[:, ~free] @ change[~free]
        change[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
        values = state.values + scale * change
        below, above = free & (values < low) & (scale > 0), free & (values > high) & (scale > 0)
        if not np.any(below | above):
            break
        held[below], held[above] = -1, 1
        limit = np.where(held < 0, low, high)
        stopped = held != 0
        change[stopped] = (limit[stopped] - state.values[stopped]) / scale[stopped]
    values = state.values + scale * change
    values[held < 0], values[held > 0] = low[held < 0], high[held > 0]
    return values, held


def leverage(linear: ReducedEquations) -> Array:
    """Leverage of each equation: diagonal of the hat matrix, (p, r), between 0 and 1."""
    half = linear.factor @ np.swapaxes(linear.stack.by_pose, 1, 2)
    rest = linear.pose_free
    posterior = np.linalg.inv(linear.information + np.eye(len(linear.gradient)))
    flat = rest.reshape(-1, rest.shape[2])
    by_values = np.sum((flat @ posterior) * flat, axis=1).reshape(linear.stack.residual.shape)
    return np.asarray(np.sum(half**2, axis=1) + by_values)

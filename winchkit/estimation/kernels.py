"""Inner loops of the Dahl estimator, in plain Python and compiled by numba from the same source.

The factories build functions of floats and flat sequences: lists for plain Python, float64 arrays
for numba.

The state of a pulley is its force F, the derivatives of F by μ, σ and β, and the standard deviation
of F due to the unknown start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, log
from typing import Any

from winchkit.errors import UsageError
from winchkit.estimation.groups import COVARIANCE_SLOTS, PULLEY_SLOTS
from winchkit.model.friction import dahl_step
from winchkit.model.pulleys import presliding_step

STATE_SLOTS = 5
"""Numbers per pulley: its friction force, and the derivatives of it by μ, σ, β and by the start."""
_NEAR_ONE = 1e-4
"""Distance of β from 1 below which the limit at 1 replaces the quotient: its error is of the order
of the distance, and the quotient loses four of sixteen digits at this distance."""

Function = Callable[..., Any]


@dataclass(frozen=True)
class Kernels:
    """Inner loops of one build."""

    name: str
    """``plain`` or ``numba``."""
    advance: Function
    """One sample: tension at the cell, path towards the platform, state -> tension, variance."""
    follow: Function
    """Many samples: fills tension, and derivatives by every group's parameters and by the start."""
    forces: Function
    """Dahl friction along a path with a varying limit: fills the force."""
    array: Callable[[list[float]], Any]
    """Makes a flat sequence of the type that these loops take."""


def _slopes(force: float, new: float, limit: float, reach: float, shape: float) -> Any:
    """Derivatives of the exact step's result by F, by F_c, by ``reach`` q = σ|dx|/F_c and by β;
    forces are positive along the motion, so that u = 1 − F/F_c."""
    u, w = 1.0 - force / limit, 1.0 - new / limit
    near, far = abs(u), abs(w)
    if near == 0.0 or far == 0.0:
        return 0.0, 1.0, 0.0, 0.0
    keep = (far / near) ** shape
    rate = copysign(far**shape, u)
    by_limit = (1.0 - w) - keep * force / limit
    epsilon = 1.0 - shape
    if abs(epsilon) < _NEAR_ONE:
        bend = reach * (reach / 2.0 - log(near))
    else:
        bend = log(far) / epsilon + (reach - near**epsilon * log(near)) / (epsilon * far**epsilon)
    return keep, by_limit, limit * rate, -limit * w * bend


def _pulley(step: Function, slopes: Function) -> Function:
    """Build the update of one pulley's state, which returns the tension behind it."""

    def pulley(tension: float, moved: float, state: Any, s: int, pulleys: Any, p: int) -> float:  # noqa: PLR0917 - numba takes no keywords
        friction, stiffness, shape = pulleys[p + 1], pulleys[p + 2], pulleys[p + 3]
        force = state[s]
        new, normal = step(force, tension, moved, pulleys[p], friction, stiffness, shape)
        limit = friction * normal
        if moved != 0.0 and limit > 0.0:
            sign = 1.0 if moved > 0.0 else -1.0
            reach = stiffness * abs(moved) / limit
            keep, by_limit, by_reach, by_shape = slopes(
                sign * force, sign * new, limit, reach, shape
            )
            by_limit -= by_reach * reach / limit
            state[s + 1] = keep * state[s + 1] + sign * by_limit * normal
            state[s + 2] = keep * state[s + 2] + sign * by_reach * abs(moved) / limit
            state[s + 3] = keep * state[s + 3] + sign * by_shape
            state[s + 4] = keep * state[s + 4]
        state[s] = new
        behind: float = tension + new
        return behind

    return pulley


def _advance(pulley: Function, slots: int, constants: int, variances: int) -> Function:
    """Build the loop over one sample."""

    def advance(  # noqa: PLR0917 - numba takes no keywords
        tension: float, moved: float, state: Any, pulleys: Any, covariances: Any, sums: Any
    ) -> tuple[float, float]:
        for k in range(len(sums)):
            sums[k] = 0.0
        started = 0.0
        for j in range(len(pulleys) // constants):
            s = slots * j
            tension = pulley(tension, moved, state, s, pulleys, constants * j)
            g = 3 * int(pulleys[constants * j + constants - 1])
            sums[g] += state[s + 1]
            sums[g + 1] += state[s + 2]
            sums[g + 2] += state[s + 3]
            started += state[s + 4]
        variance = started * started
        for g in range(len(sums) // 3):
            a, b, c, v = sums[3 * g], sums[3 * g + 1], sums[3 * g + 2], variances * g
            variance += (
                a * a * covariances[v]
                + b * b * covariances[v + 1]
                + c * c * covariances[v + 2]
                + 2.0 * a * b * covariances[v + 3]
                + 2.0 * a * c * covariances[v + 4]
                + 2.0 * b * c * covariances[v + 5]
            )
        return tension, variance

    return advance


def _follow(advance: Function, slots: int) -> Function:
    """Build the loop over many samples with derivatives, for identification."""

    def follow(  # noqa: PLR0917 - numba takes no keywords
        tension: Any,
        moved: Any,
        state: Any,
        pulleys: Any,
        covariances: Any,
        sums: Any,
        out: Any,
        slopes: Any,
    ) -> None:
        width = len(sums)
        for k in range(len(tension)):
            out[k], _ = advance(tension[k], moved[k], state, pulleys, covariances, sums)
            for g in range(width):
                slopes[k][g] = sums[g]
            started = 0.0
            for s in range(slots - 1, len(state), slots):
                started += state[s]
            slopes[k][width] = started

    return follow


def _forces(step: Function) -> Function:
    """Build the loop of Dahl friction along a path with a varying limit."""

    def forces(  # noqa: PLR0917 - numba takes no keywords
        moved: Any, limit: Any, stiffness: float, shape: float, start: float, out: Any
    ) -> None:
        force = start * limit[0]
        for k in range(len(moved)):
            force = step(force, moved[k], limit[k], stiffness, shape)
            out[k] = force

    return forces


def _build(name: str, jit: Function, array: Callable[[list[float]], Any]) -> Kernels:
    """Build all loops, each through ``jit``."""
    dahl = jit(dahl_step)
    pulley = jit(_pulley(jit(presliding_step(dahl)), jit(_slopes)))
    advance = jit(_advance(pulley, STATE_SLOTS, PULLEY_SLOTS, COVARIANCE_SLOTS))
    return Kernels(name, advance, jit(_follow(advance, STATE_SLOTS)), jit(_forces(dahl)), array)


PLAIN = _build("plain", lambda function: function, list)
"""Plain Python, always available."""


def jit_of(plain: str) -> Function:
    """Numba's compiler; UsageError, with the ``plain`` loops as another way, without numba."""
    try:
        from numba import njit
    except ImportError:
        raise UsageError(
            "numba is not installed, which compiles the loops; pip install 'winchkit[fast]', "
            f"or use plain Python with {plain}"
        ) from None
    compiler: Function = njit
    return compiler


def float_array(values: list[float]) -> Any:
    """The sequence type of compiled loops."""
    import numpy as np

    return np.array(values, dtype=np.float64)


def compiled() -> Kernels:
    """Compile the loops with numba and run each once.

    Takes seconds: call it before motion.

    Returns
    -------
    Kernels

    Raises
    ------
    UsageError
        Where numba is not installed (``pip install 'winchkit[fast]'``).
    """
    import numpy as np

    array = float_array
    built = _build("numba", jit_of("winchkit.estimation.PLAIN"), array)
    pulleys, state = array([0.0, 0.1, 1e3, 1.0, 0.0]), array([0.0] * STATE_SLOTS)
    covariances, sums = array([0.0] * COVARIANCE_SLOTS), array([0.0] * 3)
    one, slopes = array([1.0]), np.zeros((1, 4))
    built.advance(1.0, 1e-3, state, pulleys, covariances, sums)
    built.follow(one, one, state, pulleys, covariances, sums, array([0.0]), slopes)
    built.forces(one, one, 1e3, 1.0, 0.0, array([0.0]))
    return built


def fastest() -> Kernels:
    """Compiled loops where numba is installed, else the plain ones."""
    from importlib.util import find_spec

    return compiled() if find_spec("numba") else PLAIN

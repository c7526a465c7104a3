"""Tension over a chain of pulleys, in both directions, without and with memory.

The computation starts at a known tension and passes the pulleys one by one: from the cell at the
drum to the platform, or from the platform to the cell, with the wraps in that order. ``towards`` is
the cable's motion in the direction of computation: from the platform it is positive for winding in,
from the cell positive for paying out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.model.friction import capstan_ratio, stribeck, tension_after

Step = Callable[[float, float, float, float, float], float]
PulleyStep = Callable[..., Any]
_NEWTON_STEPS = 8
"""Three reach rounding for loss factors that add up to 0.6, six for 0.9 (measured over stiffnesses
of 10 to 1e5 N/m and strokes to 0.5 m); two more are a margin."""


@dataclass(frozen=True)
class Eyelets:
    """The cable slides around surfaces that do not turn (Euler-Eytelwein, Eq. 19)."""

    friction: float

    def after(self, tension: Array, wrap: float, towards: Array) -> Array:
        """Tension behind one of them at cable speeds ``towards`` (m/s), N."""
        return tension * capstan_ratio(np.sign(towards) * self.friction, wrap)


@dataclass(frozen=True)
class Bearings:
    """Pulleys with Coulomb and viscous friction in their bearings (Eq. 20–23), and Stribeck's."""

    friction: float = 0.0
    """μ of Coulomb friction, below 1."""
    viscosity: float = 0.0
    """F_pv of each pulley, N s/m."""
    static: float | None = None
    """μ at standstill; None for the same value as in motion."""
    stribeck_speed: float = 0.02
    """m/s."""

    def after(self, tension: Array, wrap: float, towards: Array) -> Array:
        """Tension behind one of them at cable speeds ``towards`` (m/s), N."""
        static = self.friction if self.static is None else self.static
        friction = stribeck(towards, self.friction, static, self.stribeck_speed)
        return tension_after(tension, wrap, np.sign(towards) * friction, self.viscosity * towards)


def over_pulleys(
    tension: ArrayLike, wraps: Sequence[float], towards: ArrayLike, law: Eyelets | Bearings
) -> Array:
    """Tension (n,), N, behind a chain of pulleys without memory, with wraps in the order of
    computation and cable speeds (n,) towards it, m/s."""
    carried, speed = np.asarray(tension, dtype=float), np.asarray(towards, dtype=float)
    for wrap in wraps:
        carried = law.after(carried, wrap, speed)
    return carried


def presliding_step(step: Step) -> PulleyStep:
    """Build the Dahl friction of one pulley over one move from ``step`` (:func:`dahl_step`), plain
    or, with a compiled ``step``, for numba."""

    def pulley_step(  # noqa: PLR0917 - numba takes no keywords
        force: float,
        tension: float,
        moved: float,
        cosine: float,
        friction: float,
        stiffness: float,
        shape: float,
    ) -> tuple[float, float]:
        """New friction force and the normal force that limits it, N. The limit μ N(T, T + F)
        depends on the friction itself; one correction of order μ solves it."""
        normal = 0.0
        new = force
        for _ in range(2):
            after = tension + new
            square = tension * tension - 2.0 * tension * after * cosine + after * after
            normal = sqrt(max(square, 0.0))
            new = step(force, moved, friction * normal, stiffness, shape)
        return new, normal

    return pulley_step


def eq27_tension(
    platform: ArrayLike, towards: ArrayLike, loss: Sequence[float], stiffness: float
) -> Array:
    """Solve Eq. 27 of the winding-device paper, T + Σ s T λ_j (1 − e^(−σ|x|/(λ_j T))) = T_p, for
    the tension T at the load cell, (n,), N, by Newton's method from T_p: the left side increases
    with T.

    x is the displacement of the cable towards the platform since friction was zero, m, s its sign.
    Raises UsageError for loss factors λ_j that are not above 0 with a sum below 1.
    """
    if not all(share > 0 for share in loss) or sum(loss) >= 1:
        raise UsageError(
            f"loss factors {list(loss)} of Eq. 27 must be above 0 and add up to less than 1"
        )
    wanted = np.asarray(platform, dtype=float)
    way = np.asarray(towards, dtype=float)
    sign, reach = np.sign(way), stiffness * np.abs(way)
    tension = np.broadcast_to(wanted, np.broadcast_shapes(wanted.shape, way.shape)).copy()
    for _ in range(_NEWTON_STEPS):
        value, slope = tension.copy(), np.ones_like(tension)
        for share in loss:
            z = reach / (share * tension)
            value += sign * share * tension * -np.expm1(-z)
            slope += sign * share * (-np.expm1(-z) - z * np.exp(-z))
        tension -= (value - wanted) / slope
    return tension

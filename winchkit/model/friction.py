"""Friction of a cable on a pulley: Coulomb, viscous, Stribeck, capstan, Dahl.

The equations are 19 to 26 of the winding-device paper, with the corrections in docs/papers.md.
``before`` and ``after`` are the tensions on the two sides of a pulley in the direction of
computation; ``friction`` and ``drag`` are positive where the cable runs in that direction. In the
opposite direction both signs change, so that every law is its own inverse.
"""

from __future__ import annotations

from itertools import pairwise
from math import copysign, exp

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array
from winchkit.model.recurrence import linear


def normal_force(before: Array, after: Array, wrap: float) -> Array:
    """N = √(T0² − 2 T0 T1 cos α + T1²), the force on the pulley (Eq. 22), N."""
    return np.asarray(np.sqrt(before**2 - 2 * before * after * np.cos(wrap) + after**2))


def tension_after(
    before: ArrayLike, wrap: float, friction: ArrayLike, drag: ArrayLike = 0.0
) -> Array:
    """Tension T1 behind a pulley with T1 − T0 = μ N(T0, T1) + d (Eq. 20–23), N, of any shapes, by
    the coefficient |μ| < 1 and the viscous drag d, signed.

    Squaring gives a quadratic in T1; the root that is smooth at μ = 0 is taken.
    """
    first, m = np.asanyarray(before), np.asanyarray(friction)
    pulled, square, cosine = first + np.asanyarray(drag), m**2, np.cos(wrap)
    inside = (pulled - first) ** 2 + first * (1 - cosine) * (
        2 * pulled - square * first * (1 + cosine)
    )
    root = m * np.sqrt(inside)
    return np.asanyarray((pulled - square * cosine * first + root) / (1 - square))


def coulomb_ratio(friction: ArrayLike, wrap: float) -> Array:
    """T1/T0 over a pulley with Coulomb friction μ N (Eq. 20–23); ``friction`` signed, |μ| < 1."""
    return tension_after(1.0, wrap, friction)


def capstan_ratio(friction: Array, wrap: float) -> Array:
    """T1/T0 of a cable that slides around ``wrap`` rad: e^(μ α), μ signed (Eq. 19)."""
    return np.asanyarray(np.exp(friction * wrap))


def stribeck(speed: Array, coulomb: float, static: float, stribeck_speed: float) -> Array:
    """Coefficient μc + (μs − μc) e^(−(v/vs)²), unsigned; speeds in m/s."""
    fallen = np.exp(-((speed / stribeck_speed) ** 2))
    return np.asanyarray(coulomb * (1 - fallen) + static * fallen)


def dahl_step(force: float, moved: float, limit: float, stiffness: float, shape: float) -> float:
    """Dahl friction, N, after a monotone move, signed, m, exact at a constant limit F_c, N (Eq.
    25), with the stiffness σ, N/m, and the exponent β."""
    # Plain floats and branches only, since winchkit.estimation compiles this function.
    if limit <= 0.0:
        return 0.0
    sign = 1.0 if moved > 0.0 else -1.0
    u = 1.0 - sign * force / limit
    if moved == 0.0 or u == 0.0:
        return force
    q = stiffness * abs(moved) / limit
    if shape == 1.0:
        return sign * limit * (1.0 - u * exp(-q))
    base = abs(u) ** (1.0 - shape) + (shape - 1.0) * q
    left = copysign(base ** (1.0 / (1.0 - shape)), u) if base > 0.0 else 0.0
    return sign * limit * (1.0 - left)


def dahl(
    position: Array, limit: Array, stiffness: float, shape: float = 1.0, start: float = 0.0
) -> Array:
    """Dahl friction (n,), N, along a motion, with a limit F_c (n,) that may change; ``start`` is
    the first force as a share of the limit. With β = 1 the step is linear and solved by a scan."""
    moved = np.diff(position, prepend=position[:1])
    first = start * limit[0] if len(limit) else 0.0
    if shape == 1.0:
        safe = np.where(limit > 0, limit, 1.0)
        decay = np.where(limit > 0, np.exp(-stiffness * np.abs(moved) / safe), 0.0)
        return linear(decay, np.sign(moved) * limit * (1 - decay), first)
    force = first
    out = np.empty_like(limit)
    for k, (step, most) in enumerate(zip(moved.tolist(), limit.tolist(), strict=True)):
        force = dahl_step(force, step, most, stiffness, shape)
        out[k] = force
    return out


def dahl_constant(
    position: Array, limit: float, stiffness: float, shape: float = 1.0, start: float = 0.0
) -> Array:
    """Dahl friction along a motion at a constant limit F_c, as :func:`dahl`. The step is exact over
    any monotone section: the loop runs over the reversals, and all samples between two are computed
    together."""
    out = np.zeros(len(position))
    if limit <= 0.0 or not len(position):
        return out
    rises = np.diff(position) > 0
    turns = np.flatnonzero(rises[1:] != rises[:-1]) + 1
    ends = [0, *turns.tolist(), len(position) - 1]
    force = out[0] = start * limit
    for first, last in pairwise(ends):
        piece = out[first + 1 : last + 1]
        np.subtract(position[first + 1 : last + 1], position[first], out=piece)
        _along(piece, float(force), limit, stiffness, shape)
        force = out[last]
    return out


def _along(gone: Array, force: float, limit: float, stiffness: float, shape: float) -> None:
    """Replace ``gone``, the distance along a monotone section (m), by the force there, in place."""
    sign = 1.0 if len(gone) and gone[-1] > 0 else -1.0
    u = 1.0 - sign * force / limit
    if u == 0.0 or not len(gone) or gone[-1] == 0.0:
        gone[:] = force
        return
    gone *= sign * stiffness / limit
    if shape == 1.0:
        np.negative(gone, out=gone)
        np.exp(gone, out=gone)
        gone *= -sign * limit * u
    else:
        gone *= shape - 1.0
        gone += abs(u) ** (1.0 - shape)
        np.maximum(gone, 0.0, out=gone)
        np.power(gone, 1.0 / (1.0 - shape), out=gone)
        gone *= copysign(limit, -sign * u)
    gone += sign * limit

"""Friction of a rope on a pulley: Coulomb, capstan and Dahl (Cable-winding device, Eq. 19–26)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.model.recurrence import linear

__all__ = ["coulomb_ratio", "dahl", "dahl_step", "normal_force"]

Array = NDArray[np.float64]


def normal_force(before: Array, after: Array, wrap: float) -> Array:
    """N = √(T0² − 2 T0 T1 cos α + T1²), the force on the pulley (Eq. 22), N."""
    return np.asarray(np.sqrt(before**2 - 2 * before * after * np.cos(wrap) + after**2))


def coulomb_ratio(friction: Array, wrap: float) -> Array:
    """T1/T0 over a pulley with T1 − T0 = μ N(T0, T1) (Eq. 20–23), solved in closed form.

    ``friction`` is signed: positive where the rope runs towards T1, |μ| < 1. Squaring gives a
    quadratic in the ratio whose root continues through μ = 0 without a kink.
    """
    cosine = np.cos(wrap)
    square = friction**2
    root = friction * np.sqrt((1 - cosine) * (2 - square * (1 + cosine)))
    return np.asarray((1 - square * cosine + root) / (1 - square))


def dahl_step(force: float, moved: float, limit: float, stiffness: float, shape: float) -> float:
    """Friction after a monotone move, exact for any shape β at a constant limit F_c (Eq. 25).

    ``force`` and ``limit`` in N, ``moved`` in m (signed), ``stiffness`` σ in N/m.
    """
    if limit <= 0.0:
        return 0.0
    if moved == 0.0:
        return force
    sign = 1.0 if moved > 0 else -1.0
    u = 1.0 - sign * force / limit
    q = stiffness * abs(moved) / limit
    if shape == 1.0:
        left = u * np.exp(-q)
    else:
        base = abs(u) ** (1.0 - shape) + (shape - 1.0) * q if u else np.inf
        left = np.copysign(max(base, 0.0) ** (1.0 / (1.0 - shape)), u) if u else 0.0
    return float(sign * limit * (1.0 - left))


def dahl(
    position: Array, limit: Array, stiffness: float, shape: float = 1.0, start: float = 0.0
) -> Array:
    """Dahl friction along ``position`` (m), with a limit F_c that may change (N); shapes (n,).

    ``start`` is the force at the first sample as a share of the limit, −1 to 1. With β = 1 the
    step is linear in the force and solved by a scan; else sample by sample.
    """
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

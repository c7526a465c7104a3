"""Friction of one contact, as a share of its sliding friction, over a prescribed motion.

H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky, Friction models and friction
compensation, European Journal of Control 4 (1998); P. R. Dahl, A solid friction model (1968);
C. Canudas de Wit and others, IEEE Transactions on Automatic Control 40 (1995) (LuGre).
"""

from __future__ import annotations

import numpy as np

from missing_physics.machine import FINE, Array

FORMS = ("sharp", "tanh", "arctan", "held", "dahl", "lugre")
STRIBECK = 1.35
"""Static over sliding friction of the LuGre form."""


def share(form: str, speed: Array, scale: float) -> Array:
    """Friction over sliding friction, −1 to 1 (LuGre up to 1.35); (n,) at fine steps.

    ``scale``: speed of the reversal of ``tanh`` and ``arctan``, Stribeck speed of ``lugre``; the
    distance of presliding of ``dahl``, of ``lugre`` a hundredth of a second at ``scale``.
    """
    if form == "sharp":
        return np.sign(speed)
    if form == "tanh":
        return np.tanh(speed / scale)
    if form == "arctan":
        return np.arctan(speed / scale) * 2 / np.pi
    if form == "held":
        return held(speed, scale)
    if form == "dahl":
        return bristles(speed, scale, np.ones_like(speed))
    curve = 1 + (STRIBECK - 1) * np.exp(-((speed / scale) ** 2))
    return bristles(speed, scale / 100, curve)


def held(speed: Array, scale: float) -> Array:
    """Coulomb friction that keeps its force at standstill, as a loaded contact does."""
    moving = np.abs(speed) > scale / 10
    last = np.maximum.accumulate(np.where(moving, np.arange(len(speed)), 0))
    return np.where(moving.any() & (last > 0), np.sign(speed[last]), 0.0)


def bristles(speed: Array, distance: float, curve: Array) -> Array:
    """dz/dx = (1 − s z/g)/δ, g the sliding friction: exact for a constant speed in each step.

    Dahl's friction with g = 1, LuGre's without damping with a Stribeck curve.
    """
    decay = np.exp(-np.abs(speed) / (FINE * distance * curve)).tolist()
    value, out = 0.0, []
    for s, g, d in zip(np.sign(speed).tolist(), curve.tolist(), decay, strict=True):
        value = s * g + (value - s * g) * d if s else value
        out.append(value)
    return np.asarray(out)


def stribeck(speed: Array, scale: float) -> Array:
    """Excess of the friction at low speed over that at high speed, of unit size."""
    return np.sign(speed) * np.exp(-((speed / scale) ** 2))

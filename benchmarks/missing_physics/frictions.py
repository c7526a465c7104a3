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
        return dahl(speed, scale)
    return lugre(speed, scale / 100, scale)


def held(speed: Array, scale: float) -> Array:
    """Coulomb friction whose force stays at standstill: the load leans on the contact."""
    moving = np.abs(speed) > scale / 10
    last = np.maximum.accumulate(np.where(moving, np.arange(len(speed)), 0))
    return np.where(moving.any() & (last > 0), np.sign(speed[last]), 0.0)


def dahl(speed: Array, distance: float) -> Array:
    """dF/dx = (1 − s F)/δ, solved exactly for a constant speed within each step."""
    decay = np.exp(-np.abs(speed) / (FINE * distance)).tolist()
    value, out = 0.0, []
    for s, d in zip(np.sign(speed).tolist(), decay, strict=True):
        value = s + (value - s) * d if s else value
        out.append(value)
    return np.asarray(out)


def lugre(speed: Array, distance: float, stribeck: float) -> Array:
    """Bristles of LuGre without damping: dz/dt = v (1 − s z/g(v))/δ, g the Stribeck curve."""
    curve = 1 + (STRIBECK - 1) * np.exp(-((speed / stribeck) ** 2))
    decay = np.exp(-np.abs(speed) / (FINE * distance * curve)).tolist()
    value, out = 0.0, []
    for s, g, d in zip(np.sign(speed).tolist(), curve.tolist(), decay, strict=True):
        value = s * g + (value - s * g) * d if s else value
        out.append(value)
    return np.asarray(out)


def stribeck(speed: Array, scale: float) -> Array:
    """Excess of the friction at low speed over that at high speed, of unit size."""
    return np.sign(speed) * np.exp(-((speed / scale) ** 2))

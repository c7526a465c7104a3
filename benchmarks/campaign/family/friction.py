"""Laws of friction as a sense in about -1 … 1 over a prescribed motion.

A law turns the speed of a place (rad/s of the motor, m/s of the cable at a pulley) into a sense;
the place multiplies it with its friction. Steps are those of the motion, :data:`machine.STEP`.
Laws with memory are integrated exactly for a speed that is constant within a step: of those that
depend on the path alone (Dahl, Maxwell-slip) only a reversal within a step has an error, of LuGre
that of the midpoint rule, second order in the step.

References: Dahl, 1968; Iwan, J. Appl. Mech. 33 (1966) for Maxwell-slip; Canudas de Wit, Olsson,
Åström and Lischinsky, IEEE Trans. Autom. Control 40 (1995) for LuGre.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import exp

import numpy as np

from winchkit.arrays import Array

Random = np.random.Generator
ELEMENTS = ((0.3, 0.3), (1.0, 0.4), (3.0, 0.3))
"""Of Maxwell-slip: distance over the mean one, share of the friction."""
DISTANCES = {"motor": (3e-3, 0.3), "gear": (3e-3, 0.3), "pulley": (5e-5, 5e-3)}
"""Presliding: rad of a motor (teeth, seals), m of cable on a sheave."""


@dataclass(frozen=True)
class Shape:
    """Parameters of a law; those that it has not are zero."""

    scale: float = 0.0
    """Speed of the transition, in the place's unit."""
    distance: float = 0.0
    """Travel of presliding."""
    static: float = 1.0
    """Static over sliding friction."""
    stribeck: float = 0.0
    """Speed over which static friction falls."""
    back: float = 1.0
    """Friction of the negative direction over that of the positive one."""


Law = Callable[[Array, float, Shape], Array]


def _sharp(speed: Array, _: float, __: Shape) -> Array:
    return np.sign(speed)


def _tanh(speed: Array, _: float, shape: Shape) -> Array:
    return np.tanh(speed / shape.scale)


def _arctan(speed: Array, _: float, shape: Shape) -> Array:
    return np.arctan(speed / shape.scale) * (2 / np.pi)


def _saturating(speed: Array, _: float, shape: Shape) -> Array:
    return speed / (np.abs(speed) + shape.scale)


def _asymmetric(speed: Array, _: float, shape: Shape) -> Array:
    return np.where(speed < 0, -shape.back, np.sign(speed))


def _dahl(speed: Array, step: float, shape: Shape) -> Array:
    return _lugre(speed, step, Shape(distance=shape.distance))


def _lugre(speed: Array, step: float, shape: Shape) -> Array:
    """d(force)/dt = (v − |v| force / g(v)) / distance, without friction at the start."""
    middle = (speed[1:] + speed[:-1]) / 2
    sliding = np.ones_like(middle)
    if shape.static != 1.0:
        sliding += (shape.static - 1) * np.exp(-((middle / shape.stribeck) ** 2))
    ends = np.sign(middle) * sliding
    decays = np.exp(-np.abs(middle) * step / (shape.distance * sliding))
    force, out = 0.0, [0.0]
    for end, decay in zip(ends.tolist(), decays.tolist(), strict=True):
        force = end + (force - end) * decay
        out.append(force)
    return np.array(out)


def _maxwell_slip(speed: Array, step: float, shape: Shape) -> Array:
    """Springs in parallel, each in series with a Coulomb slider."""
    moves = ((speed[1:] + speed[:-1]) / 2 * step).tolist()
    total = np.zeros(len(speed))
    for of_distance, share in ELEMENTS:
        end, bent, out = of_distance * shape.distance, 0.0, [0.0]
        for move in moves:
            bent = min(max(bent + move, -end), end)
            out.append(bent)
        total += share / end * np.array(out)
    return total


LAWS: Mapping[str, Law] = {
    "sharp": _sharp,
    "tanh": _tanh,
    "arctan": _arctan,
    "dahl": _dahl,
    "maxwell-slip": _maxwell_slip,
    "lugre": _lugre,
    "saturating": _saturating,
    "asymmetric": _asymmetric,
}


def sense(law: str, speed: Array, step: float, shape: Shape) -> Array:
    """The sense of friction along a motion of steps of ``step`` (s); shape (n,)."""
    return LAWS[law](speed, step, shape)


def draw_shape(random: Random, law: str, part: str, highest: float) -> Shape:
    """Any parameters of a law at a part whose highest speed is ``highest``."""

    def between(low: float, high: float) -> float:
        return float(exp(random.uniform(np.log(low), np.log(high))))

    distance = between(*DISTANCES[part])
    if law in {"tanh", "arctan"}:
        return Shape(scale=highest * between(1e-3, 0.03))
    if law == "saturating":
        return Shape(scale=highest * between(0.03, 0.3))
    if law == "asymmetric":
        return Shape(back=random.uniform(0.4, 0.8))
    if law == "lugre":
        slow = highest * between(0.01, 0.1)
        return Shape(distance=distance, static=random.uniform(1.15, 1.6), stribeck=slow)
    return Shape() if law == "sharp" else Shape(distance=distance)

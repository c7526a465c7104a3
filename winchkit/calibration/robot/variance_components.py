"""How exact each kind of measurement was, from the fit's own residuals (Helmert's estimate of
variance components): Σ r² over what the fit left free of that kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from winchkit.calibration.robot.least_squares import Solution, Weights, leverage

__all__ = ["NOISE", "KindNoise", "re_estimated"]


@dataclass(frozen=True)
class KindNoise:
    """What is believed of a kind of measurement before anything is fitted."""

    unit: str
    start: float
    least: float


NOISE: dict[str, KindNoise] = {
    "rope": KindNoise("m", 5e-5, 1e-7),
    "position": KindNoise("m", 5e-5, 1e-7),
    "rotation": KindNoise("rad", 2e-3, 1e-7),
    "swivel": KindNoise("rad", 2e-3, 1e-7),
    "cable_length": KindNoise("m", 1e-4, 1e-7),
    "balance": KindNoise("N", 1.0, 1e-4),
}
"""Kinds of equations; ``rope`` is what the drum says against what the geometry says."""

_FREE_LEAST = 12.0
_SHARE_LEAST = 0.02


def re_estimated(solution: Solution, weights: Weights, given: Mapping[str, float]) -> Weights:
    """Weights with the standard deviation of every kind that was not given, re-estimated.

    A kind that the fit leaves hardly any freedom (a position alone of its pose) keeps its own.
    """
    linear = solution.linear
    used = leverage(linear)
    sigma = dict(weights.sigma)
    for kind, part in linear.stack.kinds.items():
        known = linear.stack.known[:, part]
        free = float(np.sum((1 - used[:, part])[known]))
        if kind in given or free < max(_FREE_LEAST, _SHARE_LEAST * np.count_nonzero(known)):
            continue
        square = float(np.sum(linear.stack.residual[:, part] ** 2)) / free
        sigma[kind] = max(sigma[kind] * float(np.sqrt(square)), NOISE[kind].least)
    return Weights(sigma, weights.loss)

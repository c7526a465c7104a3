"""Standard deviation of each kind of measurement of a calibration, from the fit's own residuals.

The estimate is that of :mod:`winchkit.robot.identification.variance_components`, with the
leverages of poses and parameters together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from winchkit.robot.identification.bundle_adjustment import Solution, Weights, leverage
from winchkit.robot.identification.variance_components import START, re_estimated


@dataclass(frozen=True)
class KindNoise:
    """Start and lower limit of a kind's standard deviation."""

    unit: str
    start: float
    least: float


def _noise(unit: str, kind: str, least: float = 1e-7) -> KindNoise:
    return KindNoise(unit, START[kind], least)


NOISE: dict[str, KindNoise] = {
    "closure": _noise("m", "closure"),
    "position": _noise("m", "position"),
    "rotation": _noise("rad", "rotation"),
    "swivel": _noise("rad", "swivel"),
    "cable_length": _noise("m", "cable_length"),
    "balance": _noise("N", "balance", 1e-4),
}
"""Kinds of equations; ``closure`` is the length by the drum against the length by geometry."""

_LEAST_REDUNDANCY = 12.0
"""Degrees of freedom: a standard deviation from twelve is known to 20 % (1/√(2·12)); with fewer the
declared one is better."""


def re_estimated_weights(
    solution: Solution, weights: Weights, given: Mapping[str, float]
) -> Weights:
    """Weights with the standard deviation of every kind that was not given, re-estimated.

    A kind with hardly any redundancy (a position that alone determines its pose) keeps its own.
    """
    linear = solution.linear
    used = leverage(linear)
    sigma = dict(weights.sigma)
    for kind, part in linear.stack.kinds.items():
        if kind in given:
            continue
        known = linear.stack.known[:, part]
        sigma[kind] = re_estimated(
            sigma[kind],
            linear.stack.residual[:, part][known],
            used[:, part][known],
            least_redundancy=_LEAST_REDUNDANCY,
            least=NOISE[kind].least,
        ).sigma
    return Weights(sigma)

"""What these runs can show: the smallest size of every effect that would have been seen."""

from __future__ import annotations

import numpy as np

from winchkit.diagnosis.result import Detectable
from winchkit.diagnosis.score import Score
from winchkit.effects.coordinates import Coordinates

__all__ = ["detectable"]

_POWER_QUANTILE = 1.2816


def detectable(scores: tuple[Score, ...], price: float, threshold: float) -> tuple[Detectable, ...]:
    """Smallest main parameter per effect, found with 90 % power against what noise alone scores.

    NaN where no size within the parameter's bounds would be found.
    """
    out = []
    for item in scores:
        effect = item.atom.effect
        if item.strength <= 0:
            continue
        needed = max(threshold, 0.0) + price * item.atom.freedom
        size = (np.sqrt(needed) + _POWER_QUANTILE) / np.sqrt(item.strength)
        secant = item.atom.secants[0]
        name = next(iter(secant))
        parameter = effect.parameter(name)
        if effect.polar and name == effect.polar[0]:
            value = size * secant[name]
        else:
            coordinates = Coordinates(effect)
            base = {**effect.null, **item.atom.shape}
            null = coordinates.vector(base)
            moved = null + size * (coordinates.vector({**base, **secant}) - null)
            low, high = coordinates.bounds()
            if np.any((moved < low) | (moved > high)):
                value = float("nan")
            else:
                value = coordinates.values(moved, base)[name]
        out.append(Detectable(effect.id, name, float(value), parameter.unit))
    return tuple(sorted(out, key=lambda d: d.effect))

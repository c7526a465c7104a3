"""What these runs can show: the smallest size of every effect that would have been seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.diagnosis.design.discrimination import power_of
from winchkit.diagnosis.results import Detectable
from winchkit.diagnosis.selection.scores import Score
from winchkit.effects.parametrization import Coordinates

__all__ = ["Bar", "detectable"]

_POWER_QUANTILE = 1.2816


@dataclass(frozen=True)
class Bar:
    """What an effect must bring to be named."""

    penalty_per_parameter: float
    """Whitened squares that one degree of freedom must save."""
    threshold: float
    """What noise alone may score beyond that."""

    def squares(self, n_parameters: int) -> float:
        """Whitened squares that an effect of so many unknowns must take."""
        return max(self.threshold, 0.0) + self.penalty_per_parameter * n_parameters

    def power(self, strength: float, n_parameters: int) -> float:
        """Chance that an effect of noncentrality λ takes as much."""
        return power_of(strength, self.squares(n_parameters))


def detectable(scores: tuple[Score, ...], bar: Bar) -> tuple[Detectable, ...]:
    """Smallest main parameter per effect, found with 90 % power against what noise alone scores.

    NaN where no size within the parameter's bounds would be found.
    """
    out = []
    for item in scores:
        effect = item.candidate.effect
        if item.noncentrality <= 0:
            continue
        size = (np.sqrt(bar.squares(item.candidate.n_parameters)) + _POWER_QUANTILE) / np.sqrt(
            item.noncentrality
        )
        usual_step = item.candidate.usual_steps[0]
        name = next(iter(usual_step))
        parameter = effect.parameter(name)
        if effect.polar and name == effect.polar[0]:
            value = size * usual_step[name]
        else:
            coordinates = Coordinates(effect)
            base = {**effect.null, **item.candidate.shape}
            null = coordinates.vector(base)
            moved = null + size * (coordinates.vector({**base, **usual_step}) - null)
            low, high = coordinates.bounds()
            if np.any((moved < low) | (moved > high)):
                value = float("nan")
            else:
                value = coordinates.values(moved, base)[name]
        out.append(Detectable(effect.id, name, float(value), parameter.unit))
    return tuple(sorted(out, key=lambda d: d.effect))

"""Detectable sizes: the smallest size of each effect that these runs detect with 90 % power."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.diagnosis.design.discrimination import power_of
from winchkit.diagnosis.results import Detectable
from winchkit.diagnosis.selection.scores import Score
from winchkit.effects.parametrization import Coordinates

_POWER_QUANTILE = 1.2816
"""Normal quantile of the power of detectable sizes; theory: Φ⁻¹(0.90)."""


@dataclass(frozen=True)
class DetectionThreshold:
    """Detection threshold of a candidate effect, in decrease of χ²."""

    penalty_per_parameter: float
    """Penalty per parameter, ln n."""
    score_threshold: float
    """1 % level of the largest score under noise alone."""

    def required_ss(self, n_parameters: int, by_chance: float = np.inf) -> float:
        """Decrease of χ² that an effect must reach.

        ``by_chance`` is the threshold of this effect alone; the lower threshold counts.
        """
        threshold = min(self.score_threshold, by_chance)
        return max(threshold, 0.0) + self.penalty_per_parameter * n_parameters

    def power(self, noncentrality: float, n_parameters: int) -> float:
        """Probability that an effect of noncentrality λ reaches it."""
        return power_of(noncentrality, self.required_ss(n_parameters))


def detectable(scores: tuple[Score, ...], threshold: DetectionThreshold) -> tuple[Detectable, ...]:
    """Smallest size of the main parameter of every effect that is detected with 90 % power.

    The size is NaN where none within the bounds is detected. √λ = √required + Φ⁻¹(0.9) with the
    noncentrality λ of the projected signature: the normal approximation of a noncentral χ² with one
    degree of freedom, conservative for effects with more parameters.
    """
    out = []
    for item in scores:
        effect = item.candidate.effect
        if item.noncentrality <= 0:
            continue
        required = threshold.required_ss(item.candidate.n_parameters, item.by_chance)
        size = (np.sqrt(required) + _POWER_QUANTILE) / np.sqrt(item.noncentrality)
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

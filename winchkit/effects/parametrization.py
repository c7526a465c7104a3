"""Coordinates in which an effect is fitted: of order one, and zero where the effect vanishes.

Amplitudes are fitted as (value − null)/scale, stiffnesses as compliances, an amplitude with its
phase as a cosine and a sine amplitude, shapes that are positive by their logarithm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import atan2, cos, exp, hypot, inf, log, sin

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter

_FORM = frozenset({"shape", "nuisance"})
"""Roles of parameters that, where they are positive, are fitted by their logarithm."""


@dataclass(frozen=True)
class Coordinates:
    """Map between an effect's values in files and the vector of a fit."""

    effect: Effect

    @cached_property
    def _polar(self) -> frozenset[str]:
        return frozenset(name for pair in self.effect.polar_pairs for name in pair)

    @cached_property
    def amplitudes(self) -> tuple[Parameter, ...]:
        """Parameters of its size; an amplitude and its phase count as two."""
        return tuple(
            p for p in self.effect.parameters if p.role == "amplitude" or p.name in self._polar
        )

    @cached_property
    def shapes(self) -> tuple[Parameter, ...]:
        """Parameters of its form that a fit refines."""
        return tuple(
            p
            for p in self.effect.parameters
            if p.role == "shape" and not p.whole and p.name not in self._polar
        )

    @cached_property
    def nuisances(self) -> tuple[Parameter, ...]:
        """Fitted parameters that are no part of the law."""
        return tuple(p for p in self.effect.parameters if p.role == "nuisance")

    @cached_property
    def _fitted(self) -> tuple[Parameter, ...]:
        return self.amplitudes + self.shapes + self.nuisances

    def __len__(self) -> int:
        return len(self._fitted)

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in the order of the vector."""
        return tuple(p.name for p in self._fitted)

    @property
    def n_parameters(self) -> int:
        """Degrees of freedom of the law, a scanned order included."""
        return len(self) - len(self.nuisances) + sum(p.whole for p in self.effect.parameters)

    def vector(self, values: Mapping[str, float]) -> Array:
        """Coordinates of values, shape (len,)."""
        out = [_to_coordinate(p, values[p.name]) for p in self._fitted]
        place = {p.name: index for index, p in enumerate(self._fitted)}
        for size, phase in self.effect.polar_pairs:
            amplitude = values[size] / self.effect.parameter(size).typical
            out[place[size]] = amplitude * cos(values[phase])
            out[place[phase]] = amplitude * sin(values[phase])
        return np.array(out)

    def values(self, vector: Array, base: Mapping[str, float]) -> dict[str, float]:
        """Values at coordinates; values that are not fitted come from ``base``."""
        out = dict(base)
        at = {p.name: float(x) for p, x in zip(self._fitted, vector, strict=True)}
        for parameter in self._fitted:
            if parameter.name not in self._polar:
                out[parameter.name] = _to_value(parameter, at[parameter.name])
        for size, phase in self.effect.polar_pairs:
            scale = self.effect.parameter(size).typical
            out[size] = min(scale * hypot(at[size], at[phase]), self.effect.parameter(size).high)
            out[phase] = atan2(at[phase], at[size])
        return out

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper coordinates, each of shape (len,)."""
        low, high = [], []
        for parameter in self._fitted:
            if parameter.name in self._polar:
                ends = [-inf, inf]
            else:
                ends = sorted(_to_coordinate(parameter, x) for x in (parameter.low, parameter.high))
            low.append(ends[0])
            high.append(ends[1])
        return np.array(low), np.array(high)

    def deviations(self, vector: Array, std: Array, base: Mapping[str, float]) -> dict[str, float]:
        """Standard deviations of values from those of coordinates, by the delta method with the
        larger of both one-sided differences: at a bound only one side is allowed.
        """
        here, out = self.values(vector, base), {p.name: 0.0 for p in self._fitted}
        for index, step in enumerate(std):
            sides = []
            for nudge in (1e-3 * step, -1e-3 * step):
                moved = vector.copy()
                moved[index] += nudge
                sides.append(self.values(moved, base))
            for name, so_far in out.items():
                change = max(abs(side[name] - here[name]) for side in sides) / 1e-3
                out[name] = hypot(so_far, change)
        return out

    def grid(self) -> list[dict[str, float]]:
        """Combinations of coarse shape values for the scores; at least the default."""
        shaped = [
            p
            for p in self.effect.parameters
            if p.role == "shape" and p.grid and p.name not in self._polar
        ]
        combinations = product(*(p.grid for p in shaped))
        return [dict(zip((p.name for p in shaped), point, strict=True)) for point in combinations]

    def usual_steps(self) -> list[dict[str, float]]:
        """Values of typical size, one set per column of the effect's signature."""
        if self.effect.probes:
            return [dict(probe) for probe in self.effect.probes]
        out: list[dict[str, float]] = []
        for parameter in self.amplitudes:
            if parameter.name not in self._polar:
                out.append({parameter.name: parameter.typical})
        for size, phase in self.effect.polar_pairs:
            typical = self.effect.parameter(size).typical
            out += [{size: typical, phase: 0.0}, {size: typical, phase: np.pi / 2}]
        return out


def _scale(parameter: Parameter) -> float:
    return abs(parameter.typical - parameter.null) or 1.0


def _to_coordinate(parameter: Parameter, value: float) -> float:
    if parameter.reciprocal:
        return parameter.typical / value if value else inf
    if parameter.role in _FORM and parameter.low > 0:
        return log(value / parameter.typical) if value < inf else inf
    return (value - parameter.null) / _scale(parameter)


def _to_value(parameter: Parameter, x: float) -> float:
    if parameter.reciprocal:
        # A stiffness beyond the null, as at the end of an interval, is infinite.
        value = parameter.typical / x if x > 0 or (x and parameter.low < 0) else inf
    elif parameter.role in _FORM and parameter.low > 0:
        value = parameter.typical * exp(min(x, 700.0))
    else:
        value = parameter.null + x * _scale(parameter)
    return min(max(value, parameter.low), parameter.high)

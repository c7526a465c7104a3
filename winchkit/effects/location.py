"""Candidates within what the data can show: places along a stroke, limits of a reading, delays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.effect import Effect, Parameter, Values
from winchkit.model.stages import At
from winchkit.model.variables import VARIABLES

GRID_OF_PLACES = tuple((k + 0.5) / 12 for k in range(12))
"""Shares of the stroke at which a place is first tried; its width is then a twelfth of it."""
_BELOW = 0.1
"""Smallest extent over that of the grid."""
_SAMPLES = 2.0
"""Sampling intervals by which a logger may be late: one of its own, one of the bus."""


def window(variable: Array, values: Values) -> Array:
    """Smooth window around a place of a variable, with the parameters ``place`` and ``width``."""
    distance = (variable - values["place"]) / values["width"]
    return np.asanyarray(np.exp(-(distance**2)))


def located(effect: Effect, motions: Sequence[At]) -> Effect:
    """An effect with the grids of its places in the range of the data.

    A place (``Parameter.over``) is at ``low + share (high − low)``, an extent (``Parameter.along``)
    at ``share (high − low)``; its lower bound is a tenth of the least, below which the data show
    none. A delay is bounded by what a filter and a bus can be, and at least by two samples.
    """
    if effect.is_delay:
        step = max((float(np.median(np.diff(at.time))) for at in motions), default=0.0)
        return replace(effect, parameters=tuple(_bounded(p, step) for p in effect.parameters))
    if not any(p.over or p.along for p in effect.parameters):
        return effect
    parameters = tuple(_located(p, motions) for p in effect.parameters)
    return replace(effect, parameters=parameters)


def _bounded(parameter: Parameter, step: float) -> Parameter:
    """A delay within its plausible range, or two sampling intervals where these are longer."""
    if parameter.plausible is None:
        return parameter
    low, high = parameter.plausible.low, parameter.plausible.high
    longest = max(high, _SAMPLES * step)
    return replace(
        parameter,
        low=max(parameter.low, min(low, -longest if low < 0 else 0.0)),
        high=min(parameter.high, longest),
    )


def _located(parameter: Parameter, motions: Sequence[At]) -> Parameter:
    name = parameter.over or parameter.along
    if not name:
        return parameter
    ranges = [VARIABLES[name](at) for at in motions]
    low = min(float(np.min(values)) for values in ranges)
    extent = max(float(np.max(values)) for values in ranges) - low
    origin = low if parameter.over else 0.0
    grid = (origin + share * extent for share in parameter.grid)
    within = tuple(x for x in grid if parameter.low < x < parameter.high)
    least = _BELOW * min(within) if parameter.along and within else parameter.low
    low = max(parameter.low, least)
    return replace(parameter, grid=within or (parameter.null,), low=low)

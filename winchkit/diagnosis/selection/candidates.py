"""Candidate set: effects that the data could show, at every point of their shape grid."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from winchkit.diagnosis.regression.base import Regression
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates

Point = tuple[Effect, dict[str, float], list[dict[str, float]]]
"""An effect, a point of its shape grid, and its values of a usual size there."""


def points(regression: Regression, effects: Iterable[Effect]) -> Iterator[Point]:
    """Effects at the points of their shape grids, as far as the data could show them."""
    for effect in effects:
        if regression.missing_needs(effect):
            continue
        coordinates = Coordinates(effect)
        for shape in coordinates.grid():
            if regression.excites(shape):
                yield effect, shape, coordinates.usual_steps()


def with_grid_points(effect: Effect, name: str, values: Iterable[float]) -> Effect:
    """The effect with further values in the grid of a shape; itself where it has them all."""
    known = set(effect.parameter(name).grid)
    longer = tuple(sorted({*known, *map(float, values)}))
    return effect if len(longer) == len(known) else with_grid(effect, name, longer)


def with_grid(effect: Effect, name: str, values: tuple[float, ...]) -> Effect:
    """The effect with another grid of a shape."""
    parameters = (replace(p, grid=values) if p.name == name else p for p in effect.parameters)
    return replace(effect, parameters=tuple(parameters))

"""Starting values of a candidate's fit, and the check of shapes that end at a bound."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.projection import partialled_out
from winchkit.diagnosis.selection.scores import Score
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = [
    "grid_spacing",
    "other_grid_point",
    "shape_at_bound",
    "starting_points",
    "starting_values",
    "truncated_series",
]


def shape_at_bound(term: Term) -> bool:
    """Whether a shape parameter is at its bound or the values are physically impossible."""
    effect = term.effect
    if effect.possible is not None and not effect.possible(term.values):
        return True
    coordinates = Coordinates(effect)
    at = coordinates.vector(term.values)
    low, high = coordinates.bounds()
    shapes = slice(len(coordinates.amplitudes), None)
    ends = (at <= low + 1e-6) | (at >= high - 1e-6)
    return bool(np.any(ends[shapes]))


def truncated_series(effect: Effect) -> list[Effect]:
    """The effect with the first coefficient of its series, with the first two, and so on.

    A few loads determine the first coefficient of a law, not the third: undetermined coefficients
    would run to their bounds. An effect without a series is returned alone.
    """
    series = [p for p in effect.parameters if p.role == "shape" and p.low < p.null == 0.0 < p.high]
    out = [effect]
    while len(series) > 1:
        last, longer = series.pop(), out[0]
        held = replace(last, role="fixed")
        parameters = tuple(held if p is last else p for p in longer.parameters)
        probes = tuple(probe for probe in longer.probes if last.name not in probe)
        out.insert(0, replace(longer, parameters=parameters, probes=probes))
    return out


def grid_spacing(grid: tuple[float, ...], at: float) -> float:
    """Distance of a grid point from its farther neighbour."""
    index = grid.index(at)
    return max(abs(grid[i] - at) for i in (index - 1, index + 1) if 0 <= i < len(grid))


def other_grid_point(term: Term, shape: Mapping[str, float]) -> bool:
    """Whether a grid point is another local minimum than the values to which a term was fitted.

    An order has one at every grid point; the time of an event has one in every hold, and the best
    of them may change with the other effects.
    """
    grids = [p for p in term.effect.parameters if p.name in shape and p.grid]
    return any(shape[p.name] != term.values[p.name] for p in grids if p.whole or p.low == 0.0)


def starting_values(item: Score) -> list[dict[str, float]]:
    """Starting values of a candidate: best linear amplitudes within bounds, or its probes."""
    candidate = item.candidate
    coordinates = Coordinates(candidate.effect)
    base = {**candidate.effect.null, **candidate.shape}
    usual = [{**base, **usual_step} for usual_step in candidate.usual_steps]
    if candidate.effect.probes:
        return usual
    null = coordinates.vector(base)
    vector = null + sum(
        amplitude * (coordinates.vector(values) - null)
        for amplitude, values in zip(item.amplitudes, usual, strict=True)
    )
    low, high = coordinates.bounds()
    return [coordinates.values(np.clip(vector, low, high), base)]


_HALVINGS = 7


def starting_points(
    regression: Regression, hypothesis: Hypothesis, present: Fit, item: Score, inverse_sigma: Array
) -> list[dict[str, float]]:
    """Starting values of a candidate, the time of an event found by a line search.

    A step far from the true time has no gradient towards it, but its explained sum of squares rises
    monotonically.

    Parameters
    ----------
    regression
        The data and the model.
    hypothesis
        Model without the candidate.
    present
        Fit of that model.
    item
        Score of the candidate.
    inverse_sigma
        1/σ of every row, shape (n_rows,).
    """
    starts = starting_values(item)
    places = [p for p in Coordinates(item.candidate.effect).shapes if p.grid and p.low == 0.0]
    if not places or len(starts) > 1:
        return starts
    place, values = places[0], starts[0]
    here = regression.change(hypothesis)
    residual, jacobian = present.residual * inverse_sigma, present.jacobian * inverse_sigma[:, None]

    def gain(at: float) -> float:
        term = Term(item.candidate.effect, {**values, place.name: at})
        column = regression.change(hypothesis.with_term(term, regression.n_runs)) - here
        column = column * inverse_sigma
        column = partialled_out(jacobian, column)
        size = float(column @ column)
        return float((column @ residual) ** 2) / size if size else 0.0

    at = item.candidate.shape[place.name]
    step = grid_spacing(place.grid, at)
    best = gain(at)
    for _ in range(_HALVINGS):
        step /= 2
        tried = {gain(x): x for x in (at - step, at + step) if place.low <= x <= place.high}
        if tried and max(tried) > best:
            best = max(tried)
            at = tried[best]
    return [{**values, place.name: at}]

"""Where fits of a candidate begin: at its best point, a moment sought between the grid's points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.hypothesis import Hypothesis
from winchkit.diagnosis.problem import Problem
from winchkit.diagnosis.score import Score
from winchkit.diagnosis.shapes import gap, starting_values
from winchkit.effects.bind import Term
from winchkit.effects.coordinates import Coordinates

__all__ = ["placed"]

Array = NDArray[np.float64]
_HALVINGS = 7


def placed(
    problem: Problem, hypothesis: Hypothesis, present: Fit, item: Score, weight: Array
) -> list[dict[str, float]]:
    """Where fits begin; a moment is first sought between the points of its grid.

    A step far from its moment has no gradient towards it, but its gain rises all the way.
    """
    begun = starting_values(item)
    places = [p for p in Coordinates(item.atom.effect).shapes if p.grid and p.low == 0.0]
    if not places or len(begun) > 1:
        return begun
    place, values = places[0], begun[0]
    here = problem.change(hypothesis)
    residual, jacobian = present.residual * weight, present.jacobian * weight[:, None]

    def gain(at: float) -> float:
        term = Term(item.atom.effect, {**values, place.name: at})
        column = problem.change(hypothesis.with_term(term, problem.runs)) - here
        column = column * weight
        column = column - jacobian @ np.linalg.lstsq(jacobian, column)[0]
        size = float(column @ column)
        return float((column @ residual) ** 2) / size if size else 0.0

    at, step = values[place.name], gap(place.grid, values[place.name])
    best = gain(at)
    for _ in range(_HALVINGS):
        step /= 2
        tried = {gain(x): x for x in (at - step, at + step) if place.low <= x <= place.high}
        if tried and max(tried) > best:
            best = max(tried)
            at = tried[best]
    return [{**values, place.name: at}]

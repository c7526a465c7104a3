"""Starting values of a candidate's fit, and the check of shapes that end at a bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.diagnosis.selection.scores import Score
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term


def shape_at_bound(term: Term) -> bool:
    """Whether a shape parameter is at its bound or the values are physically impossible."""
    effect = term.effect
    if effect.possible is not None and not effect.possible(term.values):
        return True
    coordinates = Coordinates(effect)
    at = coordinates.vector(term.values)
    low, high = coordinates.bounds()
    first = len(coordinates.amplitudes)
    shapes = slice(first, first + len(coordinates.shapes))
    ends = (at <= low + 1e-6) | (at >= high - 1e-6)
    return bool(np.any(ends[shapes]))


def truncated_series(effect: Effect) -> list[Effect]:
    """The effect with the first coefficient of its series, with the first two, and so on: few loads
    leave the third undetermined, which would run to its bound.
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

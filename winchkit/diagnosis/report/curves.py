"""What a residual is drawn over: the variable that it follows most, and its means along that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.follows import Followed, follows, harmonics, variables_of
from winchkit.diagnosis.problem import Problem
from winchkit.diagnosis.report.sentence import CLEAR_ORDER
from winchkit.diagnosis.report.thin import bin_means, filled_edges
from winchkit.model.variables import VARIABLE_UNITS

__all__ = ["Curve", "bin_edges", "curve_of", "strongest"]

Array = NDArray[np.float64]
_BINS = 20
_PER_PERIOD = 8
_WORTH_DRAWING = 0.05
_DIGITS = 5


@dataclass(frozen=True)
class Curve:
    """Mean residual of one output along one variable, SI."""

    over: Followed
    x: Array
    """Mean of the variable in every bin, (bins,); an angle with an order within its turn, rad."""
    mean: Array
    """Measured less predicted, (bins,)."""

    def to_json(self) -> dict[str, Any]:
        """As the commands print it."""
        return {
            "output": self.over.output,
            "variable": self.over.variable,
            "unit": VARIABLE_UNITS.get(self.over.variable, "1"),
            "order": self.over.order,
            "share": self.over.share,
            "x": [float(f"{v:.{_DIGITS}g}") for v in self.x],
            "mean": [float(f"{v:.{_DIGITS}g}") for v in self.mean],
        }


def strongest(problem: Problem, residual: Array) -> dict[str, Followed]:
    """Per output what to draw its residual over: a clear order, else the largest share."""
    orders = [f for f in harmonics(problem, residual) if f.share > CLEAR_ORDER]
    trends = [f for f in follows(problem, residual) if f.share > _WORTH_DRAWING]
    out: dict[str, Followed] = {}
    for found in (*sorted(orders, key=lambda f: -f.share), *sorted(trends, key=lambda f: -f.share)):
        known = out.get(found.output)
        if known is None or (known.order is not None and found.share > 2 * known.share):
            out[found.output] = found
    return out


def curve_of(problem: Problem, residual: Array, over: Followed) -> Curve:
    """The curve of a residual, (rows,), along what it follows."""
    x, error = [], []
    for segment, time in zip(problem.segments, problem.in_time(residual), strict=True):
        if segment.output == over.output:
            recording = problem.dataset.recordings[segment.run]
            good = recording.valid[over.output]
            x.append(variables_of(recording)[over.variable][good])
            error.append(time[good])
    values = np.concatenate(x)
    if over.order is not None:
        values = np.mod(values, 2 * np.pi)
    edges = bin_edges(values, over, 2 * np.pi)
    centres, (mean,) = bin_means(values, [np.concatenate(error)], edges)
    return Curve(over, centres, mean)


def bin_edges(values: Array, over: Followed, turn: float) -> Array:
    """Inner edges of bins: even within a turn, fine enough for the order; else equally filled."""
    if over.order is None:
        return filled_edges(values, _BINS)
    return np.linspace(0, turn, max(_BINS, _PER_PERIOD * over.order) + 1)[1:-1]

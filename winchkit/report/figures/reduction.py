"""Decimation of long signals for drawing: the extremes of every interval are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import (
    Attribution,
    attributions,
    harmonics,
    quantile_edges,
    variables_of,
)
from winchkit.model.variables import ANGLES, VARIABLE_UNITS
from winchkit.report.words.sentence import CLEAR_ORDER
from winchkit.schema.linear_axis import rotary_name

_FEW = 5
"""Distinct values up to which each is a bin of its own, such as loads."""


def decimated(series: Sequence[Array], intervals: int) -> NDArray[np.intp]:
    """Indices (m,) of the samples that a drawing keeps: extremes of each series per interval.

    A missing sample stands for an interval without any value; the first and the last sample are
    kept, and all samples where these are fewer.
    """
    count = len(series[0])
    if count <= 2 * intervals * len(series):
        return np.arange(count)
    edges = np.linspace(0, count, intervals + 1).astype(int)
    kept = [np.array([0, count - 1])]
    for values in series:
        missing = np.isnan(values)
        filled = np.where(missing, np.inf, values), np.where(missing, -np.inf, values)
        for first, last in pairwise(edges):
            kept.append(
                first
                + np.array([np.argmin(filled[0][first:last]), np.argmax(filled[1][first:last])])
            )
    return np.unique(np.concatenate(kept))


def filled_edges(x: Array, bins: int) -> Array:
    """Inner edges of at most ``bins`` equally filled bins; between values where these are few."""
    distinct = np.unique(x)
    if len(distinct) <= _FEW:
        return np.asarray((distinct[1:] + distinct[:-1]) / 2)
    return quantile_edges(x, bins)


def bin_means(x: Array, values: Sequence[Array], edges: Array) -> tuple[Array, list[Array]]:
    """Mean x of every bin that holds samples and, per signal, its mean there; all (n,), finite."""
    index = np.searchsorted(edges, x, side="right")
    count = np.bincount(index)
    used = count > 0
    means = [np.bincount(index, weights=v)[used] / count[used] for v in (x, *values)]
    return means[0], means[1:]


_BINS = 20
"""Bins over a variable: enough to see its shape, with many samples in each."""
_PER_PERIOD = 8
"""Bins per period of a harmonic, so that its amplitude is drawn within 3 %."""
_WORTH_DRAWING = 0.05
"""Share of the variance below which a trend is not seen among the samples."""
_DIGITS = 5
"""Significant digits, more than a pixel resolves."""


@dataclass(frozen=True)
class ResidualCurve:
    """Mean residual of one output along one variable, SI."""

    over: Attribution
    x: Array
    """Mean of the variable in every bin, (bins,); with an order within :func:`period_of`."""
    mean: Array
    """Measured less predicted, (bins,)."""

    def to_json(self) -> dict[str, Any]:
        """The curve as the commands print it."""
        return {
            "output": self.over.output,
            "variable": self.over.variable,
            "unit": VARIABLE_UNITS.get(self.over.variable, "1"),
            "order": self.over.order,
            "share": self.over.share,
            "x": [float(f"{v:.{_DIGITS}g}") for v in self.x],
            "mean": [float(f"{v:.{_DIGITS}g}") for v in self.mean],
        }


def strongest(regression: TimeSeriesRegression, residual: Array) -> dict[str, Attribution]:
    """Main variable of each output's residual: a clear order, else the largest share."""
    orders = [f for f in harmonics(regression, residual) if f.share > CLEAR_ORDER]
    trends = [f for f in attributions(regression, residual) if f.share > _WORTH_DRAWING]
    out: dict[str, Attribution] = {}
    for found in (*sorted(orders, key=lambda f: -f.share), *sorted(trends, key=lambda f: -f.share)):
        known = out.get(found.output)
        if known is None or (known.order is not None and found.share > 2 * known.share):
            out[found.output] = found
    return in_units_of(regression.dataset.profile, out)


def curve_of(regression: TimeSeriesRegression, residual: Array, over: Attribution) -> ResidualCurve:
    """The curve of a residual, (rows,), over a variable."""
    x, error = [], []
    for segment, time in zip(regression.segments, regression.in_time(residual), strict=True):
        if segment.output == rotary_name(over.output):
            recording = regression.dataset.recordings[segment.run]
            good = recording.valid[segment.output]
            x.append(variables_of(recording)[rotary_name(over.variable)][good])
            error.append(time[good])
    values = np.concatenate(x)
    if (period := period_of(over)) is not None:
        values = np.mod(values, period)
    edges = bin_edges(values, over, period)
    centres, (mean,) = bin_means(values, [np.concatenate(error)], edges)
    return ResidualCurve(over, centres, mean)


def period_of(over: Attribution) -> float | None:
    """Range within which a residual with an order is drawn: one turn, rad, or one period, m."""
    if over.order is None:
        return None
    return 2 * np.pi if over.variable in ANGLES else 2 * np.pi / over.order


def bin_edges(values: Array, over: Attribution, period: float | None, bins: int = _BINS) -> Array:
    """Inner edges: equal within a ``period``, fine enough for an order; else equally filled."""
    if over.order is None or period is None:
        return filled_edges(values, bins)
    periods = over.order if over.variable in ANGLES else 1
    return np.linspace(0, period, max(_BINS, _PER_PERIOD * periods) + 1)[1:-1]

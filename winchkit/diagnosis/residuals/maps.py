"""Residual maps: the mean residual over two variables.

One variable shows where an error occurs, two show its law: the error of an elastic cable grows with
load times length, that of a frame with the load alone. The pairs are those in which the effects of
the catalogue differ; an angle is taken modulo one turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import (
    LEAST_TEMPERATURE_RANGE,
    chance_share,
    kept_rows,
    variables_of,
)
from winchkit.model.variables import ANGLES, VARIABLE_UNITS
from winchkit.plain_json import significant

PAIRS = (
    ("cable_length", "load"),
    ("cable_length", "drum_angle"),
    ("cable_length", "temperature"),
    ("speed", "load"),
    ("reversal_distance", "load"),
    ("motor_angle", "load"),
)
"""First and second variable; ``load`` is the tension where no load is known."""
_FIRST_CELLS, _SECOND_CELLS = 16, 10
"""_FIRST_CELLS: Cells of a residual map, first variable; rule of thumb. _SECOND_CELLS: Cells of a
residual map, second variable; rule of thumb."""
_LEAST_SAMPLES = 3
"""Samples of a cell whose mean is shown; rule of thumb."""
_TAILS = 0.002
"""Share of samples beyond the outermost cell edges, each side; rule of thumb."""
_DIGITS = 5
"""Significant digits in JSON; convention."""
_LEAST_CHANGE = {"temperature": LEAST_TEMPERATURE_RANGE}
"""A smaller range is noise of the instrument, K."""


@dataclass(frozen=True)
class ResidualMap:
    """Mean residual of one output over two variables, SI."""

    output: str
    over: tuple[str, str]
    """Both variables; an angle within its turn, a reversal distance as log10 of m."""
    edges: tuple[Array, Array]
    """Edges of the cells, (across + 1,) and (up + 1,); the outermost cells are open."""
    mean: Array
    """Measured less predicted, (across, up); NaN where a cell has fewer than three samples."""
    count: NDArray[np.intp]
    """Samples per cell, (across, up)."""
    share: float
    """Correlation ratio η² of the cells, less its expectation under independence."""

    @property
    def largest(self) -> tuple[int, int]:
        """Cell of the largest absolute mean."""
        across, up = np.unravel_index(int(np.nanargmax(np.abs(self.mean))), self.mean.shape)
        return int(across), int(up)

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the commands print; null for cells with too few samples."""
        return {
            "output": self.output,
            "over": list(self.over),
            "units": [VARIABLE_UNITS.get(name, "1") for name in self.over],
            "edges": [_rounded(edges) for edges in self.edges],
            "mean": [_rounded(row) for row in self.mean],
            "share": self.share,
        }


def residual_maps(regression: TimeSeriesRegression, residual: Array) -> list[ResidualMap]:
    """Maps whose cells explain more of a residual than chance, per output by descending share."""
    known = [variables_of(recording) for recording in regression.dataset.recordings]
    out: list[ResidualMap] = []
    for output in regression.dataset.outputs:
        error, kept = regression.compared_samples(residual, output), kept_rows(regression, output)
        found = [
            drawn
            for pair in PAIRS
            if (places := _places(regression, known, output, pair)) is not None
            and (drawn := _map_of(output, places, error, kept)) is not None
            and drawn.share > chance_share(int(np.isfinite(drawn.mean).sum()), kept)
        ]
        out += sorted(found, key=lambda m: -m.share)
    return out


def same_cells(
    regression: TimeSeriesRegression, residual: Array, like: ResidualMap
) -> ResidualMap | None:
    """Map of another residual of the same problem over the cells of ``like``."""
    known = [variables_of(recording) for recording in regression.dataset.recordings]
    places = _places(regression, known, like.output, like.over)
    error = regression.compared_samples(residual, like.output)
    kept = kept_rows(regression, like.output)
    return None if places is None else _map_of(like.output, places, error, kept)


_Places = tuple[tuple[str, str], tuple[Array, Array]]


def _places(
    regression: TimeSeriesRegression,
    known: list[dict[str, Array]],
    output: str,
    pair: tuple[str, str],
) -> _Places | None:
    """Names and values of a pair at every compared sample; None where a run lacks one."""
    own = [s for s in regression.segments if s.output == output]
    names = [_name(name, known[own[0].run]) for name in pair]
    if any(name not in known[s.run] for s in own for name in names):
        return None
    values = [
        np.concatenate(
            [
                _within_turn(name, known[s.run][name])[
                    regression.dataset.recordings[s.run].valid[output]
                ]
                for s in own
            ]
        )
        for name in names
    ]
    return (names[0], names[1]), (values[0], values[1])


def _name(name: str, known: Mapping[str, Array]) -> str:
    return "tension" if name == "load" and "load" not in known else name


def _within_turn(name: str, values: Array) -> Array:
    return np.mod(values, 2 * np.pi) if name in ANGLES else values


def _map_of(output: str, places: _Places, error: Array, kept: int) -> ResidualMap | None:
    """A map; None where a variable hardly changes or the residual is zero."""
    names, (x, y) = places
    edges = (_edges(names[0], x, _FIRST_CELLS), _edges(names[1], y, _SECOND_CELLS))
    total = float(error @ error)
    still = (np.ptp(e) <= _LEAST_CHANGE.get(n, 0.0) for n, e in zip(names, edges, strict=True))
    if total == 0.0 or any(still):
        return None
    cell = _index(x, edges[0]) * _SECOND_CELLS + _index(y, edges[1])
    count = np.bincount(cell, minlength=_FIRST_CELLS * _SECOND_CELLS)
    sums = np.bincount(cell, weights=error, minlength=_FIRST_CELLS * _SECOND_CELLS)
    used = count >= _LEAST_SAMPLES
    if not used.any():
        return None
    mean = np.full(len(count), np.nan)
    mean[used] = sums[used] / count[used]
    taken = float(np.sum(sums[used] ** 2 / count[used]))
    chance = total * np.count_nonzero(used) / kept
    share = max(0.0, float((taken - chance) / total))
    shape = (_FIRST_CELLS, _SECOND_CELLS)
    return ResidualMap(output, names, edges, mean.reshape(shape), count.reshape(shape), share)


def _edges(name: str, values: Array, cells: int) -> Array:
    """Equal cells over all but the tails, or over one turn of an angle."""
    if name in ANGLES:
        return np.linspace(0.0, 2 * np.pi, cells + 1)
    low, high = np.quantile(values, [_TAILS, 1 - _TAILS])
    return np.linspace(low, high, cells + 1)


def _index(values: Array, edges: Array) -> NDArray[np.intp]:
    return np.searchsorted(edges[1:-1], values, side="right")


def _rounded(values: Array) -> list[float | None]:
    """Numbers to five significant digits, None for NaN."""
    return significant(values.tolist(), _DIGITS)

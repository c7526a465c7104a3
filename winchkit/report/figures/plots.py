"""The curves of a report: residuals before and after, over time and over their main variable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isclose
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import Attribution, variables_of
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.plain_json import significant
from winchkit.report.figures.reduction import (
    bin_edges,
    bin_means,
    decimated,
    decimated_points,
    strongest,
)
from winchkit.report.html.chart import reading
from winchkit.report.words.numbers import Scale, percent, scale_for
from winchkit.report.words.vocabulary import OUTPUT_NAMES, VARIABLE_NAMES

__all__ = ["AT_NOISE", "OutputPlots", "Plot", "Residuals", "plots_of"]

AT_NOISE = 1.15
"""Largest ratio of an error to its noise at which it counts as noise."""
_POINTS = 2000
_DOTS = 600
_DIGITS = 4
_SAME = 1e-3
_SPREAD = 0.2
_DEGREES = 360.0
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Residuals:
    """Residuals to draw, (rows,), and their noise."""

    regression: TimeSeriesRegression
    before: Array
    after: Array | None
    """None where the model was not changed."""
    noise: Mapping[str, float | None]
    """Rms per output, SI; None where it is unknown."""


@dataclass(frozen=True)
class Plot:
    """One drawing: data of the page's script, and a text alternative."""

    id: str
    caption: str
    data: dict[str, Any]
    """Plain lists and texts: ``x``, ``series``, labels, scale, marks."""


@dataclass(frozen=True)
class OutputPlots:
    """The drawings of one output."""

    output: str
    scale: Scale
    over_time: Plot
    over_variable: Plot | None
    followed: Attribution | None
    """Residual over its main variable; None where no measured variable explains it."""


@dataclass(frozen=True)
class _Curves:
    """Residuals of one output, its runs concatenated, in the unit of the figure."""

    output: str
    scale: Scale
    runs: tuple[int, ...]
    before: tuple[Array, ...]
    after: tuple[Array, ...] | None
    noise: float | None
    tone: str
    """Colour of an unchanged residual: ``residual`` at the noise, else ``before``."""


def plots_of(residuals: Residuals) -> tuple[OutputPlots, ...]:
    """Drawings per output; ``after`` only of outputs that the change of the model changed."""
    regression = residuals.regression
    found = strongest(regression, residuals.before)
    out = []
    for output in regression.dataset.outputs:
        curves = _curves(residuals, output)
        followed = found.get(output)
        out.append(
            OutputPlots(
                output,
                curves.scale,
                _over_time(regression, curves),
                _over_variable(regression, curves, followed) if followed else None,
                followed,
            )
        )
    return tuple(out)


def _curves(residuals: Residuals, output: str) -> _Curves:
    regression, noise = residuals.regression, residuals.noise.get(output)
    recordings = regression.dataset.recordings
    own = [i for i, s in enumerate(regression.segments) if s.output == output]

    def in_runs(rows: Array) -> tuple[Array, ...]:
        times = regression.in_time(rows)
        return tuple(
            np.where(recordings[regression.segments[i].run].valid[output], times[i], np.nan)
            for i in own
        )

    before = in_runs(residuals.before)
    after = None if residuals.after is None else in_runs(residuals.after)
    size = _rms(before)
    if after is not None and isclose(_rms(after), size, rel_tol=_SAME):
        after = None
    scale = scale_for(3 * size, OUTPUT_UNITS[output])
    return _Curves(
        output,
        scale,
        tuple(regression.segments[i].run for i in own),
        tuple(part / scale.worth for part in before),
        None if after is None else tuple(part / scale.worth for part in after),
        None if noise is None else noise / scale.worth,
        "residual" if size < AT_NOISE * (noise or 0.0) else "before",
    )


def _rms(parts: Sequence[Array]) -> float:
    """Rms of the compared samples of all runs."""
    return float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2)))


def _over_time(regression: TimeSeriesRegression, curves: _Curves) -> Plot:
    """All runs concatenated, at most ``_POINTS`` samples."""
    recordings = regression.dataset.recordings
    share = max(2, _POINTS // len(curves.runs))
    parts: list[tuple[Array, list[Array]]] = []
    marks, initial_model = [], 0.0
    for position, run in enumerate(curves.runs):
        time = recordings[run].signals.time - recordings[run].signals.time[0]
        marks.append({"at": _number(initial_model), "name": recordings[run].name})
        lines = [curves.before[position]]
        if curves.after is not None:
            lines.append(curves.after[position])
        parts.append(decimated(initial_model + time, lines, share))
        initial_model += float(time[-1]) + recordings[run].bands[curves.output].rate ** -1
    x = np.concatenate([part[0] for part in parts])
    lines = [np.concatenate([part[1][i] for part in parts]) for i in range(len(parts[0][1]))]
    name = OUTPUT_NAMES.get(curves.output, curves.output)
    band = "" if curves.noise is None else "; the grey band is the noise, ± its rms"
    return Plot(
        f"time-{curves.output}",
        f"Measured less predicted {name} over time, all runs concatenated{band}.",
        {
            "kind": "time",
            "x": _numbers(x, 6),
            "xLabel": "time, runs concatenated [s]",
            "yLabel": _labelled("residual", curves.scale.label),
            "unit": curves.scale.label,
            "series": _series(lines, curves.tone),
            "marks": marks,
            "noise": None if curves.noise is None else _number(curves.noise),
        },
    )


def _over_variable(
    regression: TimeSeriesRegression, curves: _Curves, followed: Attribution
) -> Plot:
    """Samples as dots and means over bins as lines."""
    variable, label, logarithmic = _axis(regression, curves, followed)
    before = np.concatenate(curves.before)
    lines = [before] if curves.after is None else [before, np.concatenate(curves.after)]
    good = np.isfinite(before) & np.isfinite(variable)
    x, lines = variable[good], [line[good] for line in lines]
    dots = decimated_points(x, _DOTS)
    centres, means = bin_means(x, lines, bin_edges(x, followed, _DEGREES))
    placed = _spread(x[dots]) if followed.variable == "direction" else x[dots]
    whole = np.concatenate([placed, centres])
    order = np.argsort(whole, kind="stable")
    nothing_here, nothing_there = np.full(len(centres), np.nan), np.full(len(dots), np.nan)
    drawn = [np.concatenate([line[dots], nothing_here])[order] for line in lines]
    binned = [np.concatenate([nothing_there, mean])[order] for mean in means]
    output = OUTPUT_NAMES.get(curves.output, curves.output)
    name = VARIABLE_NAMES.get(followed.variable, followed.variable)
    often = "" if followed.order is None else f", {followed.order} periods per turn"
    return Plot(
        f"over-{curves.output}",
        f"Residual of the {output} over {name}{often}, which explains {percent(followed.share)} "
        "of its variance. Dots are samples, lines their means.",
        {
            "kind": "over",
            "x": _numbers(whole[order], 5),
            "xLabel": label,
            "yLabel": _labelled("residual", curves.scale.label),
            "unit": curves.scale.label,
            "series": _series(drawn, curves.tone),
            "means": _series(binned, curves.tone),
            "log": logarithmic,
            "noise": None if curves.noise is None else _number(curves.noise),
        },
    )


def _spread(values: Array) -> Array:
    """Dots of a variable with few values, spread so that they do not overlap."""
    out = values.copy()
    for value in np.unique(values):
        alike = values == value
        out[alike] += np.linspace(-_SPREAD, _SPREAD, np.count_nonzero(alike))
    return out


def _axis(
    regression: TimeSeriesRegression, curves: _Curves, followed: Attribution
) -> tuple[Array, str, bool]:
    """Values of a variable in the unit of its axis, its label, and whether it is a logarithm."""
    recordings = regression.dataset.recordings
    values = np.concatenate(
        [variables_of(recordings[run])[followed.variable] for run in curves.runs]
    )
    within = followed.order is not None
    how = reading(followed.variable, within_turn=within)
    return how.shown(np.mod(values, _TURN) if within else values), how.label, how.logarithmic


def _series(lines: list[Array], tone: str) -> list[dict[str, Any]]:
    names = ("before", "after") if len(lines) > 1 else ("residual",)
    return [
        {"name": name, "tone": name if len(lines) > 1 else tone, "values": _numbers(line)}
        for name, line in zip(names, lines, strict=True)
    ]


def _labelled(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _numbers(values: Array, digits: int = _DIGITS) -> list[float | None]:
    """Values to a few significant digits; None for NaN."""
    return significant(values.tolist(), digits)


def _number(value: float, digits: int = _DIGITS) -> float:
    return float(f"{value:.{digits}g}")

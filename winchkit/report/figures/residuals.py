"""Figures of a winch's runs: outputs over time, and residuals over their main variable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isclose
from re import compile as pattern

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import Attribution, variables_of
from winchkit.diagnosis.residuals.traces import OutputTrace, traces_of
from winchkit.model.stages import RESULT_UNITS
from winchkit.quantity_text import PrintScale, percent, plain, scale_for
from winchkit.report.figures.axes import reading
from winchkit.report.figures.figure import (
    Figure,
    FigureAxis,
    FigureSeries,
    GridCells,
    Panel,
    RunMark,
)
from winchkit.report.figures.layout import density_levels
from winchkit.report.figures.reduction import bin_edges, bin_means, decimated, period_of, strongest
from winchkit.report.words.sentence import capital, often_per_turn
from winchkit.report.words.vocabulary import output_name, variable_name
from winchkit.schema.linear_axis import rotary_name
from winchkit.units import GRAVITY

_INTERVALS = 300
"""Intervals of a time figure whose extremes are drawn: about two px each."""
_DOTS = 1500
"""Samples up to which each is a dot; more are drawn as a density."""
_CELLS_X, _CELLS_Y = 56, 28
"""Cells of the density map: about 10 px each."""
_TAILS = 0.001
"""Quantile at which the axis of frequencies begins: single low values would fill half of it."""
_EMPTY = 0.1
"""Part of the range of a variable that is a gap of its mean where it holds no sample."""
_SHOWN = 100.0
"""Part of a run from which an interval without compared samples is shaded: about 2 px."""
_SAME = 1e-3
"""Relative: two errors that differ by less are drawn as one."""
_SPREAD = 0.2
"""Of the distance between two places: points of equal value are drawn beside each other."""
_COMMON = pattern(r"^(?:motion[-_ ])?programme[-_ ]")


@dataclass(frozen=True)
class Residuals:
    """Residuals to draw, (rows,), and their noise."""

    regression: TimeSeriesRegression
    before: Array
    after: Array | None
    """None where the model was not changed."""
    noise: Mapping[str, float | None]
    """Rms per output, SI; None where it is unknown."""
    changed: str = "with the effect"
    """Name of the changed model."""
    source: str = ""
    """Profile, runs and version, for the files of the figures."""
    order: tuple[str, ...] = ()
    """Outputs, the worst first."""


@dataclass(frozen=True)
class OutputFigures:
    """The figures of one output."""

    output: str
    scale: PrintScale
    """Of its residual."""
    over_time: Figure
    over_variable: Figure | None
    followed: Attribution | None
    """Residual over its main variable; None where no measured variable explains it."""


@dataclass(frozen=True)
class _Curves:
    """Signals of one output by run, SI; NaN where they are not compared."""

    output: str
    scale: PrintScale
    runs: tuple[int, ...]
    measured: tuple[Array, ...]
    before: tuple[Array, ...]
    after: tuple[Array, ...] | None
    noise: float | None
    changed: str

    @property
    def states(self) -> list[tuple[str, str, tuple[Array, ...]]]:
        """Tone, name and residual of every state of the model."""
        states = [("today", "present model", self.before)]
        return states + ([("with", self.changed, self.after)] if self.after else [])


def residual_figures(residuals: Residuals) -> tuple[OutputFigures, ...]:
    """Figures per output, in the order of ``residuals``."""
    regression = residuals.regression
    found = strongest(regression, residuals.before)
    marks = run_names(regression.dataset)
    out = {}
    for output in regression.dataset.outputs:
        curves = _curves(residuals, output)
        followed = found.get(curves.output)
        over = _over_variable(regression, curves, followed) if followed else None
        time = _over_time(regression, curves, marks)
        out[curves.output] = OutputFigures(
            curves.output,
            curves.scale,
            replace(time, source=residuals.source),
            replace(over, source=residuals.source) if over else None,
            followed,
        )
    ordered = dict.fromkeys((*residuals.order, *out))
    return tuple(out[output] for output in ordered if output in out)


def run_names(dataset: Dataset) -> list[str]:
    """Programme and load of every run, ``fast 10 kg``; its file where both are unknown."""
    texts = []
    for recording in dataset.recordings:
        signals = recording.signals
        mass = signals.load_mass
        if mass is None and signals.load is not None:
            mass = float(np.nanmedian(signals.load)) / GRAVITY
        programme = _COMMON.sub("", recording.programme)
        load = "" if mass is None or not np.isfinite(mass) else f"{plain(mass, 3)} kg"
        texts.append(f"{programme} {load}".strip() or recording.name)
    return texts


def _curves(residuals: Residuals, output: str) -> _Curves:
    regression = residuals.regression
    name = in_units_of(regression.dataset.profile, output)
    noise = residuals.noise.get(name)
    runs = tuple(s.run for s in regression.segments if s.output == output)

    def traces(rows: Array) -> list[OutputTrace]:
        return [trace for trace in traces_of(regression, rows) if trace.output == output]

    today = traces(residuals.before)
    measured = tuple(trace.measured for trace in today)
    before = tuple(trace.residual for trace in today)
    after = None
    if residuals.after is not None:
        after = tuple(trace.residual for trace in traces(residuals.after))
    size = _rms(before)
    if after is not None and isclose(_rms(after), size, rel_tol=_SAME):
        after = None
    scale = scale_for(3 * size, RESULT_UNITS[name])
    return _Curves(name, scale, runs, measured, before, after, noise, residuals.changed)


def _rms(parts: Sequence[Array]) -> float:
    """Rms of the compared samples of all runs."""
    whole = np.concatenate(parts)
    return float(np.sqrt(np.nanmean(whole**2))) if np.isfinite(whole).any() else float("nan")


def _over_time(regression: TimeSeriesRegression, curves: _Curves, labels: Sequence[str]) -> Figure:
    """Measured and predicted over the residual; runs of one programme and load in sequence."""
    recordings = regression.dataset.recordings
    share = max(4, _INTERVALS // len(curves.runs))
    times, kept, marks, start = [], [], [], 0.0
    left_out: list[tuple[float, float]] = []
    label = ""
    first = {labels[run]: position for position, run in reversed(list(enumerate(curves.runs)))}
    order = sorted(range(len(curves.runs)), key=lambda n: first[labels[curves.runs[n]]])
    for position in order:
        run = curves.runs[position]
        time = recordings[run].signals.time - recordings[run].signals.time[0]
        lines = [curves.measured[position], *(parts[position] for _, _, parts in curves.states)]
        rows = decimated(lines, share)
        shown = "" if labels[run] == label else labels[run]
        label = labels[run]
        marks.append(RunMark(start, recordings[run].name, shown))
        gaps = _left_out(time, recordings[run].valid[rotary_name(curves.output)])
        left_out += [(start + low, start + high) for low, high in gaps]
        times.append(start + time[rows])
        kept.append(rows)
        start += float(time[-1]) + recordings[run].bands[rotary_name(curves.output)].rate ** -1

    def joined(parts: Sequence[Array], worth: float) -> Array:
        every = [parts[at][rows] for at, rows in zip(order, kept, strict=True)]
        return np.concatenate(every) / worth

    x = np.concatenate(times)
    measured = joined(curves.measured, 1.0)
    size = scale_for(float(np.nanmax(np.abs(measured), initial=0.0)), RESULT_UNITS[curves.output])
    signals = [FigureSeries("measured", "measured", x, measured / size.worth)]
    errors = []
    for tone, name, parts in curves.states:
        error = joined(parts, 1.0)
        predicted = (measured - error) / size.worth
        signals.append(FigureSeries(f"predicted, {name}", tone, x, predicted, legend=name))
        errors.append(
            FigureSeries(f"residual, {name}", tone, x, error / curves.scale.worth, legend=name)
        )
    if len(errors) == 1:
        signals[1] = replace(signals[1], name="predicted", legend="predicted, residual")
        errors[0] = replace(errors[0], name="residual", legend="predicted, residual")
    name = capital(output_name(curves.output))
    noise = None if curves.noise is None else curves.noise / curves.scale.worth
    filtered = _filtered(regression, curves)
    whole = sum(len(part) for part in curves.before)
    short = (
        f" Drawn are the least and the largest of {whole // len(x) + 1} samples and more; no "
        "extreme is left out."
        if len(x) < whole
        else ""
    )
    band = "" if noise is None else " The band is the noise floor, ± its rms."
    shaded = " Shaded: samples that are not compared." if left_out else ""
    return Figure(
        f"time-{curves.output}",
        f"{name} over time",
        f"Measured and predicted {name.lower()}{filtered}, and below them the residual, measured "
        f"less predicted; all runs in sequence.{band}{shaded}{short}",
        FigureAxis("time", "s", limits=(0.0, start)),
        (
            Panel(
                FigureAxis(f"measured and predicted{filtered}", size.label),
                tuple(signals),
                share=0.9,
            ),
            Panel(
                FigureAxis("residual", curves.scale.label, zero=True),
                tuple(errors),
                noise,
                share=1.1,
            ),
        ),
        tuple(marks),
        tuple(left_out),
        zoom=True,
    )


def _left_out(time: Array, compared: NDArray[np.bool_]) -> Iterator[tuple[float, float]]:
    """Intervals without a compared sample, of a hundredth of the run at least."""
    edges = np.flatnonzero(np.diff(compared, prepend=True, append=True))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        if end - first >= len(time) / _SHOWN:
            yield float(time[first]), float(time[end - 1])


def _filtered(regression: TimeSeriesRegression, curves: _Curves) -> str:
    """``, low-pass 5 Hz`` where the output is filtered before it is compared."""
    bands = regression.dataset.recordings[curves.runs[0]].bands
    cut_off = bands[rotary_name(curves.output)].cut_off
    return "" if cut_off is None else f", low-pass {plain(cut_off, 2)} Hz"


def _over_variable(
    regression: TimeSeriesRegression, curves: _Curves, followed: Attribution
) -> Figure:
    """Samples as dots or as a density, and means over bins as lines."""
    recordings = regression.dataset.recordings
    values = np.concatenate(
        [variables_of(recordings[run])[rotary_name(followed.variable)] for run in curves.runs]
    )
    period = period_of(followed)
    how = reading(followed.variable, within_turn=period is not None)
    variable = how.shown(values if period is None else np.mod(values, period))
    shown = None if period is None else float(how.shown(period))
    states = [
        (tone, name, np.concatenate(parts) / curves.scale.worth)
        for tone, name, parts in curves.states
    ]
    good = np.isfinite(variable) & np.isfinite([values for _, _, values in states]).all(axis=0)
    x, states = variable[good], [(t, n, values[good]) for t, n, values in states]
    centres, means = _means(x, [v for _, _, v in states], bin_edges(x, followed, shown))
    lines = [
        FigureSeries(f"mean, {name}" if len(states) > 1 else "mean", tone, centres, mean, "mean")
        for (tone, name, _), mean in zip(states, means, strict=True)
    ]
    first = states[0][2]
    samples: tuple[FigureSeries, ...] = ()
    cells = None
    name = "residual" if len(states) == 1 else f"residual, {states[0][1]}"
    limits = None if shown is None else (0.0, shown)
    if len(x) <= _DOTS:
        spread = _spread(x) if followed.variable == "direction" else x
        samples = (FigureSeries(name, "today", spread, first, "dots"),)
    else:
        cells, limits = _density(x, first, how.logarithmic, limits)
    noise = None if curves.noise is None else curves.noise / curves.scale.worth
    output = output_name(curves.output)
    over = variable_name(followed.variable)
    over = "time in the run" if followed.variable == "time" else over
    often = ""
    if followed.order is not None:
        often = f", {often_per_turn(followed.variable, followed.order)}"
    drawn = "Dots are samples" if cells is None else "Shading is the number of samples"
    return Figure(
        f"over-{curves.output}",
        f"Residual of the {output} over {over}: {percent(followed.share)} of its variance",
        f"Residual of the {output} over {over}{often}, which explains "
        f"{percent(followed.share)} of its variance. {drawn}, lines are means.",
        how.axis(limits),
        (
            Panel(
                FigureAxis("residual", curves.scale.label, zero=True),
                (*samples, *lines),
                noise,
                cells,
            ),
        ),
    )


def _means(x: Array, values: Sequence[Array], edges: Array) -> tuple[Array, list[Array]]:
    """Means over bins; NaN where a wide range of the variable holds no sample."""
    ordered = np.sort(x)
    wide = np.diff(ordered) > _EMPTY * (ordered[-1] - ordered[0])
    middles = (ordered[:-1] + ordered[1:])[wide] / 2
    centres, means = bin_means(x, values, np.unique(np.concatenate([edges, middles])))
    order = np.argsort(np.concatenate([centres, middles]), kind="stable")
    gaps = np.full(len(middles), np.nan)
    places = np.concatenate([centres, middles])[order]
    return places, [np.concatenate([mean, gaps])[order] for mean in means]


def _density(
    x: Array, y: Array, logarithmic: bool, limits: tuple[float, float] | None
) -> tuple[GridCells, tuple[float, float] | None]:
    """Numbers of samples per cell; every sample is counted, extremes in cells of their own."""
    if logarithmic:
        low, high = np.quantile(x[x > 0], [_TAILS, 1.0])
        x_edges = np.geomspace(low, high * (1 + 1e-9), _CELLS_X + 1)
        x = np.clip(x, low, high)
    else:
        low, high = limits or (float(x.min()), float(x.max()))
        room = 0.5 if high == low else 0.0
        x_edges = np.linspace(low - room, high + room, _CELLS_X + 1)
    low, high = float(y.min()), float(y.max())
    y_edges = np.linspace(low, high if high > low else low + 1.0, _CELLS_Y + 1)
    counts = np.histogram2d(x, y, bins=(x_edges, y_edges))[0]
    levels = density_levels(int(counts.max()))
    shown = np.where(counts > 0, counts, np.nan)
    cells = GridCells("samples per cell", "", x_edges, y_edges, shown, levels)
    return cells, (float(x_edges[0]), float(x_edges[-1])) if limits is None else limits


def _spread(values: Array) -> Array:
    """Dots of a variable with few values, spread so that they do not overlap."""
    out = values.copy()
    for value in np.unique(np.round(values)):
        alike = np.round(values) == value
        out[alike] += np.linspace(-_SPREAD, _SPREAD, np.count_nonzero(alike))
    return out

"""Curves of the Diagnose view: measured, predicted and residual of one output, and reductions.

The server keeps the samples of all runs and sends what a plot of a given width can show; a zoom
asks again for the part that it shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.data.harmonics import half_of_samples_per_turn, strongest_harmonic
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import (
    Attribution,
    binned_share,
    kept_rows,
    variables_of,
)
from winchkit.diagnosis.residuals.traces import traces_of
from winchkit.model.stages import RESULT_UNITS
from winchkit.model.variables import ANGLES
from winchkit.plain_json import significant
from winchkit.quantity_text import PrintScale, scale_for
from winchkit.report.figures.axes import reading
from winchkit.report.figures.reduction import bin_edges, bin_means, decimated, period_of
from winchkit.report.words.sentence import CLEAR_ORDER, capital, often_per_turn
from winchkit.report.words.vocabulary import output_name, variable_name
from winchkit.runs.run import Run

_PANELS = 6
"""Small multiples; the design of the page has six."""
_SAMPLES = 1500
"""Samples of each small multiple: the same ones in all, so that a brush marks them everywhere."""
_BINS = (20, 100)
"""Fewest and most bins: of 20 each has 5 % of the samples; more than 100 are no line in a panel of
300 px."""
_DIGITS = 5
_TIME_DIGITS = 7
"""Significant digits of values, finer than a pixel, and of times: a millisecond of an hour."""

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class OutputCurves:
    """All runs of one output one after another; arrays (n,), SI, NaN where not compared."""

    output: str
    time: Array
    """Time since the start of the first run, without the pauses between runs, s."""
    measured: Array
    predicted: Array
    residual: Array
    """Measured less predicted."""
    starts: tuple[tuple[float, str], ...]
    """Time at which each run starts, and its name."""
    noise: float | None
    """Rms of the noise; None where it is unknown."""
    variables: dict[str, Array]
    shares: dict[str, float]
    """Share of the residual variance that each variable explains (η²), largest first."""
    sizes: tuple[float, float]
    """Largest measured value and rms of the residual, by which the units are chosen."""
    is_compared: bool = True
    """Whether there is a prediction; without one it and the residual are NaN."""

    @property
    def scale(self) -> PrintScale:
        """Unit of the residual."""
        return scale_for(3 * self.sizes[1], RESULT_UNITS[self.output])

    def in_units_of(self, other: OutputCurves) -> OutputCurves:
        """The same curves in the units that suit the larger of the two."""
        largest, rms = map(max, self.sizes, other.sizes)
        return replace(self, sizes=(largest, rms))

    def over_time(self, first: float, last: float, points: int) -> dict[str, Any]:
        """Curves between two times (s), reduced to the extremes of every pixel."""
        part = slice(*np.searchsorted(self.time, [first, last + 1e-9]))
        lines = [self.measured[part], self.predicted[part], self.residual[part] / self.scale.worth]
        drawn = lines if self.is_compared else lines[:1]
        shown = decimated(drawn, max(points, 16) // (2 * len(drawn)))
        x, reduced = self.time[part][shown], [values[shown] for values in lines]
        whole = scale_for(self.sizes[0], RESULT_UNITS[self.output])
        measured, predicted = (values / whole.worth for values in reduced[:2])
        return {
            "output": self.output,
            "name": capital(output_name(self.output)),
            "unit": whole.label,
            "residual_unit": self.scale.label,
            "residual_worth": self.scale.worth,
            "x": significant(x.tolist(), _TIME_DIGITS),
            "measured": significant(measured.tolist(), _DIGITS),
            "predicted": significant(predicted.tolist(), _DIGITS),
            "residual": significant(reduced[2].tolist(), _DIGITS),
            "runs": [{"at": at, "name": name} for at, name in self.starts],
            "noise": self._noise,
            "first": float(self.time[0]),
            "last": float(self.time[-1]),
            "samples": len(self.time),
        }

    def multiples(
        self, order: Attribution | None = None, variables: Sequence[str] = ()
    ) -> dict[str, Any]:
        """Residual over each of some variables, by default those that explain most of it.

        ``order``: an angle with the periods per turn of the residual over it, and their share.
        """
        compared = np.flatnonzero(np.isfinite(self.residual))
        kept = _thinned(compared)
        residual = self.residual / self.scale.worth
        panels = []
        shares, names = dict(self.shares), {name: _capital_name(name) for name in self.shares}
        periods: dict[str, int] = {}
        known = None if order is None else shares.get(order.variable)
        if order is not None and order.order is not None and known is not None:
            shares[order.variable] = max(known, order.share)
            periods[order.variable] = order.order
            names[order.variable] = capital(often_per_turn(order.variable, order.order))
        wanted = [name for name in variables if name in shares]
        for name in (wanted or sorted(shares, key=lambda one: -shares[one]))[:_PANELS]:
            over, (means,) = self._over(name, periods.get(name), [residual], compared, kept)
            panels.append(over | {"name": names[name], "share": shares[name], "means": means})
        return {
            "output": self.output,
            "unit": self.scale.label,
            "noise": self._noise,
            "time": significant(self.time[kept].tolist(), _TIME_DIGITS),
            "residual": significant(residual[kept].tolist(), _DIGITS),
            "panels": panels,
            "variables": [[name, _capital_name(name)] for name in self.shares],
        }

    def main_variable(self, change: Array) -> tuple[str, int | None] | None:
        """Variable that explains most of a change (n,) of the prediction; None below a fifth.

        It is an angle with the periods per turn of a sine over it, or a variable without periods by
        its η² over bins; a part of a turn, over which every trend resembles a sine, is no period.
        """
        known = np.isfinite(self.residual) & np.isfinite(change)
        own = change[known] - np.mean(change[known]) if known.any() else change[known]
        shares: dict[tuple[str, int | None], float] = {}
        for name, values in self.variables.items():
            shares[name, None] = binned_share(values[known], own, len(own))
            if name in ANGLES:
                orders = half_of_samples_per_turn([values[known]])
                found = strongest_harmonic(values[known], own, orders)
                if found is not None:
                    shares[name, found[0]] = found[1]
        best = max(shares, key=lambda key: shares[key], default=None)
        return None if best is None or shares[best] <= CLEAR_ORDER else best

    def signature(self, change: Array, variable: str, order: int | None) -> dict[str, Any]:
        """Residual and the change (n,) by a candidate over a variable, both as means over bins."""
        compared = np.flatnonzero(np.isfinite(self.residual) & np.isfinite(change))
        kept = _thinned(compared)
        lines = [self.residual / self.scale.worth, change / self.scale.worth]
        over, (means, signature) = self._over(variable, order, lines, compared, kept)
        return over | {
            "output": self.output,
            "unit": self.scale.label,
            "noise": self._noise,
            "residual": significant(lines[0][kept].tolist(), _DIGITS),
            "means": means,
            "signature": signature,
        }

    @property
    def _noise(self) -> float | None:
        return None if self.noise is None else self.noise / self.scale.worth

    def _over(
        self,
        variable: str,
        order: int | None,
        lines: Sequence[Array],
        compared: Indices,
        kept: Indices,
    ) -> tuple[dict[str, Any], list[list[float | None]]]:
        """A variable at the kept samples and at the bins, and the means of the lines there."""
        pattern = Attribution(self.output, variable, 0.0, order)
        period, values = period_of(pattern), self.variables[variable]
        values = values if period is None else np.mod(values, period)
        how = reading(variable, within_turn=period is not None)
        edges = bin_edges(values[compared], pattern, period, _bins(len(compared)))
        centres, means = bin_means(values[compared], [line[compared] for line in lines], edges)
        return {
            "variable": variable,
            "label": how.label,
            "logarithmic": how.logarithmic,
            "x": significant(how.shown(values[kept]).tolist(), _DIGITS),
            "bins": significant(how.shown(centres).tolist(), _DIGITS),
        }, [significant(mean.tolist(), _DIGITS) for mean in means]


def curves_of(
    regression: TimeSeriesRegression, residual: Array, noise: dict[str, float | None]
) -> dict[str, OutputCurves]:
    """Curves of every output of a residual (rows,), with the rms of its noise, SI."""
    recordings, profile = regression.dataset.recordings, regression.dataset.profile
    traces = traces_of(regression, residual)
    out: dict[str, OutputCurves] = {}
    for output in regression.dataset.outputs:
        own = [trace for trace in traces if trace.output == output]
        runs = [recordings[part.run] for part in regression.segments if part.output == output]
        known = [variables_of(run) for run in runs]
        starts = _starts([trace.time for trace in own])
        names = [name for name in known[0] if all(name in one for one in known)]
        variables = {name: np.concatenate([one[name] for one in known]) for name in names}
        measured = np.concatenate([trace.measured for trace in own])
        error = np.concatenate([trace.residual for trace in own])
        good, kept = np.isfinite(error), kept_rows(regression, output)
        shares = {name: binned_share(variables[name][good], error[good], kept) for name in names}
        name = in_units_of(profile, output)
        out[name] = OutputCurves(
            name,
            np.concatenate([at + trace.time for at, trace in zip(starts, own, strict=True)]),
            measured,
            np.concatenate([trace.predicted for trace in own]),
            error,
            tuple((at, _label(run)) for at, run in zip(starts, runs, strict=True)),
            noise.get(name),
            in_units_of(profile, variables),
            in_units_of(profile, dict(sorted(shares.items(), key=lambda item: -item[1]))),
            (_largest(measured), float(np.sqrt(np.mean(error[good] ** 2))) if good.any() else 0.0),
        )
    return out


def recorded_curves(runs: Sequence[Run]) -> dict[str, OutputCurves]:
    """Outputs of runs as they were recorded, before they are compared."""
    out: dict[str, OutputCurves] = {}
    for output in RESULT_UNITS:
        own = [run for run in runs if output in run and len(run.time) > 1]
        if not own:
            continue
        since = [run.time - run.time[0] for run in own]
        starts = _starts(since)
        times = [at + time for at, time in zip(starts, since, strict=True)]
        measured = np.concatenate([run[output] for run in own])
        unknown = np.full(len(measured), np.nan)
        out[output] = OutputCurves(
            output,
            np.concatenate(times),
            measured,
            unknown,
            unknown,
            tuple(
                (at, _words(run.metadata.get("programme", ""), run.load_mass, run.name))
                for at, run in zip(starts, own, strict=True)
            ),
            None,
            {},
            {},
            (_largest(measured), 0.0),
            is_compared=False,
        )
    return out


def _starts(times: Sequence[Array]) -> list[float]:
    """Times at which runs start one after another, from their times since their starts, s."""
    lasts = [float(time[-1] + np.median(np.diff(time))) for time in times]
    return [0.0, *np.cumsum(lasts)[:-1].tolist()]


def _label(recording: Recording) -> str:
    return _words(recording.programme, recording.signals.load_mass, recording.name)


def _words(programme: str, mass: float | None, name: str) -> str:
    """Programme and load of a run; its name where neither is known."""
    words = [programme, "" if mass is None else f"{mass:g} kg"]
    return " ".join(word for word in words if word) or name


def _bins(samples: int) -> int:
    """Bins of a variable that is no angle within its turn: the square-root rule, within bounds."""
    return int(np.clip(np.sqrt(samples), *_BINS))


def _thinned(compared: Indices) -> Indices:
    """At most ``_SAMPLES`` of them, evenly distributed."""
    return compared[:: max(1, -(-len(compared) // _SAMPLES))]


def _capital_name(variable: str) -> str:
    return capital(variable_name(variable))


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 0.0

"""Curves of the Diagnose view: measured, predicted and residual of one output, and reductions.

The server keeps the samples of all runs and sends what a plot of a given width can show; a zoom
asks again for the part that it shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import binned_share, kept_rows, variables_of
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.model.variables import ANGLES
from winchkit.plain_json import significant
from winchkit.report.figures.axes import reading
from winchkit.report.figures.reduction import bin_means, decimated, filled_edges
from winchkit.report.words.numbers import Scale, scale_for
from winchkit.report.words.vocabulary import OUTPUT_NAMES, VARIABLE_NAMES

__all__ = ["OutputCurves", "curves_of"]

_PANELS = 6
"""Small multiples; the design of the page has six."""
_SAMPLES = 1500
"""Samples of each small multiple: the same ones in all, so that a brush marks them everywhere."""
_BINS = 32
"""Bins of a mean line: eight per period up to four periods."""
_DIGITS = 5
_TIME_DIGITS = 7
_TURN = 2 * np.pi


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

    @property
    def scale(self) -> Scale:
        """Unit of the residual."""
        size = (
            float(np.sqrt(np.nanmean(self.residual**2)))
            if np.isfinite(self.residual).any()
            else 0.0
        )
        return scale_for(3 * size, OUTPUT_UNITS[self.output])

    def over_time(self, first: float, last: float, points: int) -> dict[str, Any]:
        """A part of the curves, reduced to the extremes of every pixel.

        Parameters
        ----------
        first, last : float
            Part of the time, s.
        points : int
            Largest number of points.

        Returns
        -------
        dict
            ``x``, ``measured``, ``predicted`` in the unit of the output, ``residual`` in that of
            the residual, marks of the runs, and units.
        """
        part = slice(*np.searchsorted(self.time, [first, last + 1e-9]))
        lines = [self.measured[part], self.predicted[part], self.residual[part] / self.scale.worth]
        shown = decimated(lines, max(points, 16) // (2 * len(lines)))
        x, reduced = self.time[part][shown], [values[shown] for values in lines]
        whole = scale_for(_size(self.measured), OUTPUT_UNITS[self.output])
        measured, predicted = (values / whole.worth for values in reduced[:2])
        return {
            "output": self.output,
            "name": _capital(OUTPUT_NAMES.get(self.output, self.output)),
            "unit": whole.label,
            "residual_unit": self.scale.label,
            "x": significant(x.tolist(), _TIME_DIGITS),
            "measured": significant(measured.tolist(), _DIGITS),
            "predicted": significant(predicted.tolist(), _DIGITS),
            "residual": significant(reduced[2].tolist(), _DIGITS),
            "runs": [{"at": at, "name": name} for at, name in self.starts],
            "noise": None if self.noise is None else self.noise / self.scale.worth,
            "first": float(self.time[0]),
            "last": float(self.time[-1]),
            "samples": len(self.time),
        }

    def multiples(self, order: tuple[str, int] | None = None) -> dict[str, Any]:
        """Residual over each of the variables that explain most of it, at the same samples."""
        compared = np.flatnonzero(np.isfinite(self.residual))
        kept = compared[:: max(1, -(-len(compared) // _SAMPLES))]
        residual = self.residual / self.scale.worth
        panels = []
        for name in list(self.shares)[:_PANELS]:
            within = order is not None and order[0] == name
            values = np.mod(self.variables[name], _TURN) if within else self.variables[name]
            how = reading(name, within_turn=within)
            bins = max(_BINS, 8 * order[1]) if within and order is not None else _BINS
            edges = (
                np.linspace(0, _TURN, bins + 1)[1:-1]
                if within
                else filled_edges(values[compared], bins)
            )
            centres, (means,) = bin_means(values[compared], [residual[compared]], edges)
            panels.append(
                {
                    "variable": name,
                    "name": _capital(VARIABLE_NAMES.get(name, name)),
                    "label": how.label,
                    "logarithmic": how.logarithmic,
                    "share": self.shares[name],
                    "x": significant(how.shown(values[kept]).tolist(), _DIGITS),
                    "bins": significant(how.shown(centres).tolist(), _DIGITS),
                    "means": significant(means.tolist(), _DIGITS),
                }
            )
        return {
            "output": self.output,
            "unit": self.scale.label,
            "noise": None if self.noise is None else self.noise / self.scale.worth,
            "time": significant(self.time[kept].tolist(), _TIME_DIGITS),
            "residual": significant(residual[kept].tolist(), _DIGITS),
            "panels": panels,
        }

    def signature(self, change: Array, variable: str, order: int | None) -> dict[str, Any]:
        """Residual and the change by a candidate over a variable, both as means over bins.

        Parameters
        ----------
        change : (n,) array
            What the candidate adds to the prediction, SI.
        variable : str
            Name of the variable.
        order : int or None
            Periods per turn, where the variable is an angle.
        """
        values, within = self.variables[variable], order is not None
        compared = np.flatnonzero(np.isfinite(self.residual) & np.isfinite(change))
        values = np.mod(values, _TURN) if within else values
        how = reading(variable, within_turn=within)
        edges = (
            np.linspace(0, _TURN, max(_BINS, 8 * (order or 1)) + 1)[1:-1]
            if within
            else filled_edges(values[compared], _BINS)
        )
        lines = [self.residual[compared] / self.scale.worth, change[compared] / self.scale.worth]
        centres, means = bin_means(values[compared], lines, edges)
        kept = compared[:: max(1, -(-len(compared) // _SAMPLES))]
        return {
            "output": self.output,
            "unit": self.scale.label,
            "label": how.label,
            "logarithmic": how.logarithmic,
            "noise": None if self.noise is None else self.noise / self.scale.worth,
            "x": significant(how.shown(values[kept]).tolist(), _DIGITS),
            "residual": significant((self.residual[kept] / self.scale.worth).tolist(), _DIGITS),
            "bins": significant(how.shown(centres).tolist(), _DIGITS),
            "means": significant(means[0].tolist(), _DIGITS),
            "signature": significant(means[1].tolist(), _DIGITS),
        }


def curves_of(
    regression: TimeSeriesRegression, residual: Array, noise: dict[str, float | None]
) -> dict[str, OutputCurves]:
    """Curves of every output.

    Parameters
    ----------
    regression : TimeSeriesRegression
        Runs and model.
    residual : (rows,) array
        Measured less predicted.
    noise : dict
        Rms of the noise by output, SI.

    Returns
    -------
    dict
        By output, in the order of the data set.
    """
    recordings = regression.dataset.recordings
    rows = regression.in_time(residual)
    out: dict[str, OutputCurves] = {}
    for output in regression.dataset.outputs:
        times, measured, errors, starts, start = [], [], [], [], 0.0
        known: list[dict[str, Array]] = []
        for segment, own in zip(regression.segments, rows, strict=True):
            if segment.output != output:
                continue
            recording = recordings[segment.run]
            own_time = recording.signals.time - recording.signals.time[0]
            valid = recording.valid[output]
            starts.append((start, _label(recording)))
            times.append(start + own_time)
            measured.append(np.where(valid, recording.measured[output], np.nan))
            errors.append(np.where(valid, own, np.nan))
            known.append(variables_of(recording))
            start = float(times[-1][-1]) + float(np.median(np.diff(own_time)))
        names = [name for name in known[0] if all(name in one for one in known)]
        variables = {name: np.concatenate([one[name] for one in known]) for name in names}
        error = np.concatenate(errors)
        good, kept = np.isfinite(error), kept_rows(regression, output)
        shares = {name: binned_share(variables[name][good], error[good], kept) for name in names}
        value = np.concatenate(measured)
        out[output] = OutputCurves(
            output,
            np.concatenate(times),
            value,
            value - error,
            error,
            tuple(starts),
            noise.get(output),
            variables,
            dict(sorted(shares.items(), key=lambda item: -item[1])),
        )
    return out


def _label(recording: Recording) -> str:
    """Programme and load of a run; its name where neither is known."""
    mass = recording.signals.load_mass
    words = [recording.programme, "" if mass is None else f"{mass:g} kg"]
    return " ".join(word for word in words if word) or recording.name


def is_angle(variable: str) -> bool:
    """Whether a variable is an angle, over which a residual may have an order."""
    return variable in ANGLES


def _size(values: Array) -> float:
    return float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 0.0


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]

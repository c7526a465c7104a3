"""Onset of an effect that acts from a moment on: the score at closely spaced times.

The decrease of χ² by a step at t0 has a maximum as wide as the correlation of the whitened
residual, far narrower than a grid of a few times a run: a fit from the nearest grid point ends in
another maximum. The change by the effect from the first sample on, set to zero before t0, is the
column of every onset t0; the best one becomes a point of the effect's grid.

References
----------
Rao, C. R. (1948). Large sample tests of statistical hypotheses concerning several parameters with
applications to problems of estimation. Proc. Camb. Phil. Soc. 44, 50-57.
Page, E. S. (1957). On problems in which a change in a parameter occurs at an unknown point.
Biometrika 44, 248-252.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import to_frequency, to_time
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.effect import Effect, Parameter
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

_MOST_ONSETS = 1000
"""Bounds the spacing where runs are long."""
_EVERY = 16
"""The length of a column varies little between neighbouring times, except near a run's end."""
_REFINED = 32
"""Largest scores by interpolated lengths whose lengths are computed."""


def onset_of(effect: Effect) -> Parameter | None:
    """The parameter of an effect that is the time from which it acts; None where there is none."""
    return next((p for p in effect.parameters if p.onset), None)


def best_onset(
    regression: TimeSeriesRegression, present: Hypothesis, inverse_sigma: Array, effect: Effect
) -> tuple[float, float] | None:
    """Time from a run's start, s, at which an effect has the largest score, and that score: the
    decrease of χ² with the unknowns of the model free. None where the data cannot show it.
    """
    parameter = onset_of(effect)
    if parameter is None or regression.missing_needs(effect):
        return None
    longest = max(float(at.time[-1]) for at in regression.motions)
    spacing = max(parameter.onset, longest / _MOST_ONSETS)
    times = spacing * np.arange(1.0, _MOST_ONSETS + 1.0)
    times = times[times < longest]
    change = _change(regression, present, effect, parameter)
    residual = regression.residual(present) * inverse_sigma
    known = np.zeros((len(residual), 0))
    if len(vector := regression.vector(present)):
        known = orthonormal(regression.jacobian(vector, present) * inverse_sigma[:, None])
    residual -= known @ (known.T @ residual)

    products = _products(regression, change, times, residual * inverse_sigma)

    def squared_lengths(some: NDArray[np.intp]) -> Array:
        """Of the whitened columns of some times, the unknowns of the model projected out."""
        columns = _columns(regression, change, times[some]) * inverse_sigma[:, None]
        return np.asarray(np.sum(columns**2, axis=0) - np.sum((known.T @ columns) ** 2, axis=0))

    every = np.arange(len(times))
    some = np.union1d(every[::_EVERY], every[-_EVERY:])
    lengths = np.interp(every, some, squared_lengths(some))
    scores = products**2 / np.where(lengths > 0.0, lengths, np.inf)
    largest = np.argsort(scores)[-_REFINED:]
    lengths = squared_lengths(largest)
    scores = products[largest] ** 2 / np.where(lengths > 0.0, lengths, np.inf)
    if not np.any(scores > 0.0):
        return None
    best = int(np.argmax(scores))
    return float(times[largest[best]]), float(scores[best])


def _change(
    regression: TimeSeriesRegression, present: Hypothesis, effect: Effect, parameter: Parameter
) -> list[Array]:
    """Change in time of every segment by a usual step of the effect from the first sample on."""
    (step,) = Coordinates(effect).usual_steps()
    term = Term(effect, {**effect.null, **step, parameter.name: parameter.low})
    whole = regression.change(present.with_term(term, regression.n_runs))
    whole -= regression.change(present)
    return [to_time(whole[segment.rows], segment.band) for segment in regression.segments]


def _products(
    regression: TimeSeriesRegression, change: Sequence[Array], times: Array, weighted: Array
) -> Array:
    """Inner products of every time's column with weighted rows, (n_times,): the sum, from a sample
    on, of the change times the low-passed rows.
    """
    products = np.zeros(len(times))
    for segment, own in zip(regression.segments, change, strict=True):
        band = segment.band
        terms = own * to_time(band.gain * weighted[segment.rows], band)
        from_sample = np.append(np.cumsum(terms[::-1])[::-1], 0.0)
        products += from_sample[np.searchsorted(regression.motions[segment.run].time, times)]
    return products


def _columns(regression: TimeSeriesRegression, change: Sequence[Array], times: Array) -> Array:
    """Change of the prediction by a usual step of the effect from each time on, (n_rows, times)."""
    columns = np.zeros((regression.n_rows, len(times)))
    for segment, own in zip(regression.segments, change, strict=True):
        time = regression.motions[segment.run].time
        columns[segment.rows] = to_frequency(own * (time >= times[:, None]), segment.band).T
    return columns

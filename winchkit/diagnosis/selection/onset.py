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

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import to_frequency, to_time
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.effect import Effect, Parameter
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = ["best_onset", "onset_of"]

_MOST_ONSETS = 1000
"""Bounds memory: 32 MB each 4000 rows of the coarse regression."""


def onset_of(effect: Effect) -> Parameter | None:
    """The parameter of an effect that is the time from which it acts; None where there is none."""
    return next((p for p in effect.parameters if p.onset), None)


def best_onset(
    regression: TimeSeriesRegression, present: Hypothesis, inverse_sigma: Array, effect: Effect
) -> tuple[float, float] | None:
    """Onset of an effect with the largest score, and that score.

    Parameters
    ----------
    regression
        The data and the model, as a rule the coarse one.
    present
        Model beside which the effect is added.
    inverse_sigma
        1/σ of every row, shape (n_rows,).
    effect
        Effect with an onset, see :func:`onset_of`, and one amplitude.

    Returns
    -------
    tuple or None
        Time from a run's start, s, and the decrease of χ² by the effect from then on, the unknowns
        of the model free; None where the data cannot show the effect.
    """
    parameter = onset_of(effect)
    if parameter is None or regression.missing_needs(effect):
        return None
    longest = max(float(at.time[-1]) for at in regression.motions)
    spacing = max(parameter.onset, longest / _MOST_ONSETS)
    times = spacing * np.arange(1.0, _MOST_ONSETS + 1.0)
    times = times[times < longest]
    columns = _columns(regression, present, effect, parameter, times) * inverse_sigma[:, None]
    residual = regression.residual(present) * inverse_sigma
    if len(vector := regression.vector(present)):
        jacobian = regression.jacobian(vector, present)
        known = orthonormal(jacobian * inverse_sigma[:, None])
        columns -= known @ (known.T @ columns)
        residual -= known @ (known.T @ residual)
    lengths = np.sum(columns**2, axis=0)
    scores = (columns.T @ residual) ** 2 / np.where(lengths > 0.0, lengths, np.inf)
    if not np.any(scores > 0.0):
        return None
    best = int(np.argmax(scores))
    return float(times[best]), float(scores[best])


def _columns(
    regression: TimeSeriesRegression,
    present: Hypothesis,
    effect: Effect,
    parameter: Parameter,
    times: Array,
) -> Array:
    """Change of the prediction by a usual step of the effect from each time on, (n_rows, times)."""
    (step,) = Coordinates(effect).usual_steps()
    term = Term(effect, {**effect.null, **step, parameter.name: parameter.low})
    whole = regression.change(present.with_term(term, regression.n_runs))
    whole -= regression.change(present)
    columns = np.zeros((len(whole), len(times)))
    for segment in regression.segments:
        time = regression.motions[segment.run].time
        change = to_time(whole[segment.rows], segment.band)
        columns[segment.rows] = to_frequency(change * (time >= times[:, None]), segment.band).T
    return columns

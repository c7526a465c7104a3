"""Changes of a parameter over the sessions of a winch: a step with its date, or a trend.

An estimate in session i is y = level + change + session effect + error; the error has the variance
s² of the estimate and the session effect the variance τ², which is common to all winches of a
fleet. Steps between any two sessions and a trend are tested together; the date of a step has a
posterior distribution; a step and a trend are compared as separate families of hypotheses.

References
----------
Hawkins, D. M. (1977). Testing a sequence of observations for a shift in location. J. Am. Stat.
Assoc. 72, 180-186.
Smith, A. F. M. (1975). A Bayesian approach to inference about a change-point in a sequence of
random variables. Biometrika 62, 407-416.
Cox, D. R. (1962). Further results on tests of separate families of hypotheses. J. R. Stat. Soc. B
24, 406-424.
von Neumann, J. (1941). Distribution of the ratio of the mean square successive difference to the
variance. Ann. Math. Stat. 12, 367-395.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import stdtr

from winchkit.arrays import Array
from winchkit.fleet.diagnosis.robust_variance import Variance, robust_variance

LEAST_SESSIONS = 4
"""Sessions from which a change is tested."""
_COMPARED = 0.05
"""Level of a change from which a step and a trend are compared; convention; of noise neither kind
is of interest."""
_DRAWS = 400
"""Draws of the bootstrap of step against trend; computing cost: a p-value of 5 % is known to 1
%."""
_SEED = 1962
"""Seed of these draws; convention: the same data give the same result."""


@dataclass(frozen=True)
class ParameterSeries:
    """Estimates of one parameter of one winch, in the order of time."""

    times: Array
    """(n,), s, increasing."""
    values: Array
    """(n,), SI."""
    stds: Array
    """(n,), standard deviations within the session."""


@dataclass(frozen=True)
class StepDate:
    """Posterior distribution of the date of a step."""

    probabilities: Array
    """(n − 1,), of a step between session k and k + 1."""
    date: float
    """Median, s."""
    earliest: float
    """2.5 % quantile, s."""
    latest: float
    """97.5 % quantile, s."""


@dataclass(frozen=True)
class Change:
    """The largest change of a series, whether significant or not; SI."""

    kind: Literal["step", "trend"]
    """The kind with the smaller χ²."""
    rival_p_value: float
    """P-value of the other kind; NaN where the change itself is not significant at 5 %."""
    p_value: float
    """Of no change, Bonferroni over all dates and the trend."""
    size: float
    """Height of the step, or change by the trend from the first session to the last."""
    size_std: float
    slope: float
    """Of the trend, 1/s; zero for a step."""
    slope_std: float
    level: float
    """Fitted value in the last session."""
    level_std: float
    level_before: float
    """Fitted value in the first session."""
    date: StepDate | None
    """Date of a step; None for a trend."""


def session_variance(series: Sequence[ParameterSeries]) -> Variance:
    """Variance τ² of the session effect, from successive differences of all series: a step appears
    in one and a trend in each by a little, so that the robust estimate does not hide changes."""
    differences = [np.diff(s.values) for s in series]
    variances = [s.stds[1:] ** 2 + s.stds[:-1] ** 2 for s in series]
    if not differences:
        return Variance(0.0, 1.0)
    found = robust_variance(np.concatenate(differences), np.concatenate(variances))
    return Variance(found.value / 2, found.dof)


def change_of(series: ParameterSeries, between: Variance) -> Change | None:
    """Largest change of a series; None with fewer than four sessions. Every step and the trend is a
    contrast with z ~ t(ν) under no change, ν the degrees of freedom of τ²; the p-value is n P(abs t
    > max abs z) for n − 1 dates and one trend (Bonferroni), valid whatever the dependence of these
    tests."""
    n = len(series.times)
    if n < LEAST_SESSIONS:
        return None
    sigma = np.sqrt(series.stds**2 + between.value)
    models = [*_steps(n), _ramp(series.times)]
    fits = [_contrast(shape, series.values, sigma) for shape in models]
    z = np.array([abs(fit.size / fit.std) for fit in fits])
    p_value = min(1.0, 2 * n * float(stdtr(between.dof, -z.max())))
    chi = -(z**2)  # χ² less that of a constant, of every model
    step, trend = int(np.argmin(chi[:-1])), n - 1
    is_step = bool(chi[step] <= chi[trend])
    rival = trend if is_step else step
    rival_p = float("nan")
    if p_value < _COMPARED:
        difference = float(chi[trend] - chi[step])
        rival_p = _rival_p_value(models, fits[rival], models[rival], sigma, difference)
    fit = fits[step] if is_step else fits[trend]
    span = float(series.times[-1] - series.times[0])
    last = np.array([1.0, 1.0])
    return Change(
        kind="step" if is_step else "trend",
        rival_p_value=rival_p,
        p_value=p_value,
        size=fit.size,
        size_std=fit.std,
        slope=0.0 if is_step else fit.size / span,
        slope_std=0.0 if is_step else fit.std / span,
        level=fit.start + fit.size,
        level_std=float(np.sqrt(last @ fit.covariance @ last)),
        level_before=fit.start,
        date=step_date(series, between) if is_step else None,
    )


def step_date(series: ParameterSeries, between: Variance) -> StepDate:
    """Posterior of the date of a step whose level and height are unknown. With flat priors the
    probability of the interval between two sessions is proportional to its length times
    det(XᵀWX)^(−1/2) exp(−χ²/2), with χ² of the best step there (Smith 1975)."""
    sigma = np.sqrt(series.stds**2 + between.value)
    logs = []
    for shape, length in zip(_steps(len(sigma)), np.diff(series.times), strict=True):
        fit = _contrast(shape, series.values, sigma)
        logs.append(
            np.log(length)
            + 0.5 * (fit.size / fit.std) ** 2
            + 0.5 * np.linalg.slogdet(fit.covariance)[1]
        )
    weight = np.exp(np.array(logs) - max(logs))
    probabilities = weight / weight.sum()
    cumulative = np.concatenate([[0.0], np.cumsum(probabilities)])
    earliest, date, latest = np.interp((0.025, 0.5, 0.975), cumulative, series.times)
    return StepDate(probabilities, float(date), float(earliest), float(latest))


@dataclass(frozen=True)
class _Contrast:
    """Weighted regression on a constant and one shape."""

    start: float
    size: float
    std: float
    covariance: Array


def _steps(n: int) -> list[Array]:
    return [(np.arange(n) >= k).astype(float) for k in range(1, n)]


def _ramp(times: Array) -> Array:
    """Line from zero at the first session to one at the last."""
    return np.asarray((times - times[0]) / (times[-1] - times[0]))


def _contrast(shape: Array, values: Array, sigma: Array) -> _Contrast:
    design = np.column_stack([np.ones_like(shape), shape]) / sigma[:, None]
    covariance = np.asarray(np.linalg.inv(design.T @ design), dtype=np.float64)
    start, size = covariance @ (design.T @ (values / sigma))
    return _Contrast(float(start), float(size), float(np.sqrt(covariance[1, 1])), covariance)


def _rival_p_value(
    models: Sequence[Array], fit: _Contrast, shape: Array, sigma: Array, difference: float
) -> float:
    """Parametric bootstrap of χ²(trend) − χ²(best step) under one of the two kinds (Cox 1962)."""
    random = np.random.default_rng(_SEED)
    noise = random.normal(size=(_DRAWS, len(sigma)))
    drawn = (fit.start + fit.size * shape) / sigma + noise
    level = 1 / sigma / np.linalg.norm(1 / sigma)
    explained = []
    for each in models:
        column = each / sigma - level * (level @ (each / sigma))
        explained.append((drawn @ column) ** 2 / (column @ column))
    differences = np.max(explained[:-1], axis=0) - explained[-1]
    as_far = differences >= difference if difference >= 0 else differences <= difference
    return float((1 + np.count_nonzero(as_far)) / (1 + _DRAWS))

"""Parameters of one set of effects, fitted to the runs of one winch and one session.

The set of effects is chosen once for a fleet, so that the first member of an equivalence set cannot
alternate between sessions. Estimates are given in the coordinates in which a
fit is linear: an amplitude, the reciprocal of a stiffness, the cosine and sine part of an amplitude
with a phase, the logarithm of a shape parameter. There they are normally distributed also near
zero, which estimates over time and over winches require.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import cos, log, sin

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.compare import initial_hypothesis
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import whitened_jacobian
from winchkit.diagnosis.regression.projection import inverse_normal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.effect import Effect, Parameter
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

_STEP = 1e-3
"""Step of a difference of values by a fit's coordinate; numerical."""


@dataclass(frozen=True)
class SessionEstimate:
    """Estimate of one parameter of one winch in one session, SI."""

    winch: str
    time: float
    """Start of the session, s since 1970 (UTC)."""
    effect: str
    parameter: str
    value: float
    std: float
    """Standard deviation by the noise within the session; NaN where the runs leave it open."""
    unit: str
    covariance: tuple[float, ...] = ()
    """With all parameters of the same fit, in their order; empty for a fit of one parameter."""
    rms_per_unit: Mapping[str, float] = field(default_factory=dict)
    """Rms change of every output over the runs of the session, per unit of the parameter."""


def null_term(effect: Effect) -> Term:
    """An effect without influence: amplitudes at their null, shapes at their typical value."""
    shapes = {p.name: p.typical for p in effect.parameters if p.role == "shape"}
    return Term(effect, {**effect.null, **shapes})


def fit_session(
    runs: Sequence[Run],
    profile: WinchProfile,
    terms: Sequence[Term],
    *,
    winch: str,
    time: float,
    catalogue: Catalogue | None = None,
) -> tuple[SessionEstimate, ...]:
    """Fit a given set of effects, and those of the profile at its values, to the runs of one
    session, ``time`` s since 1970 (UTC). Raises RunError with every fault of every run.

    The standard deviation is that of the noise within the session. Errors of the model that recur
    in every session do not vary over time and are left out; what varies besides the noise is
    estimated from the sessions (:mod:`winchkit.fleet.diagnosis.changes`). Of an effect of the
    profile the result is the whole value, not its difference from the profile.
    """
    catalogue = catalogue or load_catalogue()
    dataset = prepare(runs, profile, None, decimate=True, fast=True, catalogue=catalogue)
    regression = TimeSeriesRegression(dataset)
    start = initial_hypothesis(profile, catalogue, regression)
    declared = {term.label: index for index, term in enumerate(start.terms)}
    places = []
    for term in terms:
        places.append(declared.get(term.label, len(start.terms)))
        if term.label not in declared:
            start = start.with_term(term, regression.n_runs)
    engine = TimeSeriesSelection(regression, start, [term.effect for term in terms])
    fitted, noise = engine.fit_with_noise(start)
    covariance = inverse_normal(whitened_jacobian(regression, fitted, noise))
    every = _parts(regression, fitted)
    parts = [every[place] for place in places]
    columns = [at for part, _ in parts for at in range(part.start, part.stop)]
    linear = [each for part, term in parts for each in _linear(term, fitted.vector[part])]
    slopes = np.array([each.slope for each in linear])
    matrix = covariance[np.ix_(columns, columns)] * np.outer(slopes, slopes)
    return tuple(
        SessionEstimate(
            winch,
            time,
            each.effect,
            each.name,
            each.value,
            float(np.sqrt(row[index])) if row[index] > 0.0 else float("nan"),
            each.unit,
            tuple(row.tolist()) if len(linear) > 1 else (),
            _rms(regression, fitted.jacobian[:, columns[index]] / each.slope),
        )
        for index, (each, row) in enumerate(zip(linear, matrix, strict=True))
    )


@dataclass(frozen=True)
class _Linear:
    """A parameter in the coordinate in which the fit is linear."""

    effect: str
    name: str
    unit: str
    value: float
    slope: float
    """Derivative of the value by the coordinate."""


def _linear(term: Term, vector: Array) -> Iterator[_Linear]:
    coordinates = Coordinates(term.effect)
    for index, name in enumerate(coordinates.names):
        label, unit, of = _transform(term.effect, term.effect.parameter(name))
        moved = vector.copy()
        moved[index] += _STEP
        value, beside = (of(coordinates.values(x, term.values)) for x in (vector, moved))
        yield _Linear(term.label, label, unit, value, (beside - value) / _STEP)


def _transform(
    effect: Effect, parameter: Parameter
) -> tuple[str, str, Callable[[Mapping[str, float]], float]]:
    """Name, unit and function of an effect's values, of one coordinate."""
    name = parameter.name
    for size, phase in effect.polar_pairs:
        if name in (size, phase):
            part = cos if name == size else sin
            label = f"{size} {part.__name__} {phase}"
            return label, effect.parameter(size).unit, partial(_polar_part, size, phase, part)
    if parameter.role == "shape" and parameter.low > 0:
        return f"ln {name}", "1", lambda values: log(values[name])
    if parameter.reciprocal:
        return f"1/{name}", f"1/{parameter.unit}", lambda values: 1 / values[name]
    return name, parameter.unit, lambda values: values[name]


def _polar_part(
    size: str, phase: str, part: Callable[[float], float], values: Mapping[str, float]
) -> float:
    return values[size] * part(values[phase])


def _parts(regression: TimeSeriesRegression, fitted: Fit) -> list[tuple[slice, Term]]:
    """Coordinates of every term in the vector of unknowns."""
    at, out = regression.nuisance_columns.shape[1], []
    for term in fitted.hypothesis.terms:
        count = len(Coordinates(term.effect))
        out.append((slice(at, at + count), term))
        at += count
    return out


def _rms(regression: TimeSeriesRegression, column: Array) -> dict[str, float]:
    """Rms over the samples of every output."""
    squares: dict[str, list[Array]] = {}
    for segment, samples in zip(regression.segments, regression.in_time(column), strict=True):
        squares.setdefault(segment.output, []).append(samples**2)
    return {o: float(np.sqrt(np.mean(np.concatenate(s)))) for o, s in squares.items()}

"""Covariance of fitted values, the condition number of a fit, collinearity of an effect.

References
----------
Belsley, D. A., Kuh, E., Welsch, R. E. (1980). Regression Diagnostics. Wiley, ch. 3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import whitened_jacobian
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

_STEP = 1e-4
"""Step of a difference of values by a fit's coordinate; numerical."""


@dataclass(frozen=True)
class ValueCovariance:
    """Covariance of the values of a linearised fit, SI."""

    names: tuple[str, ...]
    """``effect.parameter`` of every fitted value, after the nuisance parameters."""
    matrix: Array
    """Covariance, without the initial states, which are free, (n_values, n_values)."""
    condition: float
    """Condition number of the whitened derivatives with columns of unit length."""


COLLINEAR_DELAY = 10.0
"""Variance inflation of a delay (0.32 of its change is its own) above which it is not certain, and
not added last: where the motion has one speed or one frequency, friction and the phase of a ripple
imitate it."""


CANCELLED = 5.0
"""Range of an effect's change over that by all effects together from which most of it is cancelled;
a gain and a share of the torque that imitated a five-cornered drum had 5.4."""
_ENDS = 0.01, 0.99
"""Quantiles that are a range: single samples are none."""


def value_covariance(regression: Regression, fit: Fit, noise: BandNoise) -> ValueCovariance:
    """Covariance of the nuisance parameters and values of a fit."""
    whitened = whitened_jacobian(regression, fit, noise)
    length = np.sqrt(np.sum(whitened**2, axis=0))
    there = np.flatnonzero(length > 0.0)
    scaled = whitened[:, there] / length[there]
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    floor = 1e-12 * float(values[-1]) if len(values) else 0.0
    inverse = (vectors / np.maximum(values, floor)) @ vectors.T
    covariance = np.zeros((len(length), len(length)))
    covariance[np.ix_(there, there)] = inverse / np.outer(length[there], length[there])
    names, slopes = _slopes(regression, fit)
    condition = np.sqrt(values[-1] / max(float(values[0]), floor)) if len(values) else np.nan
    return ValueCovariance(names, slopes @ covariance @ slopes.T, float(condition))


def collinearity(regression: Regression, fit: Fit, noise: BandNoise, index: int) -> float:
    """Squared length of an effect's change over that of the part which the others cannot imitate:
    its variance inflation factor, 1 where it is orthogonal to the others' derivatives."""
    change = change_by(regression, fit, index) * noise.inverse_sigma(regression)
    others = ~regression.unknowns_of(index, fit.hypothesis)
    basis = orthonormal(whitened_jacobian(regression, fit, noise)[:, others])
    left = change - basis @ (basis.T @ change)
    size = float(left @ left)
    return float(change @ change) / size if size else float("inf")


def _slopes(regression: Regression, fit: Fit) -> tuple[tuple[str, ...], Array]:
    """Names of all values, and their derivatives by the vector of unknowns."""
    names = list(regression.nuisance_names)
    count = len(names)
    rows = [np.eye(len(fit.vector))[index] for index in range(count)]
    at = count
    for term in fit.hypothesis.terms:
        coordinates = Coordinates(term.effect)
        part = slice(at, at + len(coordinates))
        at += len(coordinates)
        for name, slope in _derivatives(coordinates, term, fit.vector[part]):
            row = np.zeros(len(fit.vector))
            row[part] = slope
            names.append(f"{term.label}.{name}")
            rows.append(row)
    return tuple(names), np.array(rows).reshape(len(rows), len(fit.vector))


def _derivatives(
    coordinates: Coordinates, term: Term, vector: Array
) -> Iterator[tuple[str, Array]]:
    """Derivatives of an effect's values by its coordinates, the larger of both sides."""
    here = coordinates.values(vector, term.values)
    sides = []
    for step in (_STEP, -_STEP):
        moved = [
            coordinates.values(vector + step * unit, term.values) for unit in np.eye(len(vector))
        ]
        sides.append([{n: (m[n] - here[n]) / step for n in coordinates.names} for m in moved])
    for name in coordinates.names:
        pairs = [(up[name], down[name]) for up, down in zip(*sides, strict=True)]
        yield name, np.array([max(pair, key=abs) for pair in pairs])


def change_by(regression: Regression, fit: Fit, index: int) -> Array:
    """Change of the prediction by one effect of a fit, (n_rows,)."""
    hypothesis = fit.hypothesis
    return regression.change(hypothesis) - regression.change(hypothesis.without(index))


def ranges_of_changes(
    regression: TimeSeriesRegression, fit: Fit, index: int
) -> dict[str, tuple[float, float]]:
    """Range of the change of each output by one effect, and by all effects together, SI."""
    together = regression.change(fit.hypothesis)
    own = together - regression.change(fit.hypothesis.without(index))
    return {
        output: (
            value_range(regression.compared_samples(own, output)),
            value_range(regression.compared_samples(together, output)),
        )
        for output in regression.outputs
    }


def value_range(values: Array) -> float:
    """Range of values but for single ones, in their unit."""
    low, high = np.quantile(values, _ENDS)
    return float(high - low)

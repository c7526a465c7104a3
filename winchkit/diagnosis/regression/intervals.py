"""95 % intervals of fitted values: profile likelihood, widened for correlated and model errors.

The profile-likelihood interval assumes that model and noise variance are right. It is widened

- to the interval of the block jackknife, where blocks of time vary by more than the noise;
- by a variance between parts of the data (outputs, groups of runs), as in a meta-analysis;
- by the discretisation error.

The covariance of independent residuals is not used: residuals are correlated. The intervals are not
conditional on the selection of the model.

References
----------
Venzon, D. J., Moolgavkar, S. H. (1988). A method for computing profile-likelihood-based confidence
intervals. Appl. Stat. 37, 87-94.
Künsch, H. R. (1989). The jackknife and the bootstrap for general stationary observations. Ann.
Stat. 17, 1217-1241.
DerSimonian, R., Laird, N. (1986). Meta-analysis in clinical trials. Control. Clin. Trials 7,
177-188.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Folds, Regression
from winchkit.diagnosis.regression.cross_validation import left_out_steps
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import BandNoise, satterthwaite_dof
from winchkit.diagnosis.regression.projection import inverse_normal
from winchkit.diagnosis.results import Estimate
from winchkit.effects.effect import Parameter
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

HALF_WIDTH = 1.959964
"""Standard deviations from a value to the end of its 95 % interval."""
_MANY_PARTS = 3.0
"""Effective number of parts from which a variance between parts is estimated."""
_NO_INFORMATION = 1e-9
"""Share of the information on an unknown below which a part says nothing of it."""
_UNDETERMINED = 1e6
"""In units of the usual size: an unknown whose standard deviation is larger, and larger than its
value, is undetermined. On a heavy, slow axis a well determined mass has that size."""
_LINEAR = 0.15
"""Relative error of Δχ² at which the search for an interval's end stops."""
_SEARCHES = 4
"""Steps of that search."""
_MOST_STRETCHED = 4.0
"""Largest length of an interval's arm, in that of the linear one."""


def profile_ends(
    regression: Regression,
    fit: Fit,
    inverse_sigma: Array,
    covariance: Array,
    reach: Array,
    *,
    term: int | None = None,
) -> tuple[Array, Array]:
    """Ends of profile-likelihood intervals of the unknowns of one term, or of all effects.

    The other unknowns have the ends of the linearised fit with the ``covariance``. ``reach`` is the
    square root of the rise of χ² at the ends, (n_unknowns,).
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    low, high = fit.vector - reach * deviation, fit.vector + reach * deviation
    bounds = regression.bounds(fit.hypothesis)
    first = regression.nuisance_columns.shape[1]
    states = sum(len(start) for start in fit.hypothesis.starts)
    every = np.ones(len(fit.vector), dtype=bool)
    own = every if term is None else regression.unknowns_of(term, fit.hypothesis)
    for index in range(first, len(fit.vector) - states):
        if deviation[index] > 0.0 and own[index]:
            profile = _Profile(regression, fit, inverse_sigma, covariance, index)
            low[index] = fit.vector[index] - profile.length(-1.0, reach[index])
            high[index] = fit.vector[index] + profile.length(1.0, reach[index])
    return np.clip(low, *bounds), np.clip(high, *bounds)


class _Profile:
    """Profile of χ² along one unknown, the others refitted by one linear step."""

    def __init__(
        self, regression: Regression, fit: Fit, inverse_sigma: Array, covariance: Array, index: int
    ) -> None:
        self._regression, self._fit, self._inverse_sigma, self._index = (
            regression,
            fit,
            inverse_sigma,
            index,
        )
        self._deviation = float(np.sqrt(covariance[index, index]))
        self._along = covariance[:, index] / covariance[index, index]
        others = np.arange(len(covariance)) != index
        whitened = fit.jacobian[:, others] * inverse_sigma[:, None]
        self._others, self._whitened, self._normal = others, whitened, inverse_normal(whitened)
        self._bounds = regression.bounds(fit.hypothesis)

    def length(self, side: float, reach: float) -> float:
        """Distance from the fit at which χ² has risen by ``reach``²."""
        linear_distance = reach * self._deviation
        target, distance = reach**2, linear_distance
        for _ in range(_SEARCHES):
            rise = self._rise(side * distance, target)
            if abs(rise / target - 1) < _LINEAR:
                break
            # χ² rises approximately with the square of the distance.
            distance *= float(np.clip(np.sqrt(target / max(rise, 1e-9)), 0.3, 2.0))
            if distance > _MOST_STRETCHED * linear_distance:
                return _MOST_STRETCHED * linear_distance
        return distance

    def _rise(self, displacement: float, target: float) -> float:
        """Rise of χ², the other unknowns corrected once where it exceeds the target."""
        low, high = self._bounds
        vector = np.clip(self._fit.vector + displacement * self._along, low, high)
        residual = self._residual(vector)
        rise = float(residual @ residual) - self._fit.chi_square
        if rise < (1 + _LINEAR) * target:
            return rise
        step = np.zeros_like(vector)
        step[self._others] = self._normal @ (self._whitened.T @ residual)
        corrected = self._residual(np.clip(vector + step, low, high))
        return min(rise, float(corrected @ corrected) - self._fit.chi_square)

    def _residual(self, vector: Array) -> Array:
        like = self._fit.hypothesis
        return (
            self._regression.residual(self._regression.hypothesis(vector, like))
            * self._inverse_sigma
        )


@dataclass(frozen=True)
class Spread:
    """Uncertainty of every unknown of a fit, in the coordinates of the fit; (n_unknowns,) each."""

    std: Array
    """Standard deviation."""
    low: Array
    """Lower end of the 95 % interval."""
    high: Array
    """Upper end of the 95 % interval."""
    covariance: Array
    """Covariance of the linearised fit by the likelihood alone, (n_unknowns, n_unknowns)."""


def whitened_jacobian(regression: Regression, fit: Fit, noise: BandNoise) -> Array:
    """Jacobian of a fit, (n_rows, n_unknowns), over the standard deviations of the noise."""
    return np.asarray(fit.jacobian * noise.inverse_sigma(regression)[:, None])


def spread_of(
    regression: Regression, fit: Fit, noise: BandNoise, blocks: Folds, term: int | None = None
) -> Spread:
    """Standard deviations and 95 % intervals of every unknown, which follow the profile of χ² for
    one term, or by default for all effects."""
    inverse_sigma = noise.inverse_sigma(regression)
    whitened = whitened_jacobian(regression, fit, noise)
    covariance_by_likelihood = inverse_normal(whitened)
    covariance = covariance_by_likelihood.copy()
    likelihood = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    statistical = np.maximum(likelihood, _jackknife(regression, fit, noise, blocks))
    unknown = statistical > np.maximum(_UNDETERMINED, np.abs(fit.vector))
    unknown |= ~np.any(whitened, axis=0)
    covariance[unknown] = covariance[:, unknown] = likelihood[unknown] = 0.0
    statistical[unknown] = _UNDETERMINED
    shift_by_discretization = covariance @ (
        whitened.T @ (regression.discretization_error(fit.hypothesis) * inverse_sigma)
    )
    own = statistical**2
    kinds = [
        between_parts(*_by_part(whitened, fit.residual * inverse_sigma, covariance, parts), own)
        for parts in _kinds_of_parts(regression)
    ]
    between = sum((kind.variance for kind in kinds), np.zeros_like(own))
    variance = own + shift_by_discretization**2 + between
    stretch = stdtrit(effective_dof(variance, kinds), 0.975) / HALF_WIDTH
    wider = np.divide(
        statistical, likelihood, out=np.ones_like(statistical), where=likelihood > 0.0
    )
    low, high = profile_ends(
        regression, fit, inverse_sigma, covariance, HALF_WIDTH * wider, term=term
    )
    below, above = (
        np.where(unknown, _UNDETERMINED, way) for way in (fit.vector - low, high - fit.vector)
    )
    systematic = HALF_WIDTH * np.sqrt(variance - own)
    return Spread(
        np.sqrt(variance),
        fit.vector - stretch * np.hypot(below, systematic),
        fit.vector + stretch * np.hypot(above, systematic),
        covariance_by_likelihood,
    )


def _jackknife(regression: Regression, fit: Fit, noise: BandNoise, blocks: Folds) -> Array:
    """Standard deviation of every unknown by the delete-a-block jackknife."""
    steps = left_out_steps(regression, fit, noise, blocks)
    n = blocks.count
    return np.asarray(np.sqrt((n - 1) / n * np.sum((steps - steps.mean(axis=0)) ** 2, axis=0)))


@dataclass(frozen=True)
class BetweenParts:
    """Variance of the common values by differences between parts of the data, (n_unknowns,)."""

    variance: Array
    """Added variance; zero where parts agree within their uncertainties."""
    uncertain: Array
    """Part of the whole variance that was estimated from the parts."""
    dof: Array
    """Degrees of freedom of that part: parts less one where their weights are equal."""


def between_parts(shifts: Array, weights: Array, within: Array) -> BetweenParts:
    """Variance of common values by a random effect of every part.

    ``shifts`` (n_parts, n_unknowns) are w (θ̂ − θ̂ of the part), ``weights`` the shares w of each
    part in the information on each unknown. The estimate of a part has the variance v/w + τ², v
    being ``within``. Cochran's Q = Σ u²/(w v) of the shifts u gives τ² = v (Q − (G − 1))/(1 − Σw²),
    at least zero (DerSimonian and Laird). The common value is the fit's, with the weights w, so
    that τ² Σw² is added to its variance; that of the mean with the weights 1/(v/w + τ²) would not
    be larger. Where Q exceeds G − 1, intervals have quantiles of t. Its degrees of freedom are
    those of Q at the estimated τ² (Satterthwaite), G − 1 for equal weights (Hartung and Knapp) and
    fewer where few parts have most of the weight. One part with most of it makes the divisor small:
    with fewer than three effective parts, 1/Σw², the variance is multiplied by Q/(G − 1) instead
    (Birge), which is the same for equal weights. With two parts t(1) would make every third
    interval seven times as long although the parts agree: there only the excess Q - 1 counts as
    uncertain.

    References
    ----------
    DerSimonian, R., Laird, N. (1986). Controlled Clinical Trials 7, 177-188.
    Hartung, J., Knapp, G. (2001). Statistics in Medicine 20, 1771-1782.
    Birge, R. T. (1932). Phys. Rev. 40, 207-227.
    Satterthwaite, F. E. (1946). Biometrics Bulletin 2, 110-114.
    """
    informative = weights > _NO_INFORMATION
    dof = np.maximum(np.sum(informative, axis=0) - 1.0, 1.0)
    scaled = np.where(informative, weights, 1.0) * np.maximum(within, 1e-300)
    q = np.sum(np.where(informative, shifts**2 / scaled, 0.0), axis=0)
    concentration = np.sum(weights**2, axis=0)
    differ = (q > dof) & (np.sum(informative, axis=0) > 1)
    several = np.maximum(1.0 - concentration, 1e-9)
    many = concentration * _MANY_PARTS < 1.0 + 1e-9
    share = np.where(many, concentration / several, 1.0 / dof)
    variance = np.where(differ, within * share * (q - dof), 0.0)
    uncertain = np.where((dof > 1.0) & differ, within * share * q, variance)
    return BetweenParts(variance, uncertain, _dof_of_q(weights, informative, (q - dof) / several))


def _dof_of_q(weights: Array, informative: NDArray[np.bool_], excess: Array) -> Array:
    """Satterthwaite's degrees of freedom of Cochran's Q where τ²/v is ``excess``, (n_unknowns,).

    With D = diag(1/w + τ²/v) and A = diag(w) - w wᵀ they are (tr AD)²/tr (AD)².
    """
    w, there = np.where(informative, weights, 0.0), informative.astype(float)
    e = there * (1.0 + np.maximum(excess, 0.0) * w)
    trace = np.sum((there - w) * e, axis=0)
    square = np.sum(((there - w) * e) ** 2, axis=0)
    square += np.sum(w * e, axis=0) ** 2 - np.sum((w * e) ** 2, axis=0)
    return np.asarray(np.maximum(trace**2 / np.maximum(square, 1e-300), 1.0))


def effective_dof(variance: Array, kinds: Sequence[BetweenParts]) -> Array:
    """Degrees of freedom of variances (n_unknowns,) that are partly estimated (Satterthwaite)."""
    shape = len(kinds), len(variance)
    parts = np.reshape([kind.uncertain for kind in kinds], shape)
    dof = np.reshape([kind.dof for kind in kinds], shape)
    return np.clip(satterthwaite_dof(parts, dof, variance), 1.0, 1e9)


def _by_part(
    whitened: Array, residual: Array, covariance: Array, parts: Sequence[NDArray[np.intp]]
) -> tuple[Array, Array]:
    """Shift of every unknown by each part, and the part's share in the information on it.

    A part with the normal matrix N and the gradient g shifts the unknowns by C g, where C is the
    covariance of the fit; its weight is (C N C)/C, on the diagonal.
    """
    variance = np.maximum(np.diag(covariance), 1e-300)
    shifts, weights = np.zeros((2, len(parts), len(covariance)))
    for index, rows in enumerate(parts):
        own = whitened[rows]
        shifts[index] = covariance @ (own.T @ residual[rows])
        weights[index] = np.sum((own @ covariance) ** 2, axis=0) / variance
    return shifts, weights


def _kinds_of_parts(regression: Regression) -> Iterator[list[NDArray[np.intp]]]:
    """Rows of every output, and of every group of programme and load, where there are several."""
    by_output = [s.output for s in regression.segments]
    by_group = [str(regression.group_of_run[s.run]) for s in regression.segments]
    for keys in (by_output, by_group):
        rows: dict[str, list[NDArray[np.intp]]] = {}
        for segment, key in zip(regression.segments, keys, strict=True):
            rows.setdefault(key, []).append(np.arange(segment.rows.start, segment.rows.stop))
        if len(rows) > 1:
            yield [np.concatenate(own) for own in rows.values()]


def estimates(
    regression: Regression, fit: Fit, spread: Spread
) -> list[tuple[Term, dict[str, Estimate]]]:
    """Values of every effect of a fit with standard deviations, 95 % intervals and units."""
    at = regression.nuisance_columns.shape[1]
    out = []
    for term in fit.hypothesis.terms:
        coordinates = Coordinates(term.effect)
        part = slice(at, at + len(coordinates))
        at += len(coordinates)
        vector = fit.vector[part]
        deviation = coordinates.deviations(vector, spread.std[part], term.values)
        ends = _ends(coordinates, vector, (spread.low[part], spread.high[part]), term.values)
        out.append(
            (
                term,
                {
                    p.name: _estimate(p, term.values[p.name], deviation, ends.get(p.name))
                    for p in term.effect.parameters
                    if p.name in deviation or p.whole
                },
            )
        )
    return out


def _ends(
    coordinates: Coordinates, vector: Array, ends: tuple[Array, Array], base: Mapping[str, float]
) -> dict[str, tuple[float, float]]:
    """Intervals of the values with a coordinate of their own; a polar pair has none."""
    out: dict[str, tuple[float, float]] = {}
    polar = {name for pair in coordinates.effect.polar_pairs for name in pair}
    for index, name in enumerate(coordinates.names):
        if name in polar:
            continue
        at_ends = []
        for end in ends:
            at_end = vector.copy()
            at_end[index] = end[index]
            at_ends.append(coordinates.values(at_end, base)[name])
        out[name] = min(at_ends), max(at_ends)
    return out


def _estimate(
    parameter: Parameter,
    value: float,
    deviation: Mapping[str, float],
    ends: tuple[float, float] | None,
) -> Estimate:
    """Estimate of a value; NaN standard deviation where the interval covers its bounds."""
    std = deviation.get(parameter.name, 0.0)
    if std >= parameter.high - parameter.low:
        return Estimate(value, float("nan"), parameter.unit)
    low, high = ends or (value - HALF_WIDTH * std, value + HALF_WIDTH * std)
    return Estimate(value, std, parameter.unit, (low, high))

"""Penalised B-splines: derivatives of noisy signals at uneven times, with their uncertainty.

Differences of unevenly sampled signals divide the noise of an encoder by the shortest steps, and
an error of a time stamp changes them in proportion to the speed. A spline of degree 5 over an even
grid of knots is fitted to all samples instead; its third differences are penalised, which is the
smoother of a motion whose jerk is white noise. The weight of the penalty maximises the restricted
likelihood (REML), so that it follows from the noise and the motion of the run.

References
----------
Eilers, P. H. C., Marx, B. D. (1996). Flexible smoothing with B-splines and penalties. Statistical
Science 11, 89-121.
Wood, S. N. (2011). Fast stable restricted maximum likelihood estimation of semiparametric
generalized linear models. J. R. Statist. Soc. B 73, 3-36.
Higham, N. J. (2002). Accuracy and stability of numerical algorithms, 2nd ed. SIAM.
Takahashi, K., Fagan, J., Chen, M.-S. (1973). Formation of a sparse bus impedance matrix. Proc. 8th
PICA Conference, 63-69.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_DEGREE = 5
"""The function of least squared third derivative through given values is a spline of degree five.
"""
_PENALTY = np.array([-1.0, 3.0, -3.0, 1.0])
"""Third difference of the coefficients: the jerk of the motion."""
_LOG_WEIGHTS = np.linspace(-18.0, 24.0, 8)
"""Natural logarithms of the weights from which the search begins; 1.5·10⁻⁸ to 2.6·10¹⁰."""
_WELL_CONDITIONED = 1e5
"""Weight up to which the equations, of condition 64 λ, are solved to 10⁻⁹ without refinement."""
_CARDINAL_ROOT = 0.43057
"""Root of z⁴ + 26 z³ + 66 z² + 26 z + 1, the quintic B-spline at its knots, next to the unit circle
within it."""
_NEGLIGIBLE = 0.02
"""Share of a kernel's peak at which it ends: that of held-out errors that counts."""
_LEAST_SAMPLES = 50
"""Least number of samples that determine the weight where rounding makes neighbours alike (rule of
thumb)."""
_MOST_KNOTS = 200_000
"""Bounds time and memory, both linear in it: each band of six rows is 10 MB."""
_LONG_GAP = 300
"""Knots without a sample above which both sides are smoothed on their own.

The penalty alone determines n coefficients with a condition number of 64 (n/π)⁶: 5·10¹³ for 300,
and above 10¹⁶, where no factor exists, for 750. The kernel of the largest weight has fallen to 6 %
of its peak."""
_FEW_SAMPLES = 8
"""Fewer between two long gaps do not determine a motion, and are held near standstill (rule of
thumb)."""
_HELD = 1e-3
"""Weight of their first differences: small beside that of a sample, 1, and above the rounding of
the largest penalty, 2·10⁻⁴."""


@dataclass(frozen=True)
class Design:
    """B-splines over an even grid of knots at given times."""

    time: Array
    """(n,), s, increasing."""
    spacing: float
    """Of the knots, s."""
    _matrices: dict[int, csr_array] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _starts(self) -> NDArray[np.intp]:
        """First sample of each part between long gaps."""
        long = np.flatnonzero(np.diff(self.time) > _LONG_GAP * self.spacing) + 1
        return np.concatenate(([0], long))

    @cached_property
    def _samples(self) -> NDArray[np.intp]:
        """Number of samples of each part."""
        return np.asarray(np.diff(np.append(self._starts, len(self.time))))

    @cached_property
    def _counts(self) -> NDArray[np.intp]:
        """Number of coefficients of each part."""
        ends = self._starts + self._samples - 1
        spans = (self.time[ends] - self.time[self._starts]) / self.spacing
        return np.asarray(spans.astype(np.intp) + 1 + _DEGREE)

    @cached_property
    def count(self) -> int:
        """Number of coefficients."""
        return int(self._counts.sum())

    @cached_property
    def _part(self) -> NDArray[np.intp]:
        """Number of the part of each coefficient, (count,)."""
        return np.repeat(np.arange(len(self._counts)), self._counts)

    @cached_property
    def undetermined(self) -> int:
        """Dimension of what the penalty leaves free: a parabola for each part."""
        return (len(_PENALTY) - 1) * len(self._samples)

    @cached_property
    def few(self) -> NDArray[np.bool_]:
        """Samples of parts that do not determine a motion, (n,)."""
        return np.repeat(self._samples < _FEW_SAMPLES, self._samples)

    @cached_property
    def samples_per_knot(self) -> float:
        """Of the usual interval; at least one."""
        return max(1.0, self.spacing / float(np.median(np.diff(self.time))))

    @cached_property
    def _position(self) -> tuple[NDArray[np.intp], Array]:
        """First coefficient that acts on every sample, and its place between two knots, 0 to 1."""
        start = np.repeat(self.time[self._starts], self._samples)
        place = (self.time - start) / self.spacing
        last = np.repeat(self._counts - 1 - _DEGREE, self._samples)
        cell = np.minimum(place.astype(np.intp), last)
        before = np.repeat(np.cumsum(self._counts) - self._counts, self._samples)
        return before + cell, place - cell

    def basis(self, derivative: int) -> tuple[NDArray[np.intp], Array]:
        """First coefficient and the six weights of every sample, (n,) and (n, 6)."""
        first, place = self._position
        values = np.ones((len(place), 1))
        for degree in range(1, _DEGREE + 1 - derivative):
            padded = np.pad(values, ((0, 0), (1, 1)))
            k = np.arange(degree + 1)
            rising, falling = place[:, None] + degree - k, k + 1 - place[:, None]
            values = (rising * padded[:, :-1] + falling * padded[:, 1:]) / degree
        for _ in range(derivative):
            padded = np.pad(values, ((0, 0), (1, 1)))
            values = (padded[:, :-1] - padded[:, 1:]) / self.spacing
        return first, values

    def matrix(self, derivative: int) -> csr_array:
        """Signal, or a derivative of it, at the samples by the coefficients, sparse (n, count)."""
        from scipy.sparse import csr_array

        if derivative not in self._matrices:
            first, weights = self.basis(derivative)
            columns = first[:, None] + np.arange(_DEGREE + 1)
            starts = np.arange(0, weights.size + 1, _DEGREE + 1)
            parts = weights.ravel(), columns.ravel(), starts
            self._matrices[derivative] = csr_array(parts, shape=(len(first), self.count))
        return self._matrices[derivative]

    @cached_property
    def gram(self) -> Array:
        """Lower band of B'B, (6, count)."""
        first, weights = self.basis(0)
        band = np.zeros((_DEGREE + 1, self.count))
        for row in range(_DEGREE + 1):
            for column in range(row + 1):
                products = weights[:, row] * weights[:, column]
                band[row - column] += np.bincount(first + column, products, self.count)
        return band

    @cached_property
    def penalised(self) -> NDArray[np.bool_]:
        """Third differences within one part, (count − 3,)."""
        reach = len(_PENALTY) - 1
        return np.asarray(self._part[reach:] == self._part[:-reach])

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """First differences within a part of few samples, (count − 1,)."""
        few = (self._samples < _FEW_SAMPLES)[self._part[1:]]
        return np.asarray((self._part[1:] == self._part[:-1]) & few)


@dataclass(frozen=True)
class SmoothingSpline:
    """Linear smoother over given times, with the weight that suits one signal."""

    design: Design
    """Times and knots."""
    weight: float
    """Of the penalty, relative to the squared residuals."""
    noise: float
    """Standard deviation of the noise of the signal to which the weight was fitted."""
    deviance: float = float("nan")
    """Minus twice the restricted log-likelihood of that signal, up to a constant."""

    @classmethod
    def fit(cls, time: Array, signal: Array) -> SmoothingSpline:
        """Smoother whose weight maximises the restricted likelihood of a signal (n,) without NaN, n
        ≥ 4.

        The noise is at least that of the signal's rounding, q/√12 for a step q: a staircase is no
        motion. Where the signal changes by less than q between samples, the rounding errors of
        neighbours are alike; every k-th sample, between which it changes by q, then determines the
        weight and the knots, and each of all samples counts as a k-th of one: noise k σ², weight k
        times.
        """
        from scipy.optimize import minimize_scalar

        steps = np.diff(time)
        usual = float(np.median(steps))
        # A long gap has no knots.
        spacing = max(usual, float(np.minimum(steps, _LONG_GAP * usual).sum()) / _MOST_KNOTS)
        levels = np.unique(signal)
        step = float(np.min(np.diff(levels))) if len(levels) > 1 else 0.0
        alike = round(step / float(np.mean(np.abs(np.diff(signal))))) if step else 1
        every = max(1, min(alike, len(signal) // _LEAST_SAMPLES))
        if every > 1:
            sparse = cls.fit(time[::every], signal[::every])
            design = Design(time, sparse.design.spacing)
            noise = sparse.noise * float(np.sqrt(every))
            return cls(design, sparse.weight * every, noise, sparse.deviance)
        least = max(step**2 / 12, (1e-12 * float(np.ptp(signal))) ** 2, 1e-300)

        design = Design(time, spacing)
        if design.few.any() and not design.few.all():
            # They do not determine the weight either.
            kept = cls.fit(time[~design.few], signal[~design.few])
            design = Design(time, kept.design.spacing)
            return cls(design, kept.weight, kept.noise, kept.deviance)

        def reml(weight: float) -> tuple[float, float]:
            return cls(design, weight, 1.0)._reml(signal, least)

        def criterion(log_weight: float) -> float:
            return reml(float(np.exp(log_weight)))[0]

        grid = [criterion(value) for value in _LOG_WEIGHTS]
        best = int(np.argmin(grid))
        bounds = _LOG_WEIGHTS[max(0, best - 1)], _LOG_WEIGHTS[min(len(grid) - 1, best + 1)]
        found = minimize_scalar(criterion, bounds=bounds, method="bounded", options={"xatol": 0.1})
        weight = float(np.exp(found.x))
        deviance, variance = reml(weight)
        return cls(design, weight, float(np.sqrt(variance)), deviance)

    def smoothed(self, signal: Array, derivative: int = 0) -> Array:
        """Smoothed signal (n,) or its first or second derivative at the samples."""
        return self._at_samples(self._coefficients(signal), derivative)

    @property
    def reach(self) -> float:
        """Half width of the smoother's kernel in samples, at least a knot's: (λ/m)^⅙ knots with m
        samples per knot."""
        return self.design.samples_per_knot * max(1.0, self._smoothing_length)

    @property
    def support(self) -> float:
        """Samples to either side beyond which a sample acts by less than 2 % of its kernel's peak.
        The kernel falls by e in 2 (λ/m)^⅙ knots, an interpolating spline's of degree five by the
        largest root of its cardinal spline, 0.43, a knot (Schoenberg, I. J., 1973, Cardinal Spline
        Interpolation)."""
        decay = max(2 * self._smoothing_length, 1 / float(np.log(1 / _CARDINAL_ROOT)))
        return self.design.samples_per_knot * float(np.log(1 / _NEGLIGIBLE)) * decay

    @property
    def _smoothing_length(self) -> float:
        """(λ/m)^⅙ for m samples per knot: the scale of the kernel of large weights, knots."""
        relative = self.weight / self.design.samples_per_knot
        return float(relative ** (1 / (2 * (len(_PENALTY) - 1))))

    def std(self, derivative: int) -> Array:
        """Standard deviation (n,) of a derivative, order 0 to 2, of the signal to which the weight
        was fitted: σ² w' (B'B + λ D'D)⁻¹ w with the band of the inverse by Takahashi's
        recursion."""
        inverse = self._inverse_band
        first, weights = self.design.basis(derivative)
        total = np.zeros(len(first))
        for row in range(_DEGREE + 1):
            for column in range(row, _DEGREE + 1):
                twice = 1.0 if row == column else 2.0
                total += (
                    twice
                    * weights[:, row]
                    * weights[:, column]
                    * inverse[first + row, column - row]
                )
        return np.asarray(self.noise * np.sqrt(np.maximum(total, 0.0)))

    def typical_std(self, derivative: int) -> float:
        """Standard deviation of a derivative, order r of 0 to 2, far from the ends of even samples.

        σ² times the integral of ω²ʳ / (m + λ ω⁶) over ω/2π, ω in radians per knot, for m samples
        per knot: the posterior variance by the equivalent kernel, for kernels of more than one
        sample (Silverman, B. W., 1984, Spline smoothing: the equivalent variable kernel method.
        Annals of Statistics 12).
        """
        order = (2 * derivative + 1) / 6
        density = self.design.samples_per_knot
        size = max(1.0, self.weight / density) ** -order / density
        variance = size / (6 * np.sin(np.pi * order))
        return float(self.noise / self.design.spacing**derivative * np.sqrt(variance))

    @cached_property
    def _factor(self) -> Array:
        """Lower band of the Cholesky factor of B'B + λ D'D, (6, count)."""
        from scipy.linalg import cholesky_banded

        band = self.design.gram.copy()
        weights = self.weight * self.design.penalised
        for row in range(len(_PENALTY)):
            for column in range(row + 1):
                rows = slice(column, column + len(weights))
                band[row - column, rows] += weights * _PENALTY[row] * _PENALTY[column]
        hold = _HELD * self.design.held
        band[0, :-1] += hold
        band[0, 1:] += hold
        band[1, :-1] -= hold
        return np.asarray(cholesky_banded(band, lower=True))

    def _coefficients(self, signal: Array) -> Array:
        from scipy.linalg import cho_solve_banded

        basis = self.design.matrix(0)
        right = basis.T @ signal
        factor = self._factor, True
        found = np.asarray(cho_solve_banded(factor, right, check_finite=False))
        if self.weight > _WELL_CONDITIONED:
            # One step of iterative refinement: the differences of the coefficients are exact where
            # the product with the band cancels (Higham 2002, chapter 12).
            bent = np.convolve(self._bent(found), _PENALTY)
            rest = right - basis.T @ (basis @ found) - self.weight * bent
            moved = np.convolve(self.design.held * np.diff(found), [-1.0, 1.0])
            found += cho_solve_banded(factor, rest + _HELD * moved, check_finite=False)
        return found

    def _bent(self, coefficients: Array) -> Array:
        """Penalised third differences, (count − 3,)."""
        return self.design.penalised * np.diff(coefficients, len(_PENALTY) - 1)

    def _at_samples(self, coefficients: Array, derivative: int) -> Array:
        return np.asarray(self.design.matrix(derivative) @ coefficients)

    def _reml(self, signal: Array, least: float) -> tuple[float, float]:
        """Minus twice the restricted log-likelihood at the best noise variance, and that."""
        centred = signal - signal.mean()
        coefficients = self._coefficients(centred)
        residual = centred - self._at_samples(coefficients, 0)
        bent = self._bent(coefficients)
        squares = float(residual @ residual) + self.weight * float(bent @ bent)
        free = max(1, len(signal) - self.design.undetermined)
        variance = max(squares / free, least)
        determinant = 2 * float(np.sum(np.log(self._factor[0])))
        penalised = self.design.count - self.design.undetermined
        value = free * np.log(variance) + squares / variance + determinant
        return float(value - penalised * np.log(self.weight)), variance

    @cached_property
    def _inverse_band(self) -> Array:
        """Band of the inverse of B'B + λ D'D: entry (j, d) of row j and column j + d."""
        count, reach = self.design.count, _DEGREE
        lower = self._factor / self._factor[0]
        pivots = self._factor[0] ** -2
        out = np.zeros((count + reach, reach + 1))
        offsets = np.abs(np.arange(1, reach + 1)[:, None] - np.arange(1, reach + 1))
        corner = np.minimum(np.arange(1, reach + 1)[:, None], np.arange(1, reach + 1))
        for j in range(count - 1, -1, -1):
            own = lower[1:, j]
            block = out[j + corner, offsets]
            out[j, 1:] = -block @ own
            out[j, 0] = pivots[j] - own @ out[j, 1:]
        return out[:count]

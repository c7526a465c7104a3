"""Derivatives of sampled signals: differences of even samples, a spline of uneven ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.smoothing_spline import SmoothingSpline

_SIGNIFICANT = 3.0
"""Standard deviations of its noise that a rate at standstill does not exceed: one in 370 does."""
_ROUNDED, _MOST_ROUNDED = 0.01, 0.01
"""Spread of a direction beside noise, as a share of the highest rate, at most of the creep rate:
presliding rounds every reversal. Rule of thumb: EMPS has 1.6 %; with more than 0.005 rad/s friction
that is sharp to 0.05 rad/s is missed in long, precise recordings."""
_CREEP_LEAST = 1e-3
"""Least noise of a rate, as a share of the creep rate: rounding has no direction."""
_FOURTH_DIFFERENCE = 70.0
"""Variance of the fourth difference of white noise of variance one: 1 + 16 + 36 + 16 + 1."""
_LOAD_SPAN = 0.02
"""Span of a difference to either side for an acceleration, s: an encoder's noise stays small."""
_AGREES = 0.1
"""Standard deviation of reported rate less differences, in that of the differences, up to which
both agree."""
_CALMER = 0.5
"""Noise of a reported rate, in that of the differences, below which it replaces them."""
_EVEN = 1e-3
"""Deviation of a step from the median step up to which samples count as even."""
_NOISY = 0.15
"""Noise of an acceleration by differences, as a share of its standard deviation, above which a
spline replaces them. The share of its variance is up to twice the square of this, for neighbouring
differences share samples: an inertia would be 5 % too small."""
_LEAST_SAMPLES = 8
"""Rule of thumb: the spline has six coefficients more than intervals, and its two variances are
estimated from what remains; with fewer samples differences are taken."""


def direction(rate: Array, noise: float, creep: float) -> Array:
    """Mean of the sign, −1 to 1, of a rate (n,) that is known with a standard deviation ``noise``;
    ``creep`` is a rate that has a direction whatever its noise.

    The true rate is zero with the probability p, else of a density f that is constant about zero.
    The rate r = 0 ± σ is then that of a standstill with the probability p φ / (p φ + f), with φ the
    normal density of r, and of a motion of the expected sign 2 Φ(r/σ) − 1 otherwise. f is the
    density between three and six σ, and p the share of rates within three beyond what f has there.
    σ is that of the noise, or of the rounding by presliding where that is more.
    """
    from scipy.special import erf

    rounded = min(_ROUNDED * float(np.max(np.abs(rate), initial=0.0)), _MOST_ROUNDED * creep)
    width = max(noise, rounded)
    spread = creep * float(np.clip(width / creep, _CREEP_LEAST, 1 / _SIGNIFICANT))
    near = np.abs(rate) <= _SIGNIFICANT * spread
    beside = (np.abs(rate) <= 2 * _SIGNIFICANT * spread) & ~near
    moving = max(int(beside.sum()), 1)
    at_rest = max(int(near.sum()) - moving, 0)
    ratio = rate / spread
    standing = at_rest * np.exp(-(ratio**2) / 2) / np.sqrt(2 * np.pi)
    share = standing / (standing + moving / (2 * _SIGNIFICANT))
    return np.asarray((1 - share) * erf(ratio / np.sqrt(2)))


def is_smoother(measured: Array, differences: Array) -> bool:
    """Whether a measured rate agrees with differences of the angle and has less noise. Jitter of
    the time stamps adds noise to differences and none to the velocity that a drive reports; one
    that is quantised or filtered has more noise or does not agree."""
    spread = float(np.std(differences))
    if spread == 0.0 or float(np.std(measured - differences)) > _AGREES * spread:
        return False
    return float(np.std(np.diff(measured, 2))) < _CALMER * float(np.std(np.diff(differences, 2)))


def lateness(velocity: Array, angle: Array, time: Array) -> tuple[float, float]:
    """Time by which a reported velocity (n,) follows the angle's differences, as behind a filter,
    and its standard deviation, s; NaN where it does not change."""
    change = np.gradient(velocity, time)
    size = float(change @ change)
    if not size > 0.0:
        return float("nan"), float("nan")
    missing = np.gradient(angle, time) - velocity
    late = float(change @ missing) / size
    left = missing - late * change
    return late, float(np.sqrt(left @ left / len(left) / size))


@dataclass(frozen=True)
class SamplingTimes:
    """Sampling times, and derivatives of signals sampled at them: differences where the samples are
    even, else a smoothing spline whose weight is estimated from the measured angle or rate."""

    time: Array
    """(n,), s."""
    angle: Array | None = None
    """Measured angle at these times, (n,); None where derivatives are always differences."""
    velocity: Array | None = None
    """Rate that the drive reports, (n,), in the unit of the angle per second."""

    @cached_property
    def _step(self) -> float:
        return float(np.median(np.diff(self.time)))

    @cached_property
    def even(self) -> bool:
        """Whether all steps are equal to 0.1 %."""
        return bool(np.max(np.abs(np.diff(self.time) - self._step)) <= _EVEN * self._step)

    @cached_property
    def measured_rate(self) -> Array | None:
        """The reported rate where it has less noise than differences of the angle, without its
        significant lateness; else None."""
        if self.angle is None or self.velocity is None:
            return None
        late, std = lateness(self.velocity, self.angle, self.time)
        velocity = self.velocity
        if abs(late) > _SIGNIFICANT * std:
            velocity = np.interp(self.time + late, self.time, velocity)
        smoother = is_smoother(velocity, np.gradient(self.angle, self.time))
        return velocity if smoother else None

    @property
    def _moved(self) -> Array | None:
        """What is differentiated: the measured angle or rate."""
        return self.angle if self.measured_rate is None else self.measured_rate

    @cached_property
    def spline(self) -> SmoothingSpline | None:
        """Smoothing spline of uneven samples; None where derivatives are differences."""
        moved = self._moved
        if moved is None or len(self.time) < _LEAST_SAMPLES or self.even or not np.ptp(moved):
            return None
        return SmoothingSpline.fit(self.time, moved)

    @cached_property
    def smoother(self) -> SmoothingSpline | None:
        """Spline of the motor's rate and acceleration: that of uneven samples, or of even ones
        whose noise biases an inertia; None where these are differences. Other signals of even
        samples keep theirs: they may have periods that the smoother of a steady motion would
        remove."""
        moved = self._moved
        if self.spline is not None or moved is None or len(self.time) < _LEAST_SAMPLES:
            return self.spline
        if not np.ptp(moved):
            return None
        acceleration = self.differences(moved)
        if self.measured_rate is None:
            acceleration = self.differences(acceleration)
        biased = _noise(acceleration) > _NOISY * float(np.std(acceleration))
        return SmoothingSpline.fit(self.time, moved) if biased else None

    @cached_property
    def acceleration_std(self) -> Array | None:
        """Standard deviation of the angle's second derivative, (n,); None for even samples."""
        if self.spline is None:
            return None
        return self.spline.std(2 if self.measured_rate is None else 1)

    @cached_property
    def rate(self) -> Array:
        """First derivative of the angle, (n,): as reported where that has less noise."""
        assert self.angle is not None
        if self.smoother is not None:
            return self._smoothed(self.smoother, 1)
        return self.gradient(self.angle) if self.measured_rate is None else self.measured_rate

    @cached_property
    def rate_noise(self) -> float:
        """Standard deviation of the rate's noise: that of its smoother, or from its fourth
        differences. A motion that is smooth over five samples has none, and differences of a noisy
        angle have a quarter more."""
        if self.smoother is None:
            return _noise(self.rate)
        return self.smoother.typical_std(1 if self.measured_rate is None else 0)

    @cached_property
    def initial_rate(self) -> tuple[float, float]:
        """Rate at the first sample and its standard deviation, by the smoothing spline: differences
        are one-sided there, and any derivative has more noise than between its neighbours."""
        moved, order = self._moved, 1 if self.measured_rate is None else 0
        if moved is None or len(self.time) < _LEAST_SAMPLES or not np.ptp(moved):
            return float(self.rate[0]), self.rate_noise
        smoother = self.smoother or SmoothingSpline.fit(self.time, moved)
        return float(smoother.smoothed(moved, order)[0]), float(smoother.std(order)[0])

    @cached_property
    def acceleration(self) -> Array:
        """Second derivative of the angle, (n,)."""
        if self.smoother is None:
            return self.gradient(self.rate)
        return self._smoothed(self.smoother, 2)

    def _smoothed(self, smoother: SmoothingSpline, derivative: int) -> Array:
        """Derivative of the angle by the spline of the angle or of the measured rate."""
        if self.measured_rate is not None:
            return smoother.smoothed(self.measured_rate, derivative - 1)
        assert self.angle is not None
        return smoother.smoothed(self.angle, derivative)

    @cached_property
    def reach(self) -> int:
        """Samples to either side that an acceleration depends on: at least 20 ms and one."""
        if self.spline is not None:
            return int(np.ceil(self.spline.reach))
        return max(1, round(_LOAD_SPAN / self._step))

    @cached_property
    def support(self) -> int:
        """Samples to either side beyond which an acceleration hardly depends on a sample."""
        return self.reach if self.spline is None else int(np.ceil(self.spline.support))

    @property
    def span(self) -> float:
        """The same in seconds."""
        return self.reach * self._step

    @cached_property
    def _by_sample(self) -> Array:
        return _by_number(self.time)

    def gradient(self, x: Array) -> Array:
        """First derivative between neighbours, (n,)."""
        if self.spline is not None:
            return self.spline.smoothed(x, 1)
        return self.differences(x)

    def differences(self, x: Array) -> Array:
        """First derivative between neighbours by differences, as by ``numpy.gradient``, (n,)."""
        if len(x) < 3:
            return np.asarray(np.gradient(x, self.time))
        before, here, after, steps = self._weights
        out = np.empty(len(x))
        out[1:-1] = before * x[:-2] + here * x[1:-1] + after * x[2:]
        out[0] = (x[1] - x[0]) / steps[0]
        out[-1] = (x[-1] - x[-2]) / steps[-1]
        return out

    @cached_property
    def _weights(self) -> tuple[Array, Array, Array, Array]:
        """Weights of a sample and its neighbours in its difference, (n − 2,), and the steps."""
        steps = np.diff(self.time)
        left, right = steps[:-1], steps[1:]
        both = left + right
        return -right / (left * both), (right - left) / (left * right), left / (right * both), steps

    def wide_gradient(self, x: Array) -> Array:
        """First derivative over at least ±20 ms, (n,)."""
        step, time = self.reach, self.time
        if self.spline is not None:
            return self.spline.smoothed(x, 1)
        if len(x) <= 2 * step:
            return np.zeros_like(x)
        inner = (x[2 * step :] - x[: -2 * step]) / (time[2 * step :] - time[: -2 * step])
        return np.pad(inner, step, mode="edge")

    def sharp_gradient(self, x: Array) -> Array:
        """First derivative of sixth order over seven samples, (n,), for signals without noise. It
        is divided by that of time, so that straight lines stay exact on uneven samples; of second
        order at the ends."""
        if self.spline is not None:
            return self.spline.smoothed(x, 1)
        return np.asarray(_by_number(x) / self._by_sample)

    def second_derivative(self, x: Array) -> Array:
        """Central second difference over at least ±20 ms, so that encoder noise stays small."""
        step, time = self.reach, self.time
        if self.spline is not None:
            return self.spline.smoothed(x, 2)
        if len(x) <= 2 * step:
            return np.zeros_like(x)
        before, after = time[step:-step] - time[: -2 * step], time[2 * step :] - time[step:-step]
        slope = (x[2 * step :] - x[step:-step]) / after - (x[step:-step] - x[: -2 * step]) / before
        inner = 2 * slope / (before + after)
        return np.pad(inner, step, mode="edge")

    def curvature(self, x: Array) -> Array:
        """Minus twelve times the smoothing error of a derivative ``x`` by this clock. A second
        difference over a span h adds h²/12 of the second derivative; what a spline adds is
        estimated by smoothing once more (twicing; Tukey, J. W., 1977, Exploratory Data
        Analysis)."""
        if self.spline is not None:
            return 12 * (self.spline.smoothed(x) - x)
        return self.span**2 * self.second_derivative(x)


def _noise(signal: Array) -> float:
    """Standard deviation of white noise from the fourth differences of a signal, in its unit."""
    if len(signal) < _LEAST_SAMPLES:
        return 0.0
    return float(np.sqrt(np.mean(np.diff(signal, 4) ** 2) / _FOURTH_DIFFERENCE))


def _by_number(x: Array) -> Array:
    if len(x) < 2:
        return np.ones_like(x)
    if len(x) < 7:
        return np.asarray(np.gradient(x))
    out = np.empty(len(x))
    out[:3], out[-3:] = np.gradient(x[:4])[:3], np.gradient(x[-4:])[1:]
    one, two, three = (x[3 + k : len(x) - 3 + k] - x[3 - k : len(x) - 3 - k] for k in (1, 2, 3))
    out[3:-3] = (45 * one - 9 * two + three) / 60
    return out


def shifted(signal: Array, time: Array, later: float) -> Array:
    """The signal (n,) ``later`` seconds later, by cubic Hermite interpolation; constant at the
    ends."""
    if later == 0.0 or len(time) < 2:
        return signal
    slope = np.gradient(signal, time)
    asked = np.clip(time + later, time[0], time[-1])
    left = np.clip(np.searchsorted(time, asked, side="right") - 1, 0, len(time) - 2)
    step = time[left + 1] - time[left]
    u = (asked - time[left]) / step
    rise = signal[left + 1] - signal[left]
    start, end = slope[left] * step - rise, rise - slope[left + 1] * step
    return np.asarray(signal[left] + u * rise + u * (1 - u) * ((1 - u) * start + u * end))


def with_turning_points(x: Array) -> tuple[Array, NDArray[np.intp]]:
    """Insert the extrema between samples into a signal; also gives the places of the samples.

    Between two samples a signal may exceed both, and the state of a hysteresis or a backlash
    depends on its extremum: that of the parabola through the three samples about it.
    """
    if len(x) < 3:
        return x, np.arange(len(x))
    step = np.diff(x)
    turns = 1 + np.flatnonzero(step[:-1] * step[1:] < 0)
    slope, bend = (step[turns] + step[turns - 1]) / 2, step[turns] - step[turns - 1]
    at = -slope / bend
    where = turns + (at > 0)
    count = np.arange(len(x))
    own = count + np.searchsorted(where, count, side="right")
    return np.insert(x, where, x[turns] + slope * at / 2), own

"""Cross-correlation of two signals: lag, its standard deviation, and a drift of the clocks.

The lag maximises the correlation. Each signal is band-limited by its own sampling; both are
interpolated on the finer time base. The lag is known when the residual variance at every other
maximum exceeds that at the best one by more than chance (F test), so that a periodic motion, which
repeats its maxima, is refused.

References
----------
C. H. Knapp and G. C. Carter, "The generalized correlation method for estimation of time delay",
IEEE Trans. ASSP 24, 1976.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from winchkit.arrays import Array
from winchkit.quantity_text import with_std
from winchkit.runs.importing.streams import Streams

_MOST = 200_000
"""Most samples of the common time base."""
LEAST_OVERLAP = 0.4
"""Least share of the shorter recording that overlaps at a lag."""
_LEAST_CORRELATION = 0.8
"""Of two recordings of one motion; noise of velocities leaves more. Rule of thumb."""
_CHANCE = 1e-4
"""Level of the F test that the best lag is better than its rival: a wrong join is worse than
none."""
_WINDOWS = 6
"""Parts of a recording in which the delay is estimated again, to see a drift of the clocks."""


@dataclass(frozen=True)
class TimedSignal:
    """One channel over time."""

    channel: str
    time: Array
    values: Array


@dataclass(frozen=True)
class Peak:
    """Largest correlation over the lags."""

    lag: float
    """s to be added to the times of the second signal."""
    r: float
    """Signed."""
    rival: float
    """Largest magnitude outside its own lobe."""
    independent: float
    """Number of independent samples of the residual."""
    overlap: float
    """s."""


@dataclass(frozen=True)
class Agreement:
    """How well two clocks agree."""

    pair: tuple[str, str]
    """Channel of the first and of the second file."""
    lag: float
    """s to be added to the times of the second file for those of the first."""
    lag_std: float
    correlation: float
    """Signed, at the lag."""
    rival: float
    """Largest magnitude of the correlation at another lag."""
    drift: float
    """Rate of the second clock against the first one, less 1; NaN where it is not determined."""
    drift_std: float
    overlap: float
    """s."""
    is_known: bool
    """Whether the lag is significantly better than every other."""
    reference: float
    """Time on the second clock at which the lag is valid, s."""

    @property
    def text(self) -> str:
        """One sentence."""
        first, second = self.pair
        digits = max(0, 1 - math.floor(math.log10(max(self.lag_std * 1e3, 1e-9))))
        drift = (
            f", clocks drift by {with_std(self.drift * 1e6, self.drift_std * 1e6, '1')} ppm"
            if math.isfinite(self.drift)
            else ""
        )
        return (
            f"{first} against {second}: lag {self.lag * 1e3:.{digits}f} ± "
            f"{self.lag_std * 1e3:.2g} ms, correlation {self.correlation:.4f} "
            f"(next lag {self.rival:.4f}){drift}, overlap {self.overlap:.4g} s"
        )


def signals_by_base(streams: Streams) -> dict[str, list[TimedSignal]]:
    """Varying channels of a file by their name without a winch's."""
    found: dict[str, list[TimedSignal]] = {}
    for item in streams.streams:
        for name, values in item.channels.items():
            known = np.isfinite(values) & np.isfinite(item.time)
            if np.count_nonzero(known) >= 16 and np.ptp(values[known]) > 0:
                signal = TimedSignal(name, item.time[known], values[known])
                found.setdefault(name.rpartition(".")[2], []).append(signal)
    return found


def correlated(one: TimedSignal, two: TimedSignal) -> Agreement | None:
    """Lag with the largest magnitude of the correlation."""
    # The slower sampling limits both: the faster signal is averaged over the slower interval.
    interval = max(interval_of(one), interval_of(two))
    step = max(
        min(interval_of(one), interval_of(two)),
        interval / 4,
        (np.ptp(one.time) + np.ptp(two.time)) / _MOST,
    )
    a, b = _even(one, step, interval), _even(two, step, interval)
    shorter = min(len(a), len(b))
    if shorter < 16:
        return None
    lags, r, counts = _normalised(a, b, max(16, int(LEAST_OVERLAP * shorter)))
    if not len(lags):
        return None
    size = np.abs(r)
    top = int(np.argmax(size))
    if not math.isfinite(size[top]) or size[top] == 0:
        return None
    start = float(one.time[0] - two.time[0])
    lag = start + (float(lags[top]) + vertex_of(size, top)) * step
    peak = Peak(
        lag,
        float(r[top]),
        rival_of(size, top),
        _independent(a, b, int(lags[top])),
        float(counts[top]) * step,
    )
    return agreement_at(peak, one, two, b, step)


def lag_of_several(many: Sequence[Array], time: Array, two: TimedSignal) -> float | None:
    """Lag at which a signal is best a sum of others, s to be added to its times.

    ``many``: signals, (n,) each, at the times ``time``. The squared multiple correlation is rᵀG⁻¹r
    of the correlations r with each and of those among them, G.
    """
    signals = [TimedSignal("", time, values) for values in many]
    interval = max(interval_of(signals[0]), interval_of(two))
    step = max(interval / 2, (np.ptp(time) + np.ptp(two.time)) / _MOST)
    b = _even(two, step, interval)
    parts = [_even(one, step, interval) for one in signals]
    shorter = min(len(parts[0]), len(b))
    if shorter < 16:
        return None
    found = [_normalised(part, b, max(16, int(LEAST_OVERLAP * shorter))) for part in parts]
    r = np.array([one[1] for one in found])
    if not r.size:
        return None
    squares = np.sum(r * (np.linalg.pinv(np.corrcoef(parts)) @ r), axis=0)
    top = int(np.argmax(squares))
    return float(time[0] - two.time[0]) + (float(found[0][0][top]) + vertex_of(squares, top)) * step


def agreement_at(
    peak: Peak, one: TimedSignal, two: TimedSignal, even: Array, step: float
) -> Agreement:
    """Agreement at a peak; a known lag is refined, with its drift. ``even``: as in ``_lag_std``."""
    interval = max(interval_of(one), interval_of(two))
    known = abs(peak.r) >= _LEAST_CORRELATION and _is_better(peak)
    lag, std = peak.lag, _lag_std(even, step, peak)
    middle = float(two.time[0]) + 0.5 * float(np.ptp(two.time))
    drift, drift_std = math.nan, math.nan
    if known:
        drift, drift_std, lag, spread, middle = _drift(one, two, lag, interval, middle)
        std = spread or std
    return Agreement(
        (one.channel, two.channel),
        lag,
        std,
        peak.r,
        peak.rival,
        drift,
        drift_std,
        peak.overlap,
        known,
        middle,
    )


def interval_of(signal: TimedSignal) -> float:
    """Mean interval of the samples, s."""
    return float(np.ptp(signal.time)) / (len(signal.time) - 1)


def _even(signal: TimedSignal, step: float, window: float) -> Array:
    """Samples at even times, averaged over a window where the signal has a finer sampling."""
    time = signal.time[0] + step * np.arange(int(np.ptp(signal.time) / step) + 1)
    own = interval_of(signal)
    values = signal.values
    width = round(window / own)
    if width > 1:
        kernel = np.ones(width + 1 - width % 2) / (width + 1 - width % 2)
        padded = np.pad(values, len(kernel) // 2, mode="edge")
        values = np.convolve(padded, kernel, mode="valid")
    return np.asarray(np.interp(time, signal.time, values), dtype=np.float64)


def _normalised(a: Array, b: Array, least: int) -> tuple[Array, Array, Array]:
    """Pearson's correlation of b[n] and a[n + k] at every lag k; means, variances of overlap."""
    size = 1 << (len(a) + len(b) - 1).bit_length()

    def product(x: Array, y: Array) -> Array:
        spectrum = np.fft.rfft(x, size) * np.conj(np.fft.rfft(y, size))
        whole = np.fft.irfft(spectrum, size)
        return np.concatenate(
            (whole[-(len(b) - 1) :] if len(b) > 1 else whole[:0], whole[: len(a)])
        )

    a, b = a - a.mean(), b - b.mean()
    one, two = np.ones_like(a), np.ones_like(b)
    lags = np.arange(-(len(b) - 1), len(a))
    n = np.round(product(one, two))
    sums = product(a, two), product(one, b)
    squares = product(a**2, two), product(one, b**2)
    kept = n >= least
    n = np.where(kept, n, 1.0)
    top = product(a, b) - sums[0] * sums[1] / n
    below = (squares[0] - sums[0] ** 2 / n) * (squares[1] - sums[1] ** 2 / n)
    tiny = 1e-12 * float(np.sum(a**2)) * float(np.sum(b**2))
    r = np.where(below > tiny, top / np.sqrt(np.maximum(below, tiny)), 0.0)
    return lags[kept].astype(np.float64), r[kept], n[kept]


def vertex_of(size: Array, top: int) -> float:
    """Offset of a maximum between samples, by a parabola."""
    if not 0 < top < len(size) - 1:
        return 0.0
    left, middle, right = size[top - 1 : top + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0


def rival_of(size: Array, top: int) -> float:
    """Largest correlation outside the maximum's own lobe."""
    left, right = top, top
    while left > 0 and size[left - 1] < size[left]:
        left -= 1
    while right < len(size) - 1 and size[right + 1] < size[right]:
        right += 1
    outside = np.concatenate((size[:left], size[right + 1 :]))
    return float(outside.max()) if len(outside) else 0.0


def _residual(a: Array, b: Array, lag: int) -> Array:
    """Residual of the regression of the overlapping parts."""
    start, end = max(0, lag), min(len(a), len(b) + lag)
    x, y = b[start - lag : end - lag], a[start:end]
    x, y = x - x.mean(), y - y.mean()
    scale = float(np.sum(x * y)) / max(float(np.sum(x**2)), 1e-300)
    return np.asarray(y - scale * x)


def _independent(a: Array, b: Array, lag: int) -> float:
    """Number of independent samples of the residual at a lag."""
    return independent_count(_residual(a, b, lag))


def independent_count(rest: Array) -> float:
    """n / (1 + 2 Σ ρ_k), the autocorrelation ρ summed to its first zero; at least 4."""
    n = len(rest)
    power = float(np.sum(rest**2))
    if power == 0 or n < 8:
        return float(n)
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(rest, size)) ** 2
    rho = np.fft.irfft(spectrum, size)[:n] / power
    negative = np.flatnonzero(rho <= 0)
    end = int(negative[0]) if len(negative) else n
    return max(4.0, n / (1 + 2 * float(np.sum(rho[1:end]))))


def _is_better(peak: Peak) -> bool:
    """F test of the residual variances at the best lag and at the next maximum."""
    from scipy.stats import f

    ratio = (1 - peak.rival**2) / max(1 - peak.r**2, 1e-12)
    return bool(ratio > f.isf(_CHANCE, peak.independent, peak.independent))


def _lag_std(b: Array, step: float, peak: Peak) -> float:
    """Standard deviation of the lag: residual noise over the slope of the signal.

    With a = s b(t − τ) + e, var τ = var e / (n s² mean(b'²)); var e / (s² var b) = (1 − r²)/r².
    """
    slope = np.gradient(b, step)
    sharp = float(np.mean(slope**2)) / max(float(np.var(b)), 1e-300)
    noise = max(1 - peak.r**2, 1e-12) / peak.r**2
    return math.sqrt(noise / (peak.independent * max(sharp, 1e-300)))


def _drift(
    one: TimedSignal, two: TimedSignal, lag: float, window: float, middle: float
) -> tuple[float, float, float, float, float]:
    """Drift of the clocks from the lags of parts of the recording, by a weighted line.

    Returns the drift, its standard deviation, the lag at the mean time of the parts, its standard
    deviation from their scatter, and that time.
    """
    edges = np.linspace(two.time[0], two.time[-1], _WINDOWS + 1)
    reach = max(8 * window, 0.02 * float(np.ptp(two.time)))
    times, lags, weights = [], [], []
    for start, end in pairwise(edges):
        inside = (two.time >= start) & (two.time <= end)
        if np.count_nonzero(inside) < 16 or np.ptp(two.values[inside]) == 0:
            continue
        part = TimedSignal(two.channel, two.time[inside], two.values[inside])
        found = _local_lag(one, part, lag=lag, reach=reach, window=window)
        if found is not None:
            times.append(0.5 * (start + end))
            lags.append(found[0])
            weights.append(1 / found[1] ** 2)
    if len(times) < 3:
        return math.nan, math.nan, lag, 0.0, middle
    t, y, w = np.array(times), np.array(lags), np.array(weights)
    centre = float(np.average(t, weights=w))
    mean = float(np.average(y, weights=w))
    spread = float(np.sum(w * (t - centre) ** 2))
    slope = float(np.sum(w * (t - centre) * (y - mean))) / spread
    rest = y - mean - slope * (t - centre)
    chi2 = float(np.sum(w * rest**2)) / (len(t) - 2)
    excess = max(1.0, chi2)
    std, lag_std = math.sqrt(excess / spread), math.sqrt(excess / float(np.sum(w)))
    return slope, std, mean, lag_std, centre


def _local_lag(
    one: TimedSignal, two: TimedSignal, *, lag: float, reach: float, window: float
) -> tuple[float, float] | None:
    """Lag near an approximate one by least squares, with its standard deviation."""
    step = window / 4
    even = np.arange(two.time[0], two.time[-1], step)
    if len(even) < 16 or len(even) > _MOST:
        return None
    b = np.interp(even, two.time, two.values)
    reference = _even(one, step, window)
    origin = one.time[0]
    axis = origin + step * np.arange(len(reference))
    found = lag
    std = math.nan
    for _ in range(8):
        at = even + found
        inside = (at >= axis[0]) & (at <= axis[-1])
        if np.count_nonzero(inside) < 0.8 * len(even):
            return None
        a = np.interp(at, axis, reference)[inside]
        slope = np.interp(at, axis, np.gradient(reference, step))[inside]
        matrix = np.stack([np.ones(len(a)), b[inside], slope], axis=1)
        scale = np.where(np.ptp(matrix, axis=0) > 0, np.std(matrix, axis=0), 1.0)
        scale[0] = 1.0
        solved, *_ = np.linalg.lstsq(matrix / scale, a, rcond=None)
        # a(t + τ) = c + s b(t), τ = found + δ: a(t + found) + δ a' = c + s b.
        change = -float(solved[2] / scale[2])
        rest = a - (matrix / scale) @ solved
        power = float(np.mean(rest**2))
        independent = independent_count(rest)
        sharp = float(np.mean((slope - slope.mean()) ** 2))
        if sharp == 0:
            return None
        std = math.sqrt(max(power, 1e-300) / (sharp * independent))
        found += float(np.clip(change, -reach / 4, reach / 4))
        if abs(found - lag) > reach:
            return None
        if abs(change) < 0.01 * std:
            break
    return found, max(std, 1e-9)

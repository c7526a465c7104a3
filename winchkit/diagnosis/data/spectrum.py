"""Spectral representation: orthonormal DCT-II, zero-phase low-pass, frequency bands, smoothing.

The cosine transform extends a run evenly at its ends, so that a trend makes no jump there; for
stationary noise its coefficients are nearly uncorrelated, with the spectrum of the noise as
their variance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import dct, idct
from scipy.special import chdtri, fdtri

from winchkit.arrays import Array
from winchkit.diagnosis.data.sampling import bridged

_BUTTERWORTH_ORDER = 4
"""Order of the zero-phase low-pass of the torque; convention of robot identification (forward and
backward Butterworth filter)."""
_BANDS = 14
"""Logarithmic noise bands per output without repeats, and of the Wiener filter; screened."""
_NARROW = 24
"""Logarithmic noise bands per output with repeats, before smoothing; screened."""
_CURVATURE_STD = 0.25
"""Prior standard deviation of the difference of the log spectrum between bands: the second one of
repeats, the first one of a robot in motion; rule of thumb: two thirds of it changed the set of one
of twelve cases of the screening."""
_ITERATIONS = 25
"""Fisher scoring steps of the penalised Whittle fit, always all; numerical."""
_LEAST_COEFFICIENTS = 8
"""Coefficients that a wide band must hold; screened."""
_LARGEST_FACTOR = 23
"""Largest prime factor of the number of samples of a fast transform; computing cost, measured: up
to 23 at most twice the time of powers of two."""
_LEAST_CUT = 1000
"""Samples of a run from which it is cut to such a number; computing cost: below it a slow transform
takes less than 60 µs."""
WHOLE_TRANSITION = 3.0
"""In units of the cut-off: beyond it the low-pass passes about 10⁻⁴ of the amplitude."""


LOST_POWER = 0.01
"""Share of a signal's power beyond its noise that may lie above a cut-off."""
_BLOCK = 16_384
"""Longest block of a Welch spectrum, samples."""
_BLOCKS = 8
"""Least number of blocks of a Welch spectrum, overlapping by half."""
_LEVEL = 0.01
"""Level of the test of a spectrum against its noise, all frequencies together."""


def highest_frequency(
    values: Array, rate: float, signals: int = 1, lost: float = LOST_POWER
) -> float:
    """Frequency above which no more than a share of a signal's power beyond its white noise is, Hz.

    The share is 1 % by default, and 0 for the highest frequency that exceeds the noise. The noise
    is that of the upper half of the frequencies, from the median of Welch's spectrum. A frequency
    counts where its power exceeds the noise by an F test at 1 % for all frequencies and signals
    together (Bonferroni). A block has two degrees of freedom: under this window, blocks that
    overlap by half are nearly independent (ρ² = 0.002). Neighbouring frequencies are not, and a
    median has 2/π of the efficiency of a mean: of the noise 1/π of the degrees of freedom count.

    References
    ----------
    Welch, P. D. (1967). IEEE Trans. Audio Electroacoust. 15, 70-73.
    """
    length = min(len(values) // _BLOCKS, _BLOCK)
    if length < _BLOCKS or not np.isfinite(values).any():
        return 0.0
    frequency, power = np.arange(length // 2 + 1) * rate / length, _welch(bridged(values), length)
    upper = power[frequency > rate / 4]
    dof = 2 * (2 * len(values) / length - 1)
    noise = float(np.median(upper) * dof / chdtri(dof, 0.5))
    level = _LEVEL / (signals * len(frequency))
    limit = noise * float(fdtri(dof, dof * len(upper) / np.pi, 1 - level))
    power_above = np.cumsum(np.where(power > limit, power - noise, 0.0)[::-1])[::-1]
    if not power_above[0]:
        return 0.0
    last = int(np.flatnonzero(power_above > lost * power_above[0])[-1])
    return float(frequency[min(last + 1, len(frequency) - 1)])


def _welch(values: Array, length: int) -> Array:
    """Mean power of windowed blocks that overlap by half, (length // 2 + 1,), any unit."""
    blocks = np.lib.stride_tricks.sliding_window_view(values, length)[:: max(1, length // 2)]
    # A ramp over many turns leaks over all frequencies through a Hann window.
    turn = 2 * np.pi * np.arange(length) / length
    window = 3 / 8 - np.cos(turn) / 2 + np.cos(2 * turn) / 8
    spectra = np.fft.rfft(_without_ramp(blocks) * window, axis=-1)
    return np.asarray(np.mean(np.abs(spectra) ** 2, axis=0))


def _without_ramp(values: Array) -> Array:
    """Remove mean and slope along the last axis."""
    x = np.arange(values.shape[-1]) - (values.shape[-1] - 1) / 2
    slope = (values @ x / (x @ x))[..., None]
    return np.asarray(values - values.mean(axis=-1, keepdims=True) - slope * x)


@dataclass(frozen=True)
class Band:
    """The coefficients that are kept of one output of one run."""

    count: int
    """Samples of the run."""
    rate: float
    """Samples per second."""
    cut_off: float | None = None
    """Low-pass, Hz; None keeps all."""
    kept_cut_offs: float = 1.0
    """Coefficients are kept up to this many cut-offs."""

    @cached_property
    def frequency(self) -> Array:
        """Frequency of every kept coefficient, Hz, (kept,)."""
        frequency = np.arange(self.count) * self.rate / (2 * self.count)
        if self.cut_off is None:
            return frequency
        return frequency[frequency <= self.kept_cut_offs * self.cut_off]

    @cached_property
    def gain(self) -> Array:
        """Gain of a Butterworth filter run forward and backward: 1 / (1 + (f/fc)^2N) with N = 4."""
        frequency = self.frequency
        if self.cut_off is None:
            return np.ones_like(frequency)
        return 1 / (1 + (frequency / self.cut_off) ** (2 * _BUTTERWORTH_ORDER))


def to_frequency(signal: Array, band: Band) -> Array:
    """Coefficients of a signal, (n,) or (many, n), within its band, (kept,) or (many, kept)."""
    full: Array = np.asarray(dct(signal, type=2, norm="ortho"))
    gain = band.gain
    return full[..., : len(gain)] * gain


def fast_count(count: int) -> int:
    """Largest number of samples, at most ``count``, whose transform is fast.

    A transform of n samples takes a time in proportion to the prime factors of n: 8998 = 2·11·409
    samples take ten times as long as 8993 = 17·23². At most 1.3 % of a run is left out, the largest
    gap between such numbers above 1000; shorter runs are kept whole.
    """
    if count < _LEAST_CUT:
        return count
    while _largest_factor(count) > _LARGEST_FACTOR:
        count -= 1
    return count


def _largest_factor(count: int) -> int:
    """Largest prime factor up to 23 of a number, or what is left without these."""
    largest = 1
    for factor in range(2, _LARGEST_FACTOR + 1):
        while count % factor == 0:
            count //= factor
            largest = factor
    return max(largest, count)


def to_time(coefficients: Array, band: Band) -> Array:
    """Signal of coefficients, shape (band.count,)."""
    full = np.zeros(band.count)
    full[: len(coefficients)] = coefficients
    return np.asarray(idct(full, type=2, norm="ortho"))


def low_pass(signal: Array, rate: float, cut_off: float) -> Array:
    """Zero-phase 4th-order Butterworth low-pass; ``cut_off``, Hz, leaves half of the amplitude."""
    band = Band(len(signal), rate, cut_off, kept_cut_offs=np.inf)
    return to_time(to_frequency(signal, band), band)


def narrow_edges(frequency: Array) -> Array:
    """Edges of 24 logarithmic bands of sorted frequencies, merged where one holds none."""
    positive = frequency[frequency > 0]
    if len(positive) < 2:
        return np.array([-np.inf, np.inf])
    wanted = np.geomspace(positive[0], positive[-1], _NARROW + 1)[1:-1]
    owner = np.searchsorted(positive, wanted)
    inner = wanted[np.diff(owner, prepend=0, append=len(positive))[:-1] > 0]
    return np.array([-np.inf, *inner.tolist(), np.inf])


def smoothed(power: Array, dof: Array, order: int = 2) -> tuple[Array, Array]:
    """Smooth the logarithm of a spectrum over its bands; with the degrees of freedom of the result.

    Penalised Whittle likelihood: ν power / σ² is χ²(ν), and ln σ² has differences of the given
    order with zero mean and standard deviation 0.25. Beyond bands with many degrees of freedom the
    spectrum continues as a line (order 2) or a constant (1). It is maximised by Fisher scoring with
    working weights ν/2; the degrees of freedom are 2 / Var(ln power).

    References
    ----------
    Whittle, P. (1953). Ark. Mat. 2, 423-434.
    Pawitan, Y., O'Sullivan, F. (1994). J. Am. Stat. Assoc. 89, 600-610.
    """
    count = len(power)
    if count < 3:
        return power, dof
    differences = np.diff(np.eye(count), order, axis=0)
    penalty = differences.T @ differences / _CURVATURE_STD**2
    weight = np.diag(np.maximum(dof, 1e-6) / 2)
    level = np.log(power)
    eta = np.linalg.solve(weight + penalty, weight @ level)
    for _ in range(_ITERATIONS):
        # A band far below its neighbours may pull the logarithm down by one step only.
        working = eta + np.clip(power / np.exp(eta) - 1, -1.0, 3.0)
        eta = np.linalg.solve(weight + penalty, weight @ working)
    covariance = np.linalg.inv(weight + penalty)
    return np.exp(eta), 2 / np.diag(covariance)


def band_edges(frequency: Array, copies: int) -> Array:
    """Edges of about 14 logarithmic bands that each hold at least eight sorted frequencies."""
    positive = frequency[frequency > 0]
    if len(positive) < 2 * _LEAST_COEFFICIENTS:
        return np.array([-np.inf, np.inf])
    wanted = np.geomspace(positive[0], positive[-1], _BANDS + 1)[1:-1]
    edges = [-np.inf]
    for edge in wanted:
        inside = np.count_nonzero((frequency >= edges[-1]) & (frequency < edge)) * copies
        beyond = np.count_nonzero(frequency >= edge) * copies
        if inside >= _LEAST_COEFFICIENTS and beyond >= _LEAST_COEFFICIENTS:
            edges.append(float(edge))
    return np.array([*edges, np.inf])

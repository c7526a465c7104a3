"""Signals in frequency: an orthonormal cosine transform, the torque's low-pass, noise bands.

The cosine transform (DCT-II) extends a run evenly at its ends, so a trend makes no jump there;
for stationary noise its coefficients are independent, with the noise's spectrum as variance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import dct, idct

from winchkit.arrays import Array

__all__ = [
    "WHOLE_FILTER",
    "Band",
    "band_edges",
    "low_pass",
    "narrow_edges",
    "smoothed",
    "to_frequency",
    "to_time",
    "torque_band",
]

_BUTTERWORTH_ORDER = 4
_TORQUE_BAND = 20.0
_BANDS = 14
_NARROW = 24
_BEND = 0.25
_ITERATIONS = 25
_FEWEST = 8
WHOLE_FILTER = 3.0
"""Beyond this many times its cut-off the low-pass leaves a 10⁻⁴: nothing worth counting."""


def torque_band(rate: float) -> float:
    """Cut-off of the torque's low-pass: 20 Hz or a tenth of the sampling rate, Hz (DESIGN)."""
    return min(_TORQUE_BAND, rate / 10)


@dataclass(frozen=True)
class Band:
    """What of one output of one run is kept in frequency."""

    count: int
    """Samples of the run."""
    rate: float
    """Samples per second."""
    cut_off: float | None = None
    """Low-pass, Hz; None keeps all."""
    skirt: float = 1.0
    """How far beyond the cut-off coefficients are kept, in units of it."""

    @cached_property
    def frequency(self) -> Array:
        """Of every kept coefficient, Hz, shape (kept,)."""
        frequency = np.arange(self.count) * self.rate / (2 * self.count)
        if self.cut_off is None:
            return frequency
        return frequency[frequency <= self.skirt * self.cut_off]

    @cached_property
    def gain(self) -> Array:
        """Of a Butterworth filter run forward and backward, shape (kept,)."""
        frequency = self.frequency
        if self.cut_off is None:
            return np.ones_like(frequency)
        return 1 / (1 + (frequency / self.cut_off) ** (2 * _BUTTERWORTH_ORDER))


def to_frequency(signal: Array, band: Band) -> Array:
    """Coefficients of a signal within its band, shape (kept,); of several, (many, kept)."""
    full: Array = np.asarray(dct(signal, type=2, norm="ortho"))
    gain = band.gain
    return full[..., : len(gain)] * gain


def to_time(coefficients: Array, band: Band) -> Array:
    """Signal of coefficients, shape (band.count,)."""
    full = np.zeros(band.count)
    full[: len(coefficients)] = coefficients
    return np.asarray(idct(full, type=2, norm="ortho"))


def low_pass(signal: Array, rate: float, cut_off: float) -> Array:
    """Zero-phase 4th-order Butterworth low-pass of a signal without gaps, shape (n,)."""
    full = np.asarray(dct(signal, type=2, norm="ortho"))
    frequency = np.arange(len(signal)) * rate / (2 * len(signal))
    gain = 1 / (1 + (frequency / cut_off) ** (2 * _BUTTERWORTH_ORDER))
    return np.asarray(idct(full * gain, type=2, norm="ortho"))


def narrow_edges(frequency: Array) -> Array:
    """Edges of narrow logarithmic bands, none without a coefficient of ``frequency`` (Hz, sorted).

    Returns shape (bands + 1,), open ends.
    """
    positive = frequency[frequency > 0]
    if len(positive) < 2:
        return np.array([-np.inf, np.inf])
    wanted = np.geomspace(positive[0], positive[-1], _NARROW + 1)[1:-1]
    owner = np.searchsorted(positive, wanted)
    inner = wanted[np.diff(owner, prepend=0, append=len(positive))[:-1] > 0]
    return np.array([-np.inf, *inner.tolist(), np.inf])


def smoothed(power: Array, dof: Array) -> tuple[Array, Array]:
    """A spectrum whose logarithm bends slowly from band to band, and its degrees of freedom.

    Low bands hold few coefficients, and the noise of instruments has no lines there: penalised
    maximum likelihood of gamma-distributed powers (Whittle), by iterated least squares. A band
    with many coefficients keeps what it shows.
    """
    count = len(power)
    if count < 3:
        return power, dof
    bend = np.diff(np.eye(count), 2, axis=0)
    stiff = bend.T @ bend / _BEND**2
    weight = np.diag(np.maximum(dof, 1e-6) / 2)
    level = np.log(power)
    eta = np.linalg.solve(weight + stiff, weight @ level)
    for _ in range(_ITERATIONS):
        # A band far below its neighbours may pull the logarithm down by one step only.
        working = eta + np.clip(power / np.exp(eta) - 1, -1.0, 3.0)
        eta = np.linalg.solve(weight + stiff, weight @ working)
    covariance = np.linalg.inv(weight + stiff)
    return np.exp(eta), 2 / np.diag(covariance)


def band_edges(frequency: Array, copies: int) -> Array:
    """Edges of about 14 logarithmic bands that each hold enough of ``frequency`` (Hz, sorted).

    ``copies`` is how many independent spectra are pooled. Returns shape (bands + 1,), open ends.
    """
    positive = frequency[frequency > 0]
    if len(positive) < 2 * _FEWEST:
        return np.array([-np.inf, np.inf])
    wanted = np.geomspace(positive[0], positive[-1], _BANDS + 1)[1:-1]
    edges = [-np.inf]
    for edge in wanted:
        inside = np.count_nonzero((frequency >= edges[-1]) & (frequency < edge)) * copies
        beyond = np.count_nonzero(frequency >= edge) * copies
        if inside >= _FEWEST and beyond >= _FEWEST:
            edges.append(float(edge))
    return np.array([*edges, np.inf])

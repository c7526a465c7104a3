"""A low-pass of the logger or the drive: a spectrum without noise of its own above a cut-off.

The noise of an instrument is nearly white up to half the sampling rate. Where the spectrum still
falls by 15 dB in the last octave, or has only the rounding of the file there, a filter of at least
third order or a long average was applied: neighbouring samples are then not independent. Filters of
lower order are not found: the spectra of sudden accelerations and steps fall as they do.

References
----------
Welch, P. D. (1967). IEEE Trans. Audio Electroacoust. 15, 70-73.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.quantisation import quantisation_noise

_BINS = 64
"""Frequencies of the spectrum up to half the sampling rate: blocks of 128 samples."""
_FALL = 30.0
"""Ratio of power densities an octave apart, 15 dB: steps fall by 6 and jumps of the speed by 12."""
_ROUNDING = 4.0
"""In variances of rounding: power below is that of the step of the numbers, not of a filter."""
_NUMERICAL = 1e-20
"""Share of the largest power; far above the square of the rounding of floating point (1e-32)."""
_REPEATED = 0.5
"""Share of samples equal to the one before from which the error of rounding is not white."""
_LOWEST = 4
"""Lowest bin of a cut-off: below, the spectrum of the motion itself falls as that of a filter
does."""
_LEAST_BLOCKS = 6
"""Averages below which a spectrum is too uncertain (40 %) to compare two bins; rule of thumb."""


def low_pass(run: Run, name: str, step: float) -> Iterator[Finding]:
    """A cut-off below half the sampling rate; value: frequency from which the noise falls, Hz."""
    values = run[name]
    if np.mean(np.diff(values) == 0) > _REPEATED:
        return  # the spectrum at high frequencies is that of the few changes
    power = _spectrum(values[np.isfinite(values)])
    if power is None:
        return
    middle, top = float(np.median(power[25:33])), float(np.median(power[50:62]))
    rounding = _ROUNDING * quantisation_noise(step) ** 2
    at_rounding = top <= max(rounding, _NUMERICAL * float(power.max()))
    if not at_rounding and middle < _FALL * top:
        return
    falls = power[_LOWEST:32] > _FALL * power[2 * _LOWEST : 64 : 2]
    if not falls.any():
        return
    rate = 1 / run.interval
    cut_off = (_LOWEST + int(np.argmax(falls))) / (2 * _BINS) * rate
    text = (
        f"the noise falls from about {cut_off:.2g} Hz on, at {rate:.3g} Hz: a low-pass of the "
        "drive or the logger; neighbouring samples are not independent"
    )
    yield Finding("low-pass", run.name, name, cut_off, text)


def _spectrum(values: Array) -> Array | None:
    """Power per bin from zero to half the rate: median of windowed blocks, (bins + 1,)."""
    length = 2 * _BINS
    count = len(values) // length
    if count < _LEAST_BLOCKS or np.ptp(values) == 0:
        return None
    blocks = values[: count * length].reshape(count, length)
    ramp = np.linspace(-1, 1, length)
    slope = blocks @ ramp / float(ramp @ ramp)
    blocks = blocks - blocks.mean(axis=1, keepdims=True) - slope[:, None] * ramp
    window = np.blackman(length)
    spectra = np.abs(np.fft.rfft(blocks * window, axis=1)) ** 2 / float(window @ window)
    return np.asarray(np.median(spectra, axis=0))

"""Resolution of a channel: the largest step of which all differences of samples are multiples.

The differences of a quantised channel are multiples of its step q, in any order of differencing, so
that the characteristic function of their distribution, mean cos(2π f d), is near 1 at f = 1/q. The
search takes its maxima from a histogram by FFT and tests each on the differences that are at
least half a step. Rounding by decimal printing or a conversion of units, and a slow signal on
top, make the differences deviate from multiples; deviations of 2 % of a step (rms) are allowed.

References
----------
Widrow, B., Kollar, I. (2008). Quantization Noise. Cambridge University Press.
Kendall, D. G. (1974). Hunting quanta. Phil. Trans. R. Soc. A 276, 231-266.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.local_noise import local_noise, smallest_differences
from winchkit.runs.sanity.sampling import with_lost_samples
from winchkit.runs.sanity.text import size

__all__ = ["quantisation_noise", "quantised", "resolution"]

_BINS = 8192
_BINS_PER_STEP = 16
"""Bins of the histogram within the smallest step that is looked for."""
_SEARCHED = 4 * _BINS // _BINS_PER_STEP + 2
"""Coefficients of the FFT of 4 _BINS values up to that step, and those beside them."""
_COHERENCE = 0.99
_EXACT = 1 - 2e-5
"""Mean cosine of deviations of a thousandth of a step: multiples, not close to multiples."""
_SCREENED = 0.8
_TIE = 0.005
_LEAST_DIFFERENCES = 30
_LEAST_SHARE = 0.2
"""Share of the differences beyond rounding that are at least half a step."""
_LEAST_LEVELS = 8
_FEW_LEVELS = 4
"""Exact levels of a command that changes in steps; with fewer, the values must be dithered."""
_SHORT = 3.0
"""Samples from a change of the level to the next or the last one, in the median, up to which noise
makes it: white noise near a limit of rounding crosses it in every second sample, a command stays
for many."""
_NEAR = 50
"""Steps up to which a difference is not affected by the uncertainty of the step."""
_MANY_MULTIPLES = 8
_USUAL = 0.9
_SCALES = (0.99, 0.5, 0.2)
"""Quantiles of the differences up to which the three searches take them."""
_MOST = 50_000
_REFINEMENTS = 4


def quantisation_noise(step: float) -> float:
    """Standard deviation of the error of rounding to multiples of ``step``: step/√12."""
    return step / sqrt(12)


def resolution(values: Array) -> float:
    """Step of a quantised channel.

    Parameters
    ----------
    values : (n,) array
        NaN where there is no value.

    Returns
    -------
    float
        In the unit of the values; 0 where no step is found, as for a step far below the noise.
    """
    few = values[:_MOST]
    differences, _ = smallest_differences(few)
    sizes = np.abs(differences)
    sizes = sizes[sizes > 0]
    if len(sizes) < _LEAST_DIFFERENCES:
        return 0.0
    for scale in _SCALES:
        own = sizes[sizes <= np.quantile(sizes, scale)]
        step, score = _largest_step(own)
        levels = _levels(few, step) if step and _steps_are_multiples(few, step) else 0
        least = _LEAST_LEVELS
        if score >= _EXACT:
            least = 2 if _is_dithered(few) else _FEW_LEVELS
        if levels >= least:
            return step
    return 0.0


def quantised(run: Run, name: str) -> Iterator[Finding]:
    """A channel whose resolution is not small against its noise; value: the step."""
    channel = run.channels[name]
    values = with_lost_samples(run.time, channel.values)
    step = resolution(values)
    if step and step >= local_noise(values):
        floor = quantisation_noise(step)
        yield Finding(
            "quantised",
            run.name,
            name,
            step,
            f"resolution {size(step, channel.unit)}: errors below "
            f"{size(floor, channel.unit)} (resolution/√12) are not judged",
        )


def _largest_step(sizes: Array) -> tuple[float, float]:
    """Largest step of which absolute differences are multiples, 0 without one, and its score."""
    if len(sizes) < _LEAST_DIFFERENCES:
        return 0.0, 0.0
    high = float(sizes.max())
    counts, _ = np.histogram(sizes, bins=_BINS, range=(0.0, high))
    spectrum = np.fft.rfft(counts, 4 * _BINS)[:_SEARCHED]
    frequency = np.arange(len(spectrum)) * _BINS / (4 * _BINS * high)
    # Bins are represented by their middle: half a bin of phase.
    coherence = np.real(spectrum * np.exp(-1j * np.pi * frequency * high / _BINS)) / len(sizes)
    inside = (frequency > 0.75 / high) & (frequency < _BINS / (_BINS_PER_STEP * high))
    peaks = np.flatnonzero(
        inside[1:-1]
        & (coherence[1:-1] >= coherence[:-2])
        & (coherence[1:-1] >= coherence[2:])
        & (coherence[1:-1] > _SCREENED)
    )
    tested = [_refined(sizes, 1 / float(frequency[peak + 1])) for peak in peaks[:_BINS_PER_STEP]]
    good = [(step, score) for step, score in tested if score >= _COHERENCE]
    if not good:
        return 0.0, 0.0
    best = max(score for _, score in good)
    return max((step, score) for step, score in good if score >= best - _TIE)


def _refined(sizes: Array, step: float) -> tuple[float, float]:
    """Step by least squares, and the mean cosine of the deviations from its multiples."""
    multiples = np.zeros(len(sizes))
    for _ in range(_REFINEMENTS):
        multiples = np.round(sizes / step)
        if not np.any(multiples):
            return step, 0.0
        step = float(sizes @ multiples / (multiples @ multiples))
    beyond = sizes[multiples >= 1]
    if len(beyond) < max(_LEAST_DIFFERENCES, _LEAST_SHARE * len(sizes)):
        return step, 0.0  # equal jumps of a continuous signal, such as a command's
    # Few different multiples far apart are those of a periodic signal with few samples a period.
    different = len(np.unique(multiples[multiples >= 1]))
    if different < min(_MANY_MULTIPLES, np.quantile(multiples, _USUAL) / 2):
        return step, 0.0
    return step, float(np.mean(np.cos(2 * np.pi * beyond / step)))


def _steps_are_multiples(values: Array, step: float) -> bool:
    """Whether also the first differences are multiples of a step that those of higher order are.

    Those of a wave with few samples a period have few values, which may be so by chance.
    """
    steps = np.abs(np.diff(values))
    steps = steps[np.isfinite(steps) & (steps > step / 2)]
    if len(steps) < _LEAST_DIFFERENCES:
        return False
    near = steps[steps < _NEAR * step]
    return len(near) < _LEAST_DIFFERENCES or bool(
        np.mean(np.cos(2 * np.pi * near / step)) >= _COHERENCE - _TIE
    )


def _is_dithered(values: Array) -> bool:
    """Whether noise changes the level of a channel."""
    changes = np.flatnonzero(np.diff(values[np.isfinite(values)]) != 0)
    if len(changes) < _LEAST_DIFFERENCES:
        return False
    apart = np.diff(changes)
    nearest = np.minimum(np.append(apart[:1], apart), np.append(apart, apart[-1:]))
    return float(np.median(nearest)) <= _SHORT


def _levels(values: Array, step: float) -> int:
    known = values[np.isfinite(values)]
    return len(np.unique(np.round((known - known[0]) / step)))

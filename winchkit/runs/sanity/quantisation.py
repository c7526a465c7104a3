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

from collections.abc import Iterator, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.local_noise import local_noise, smallest_differences, sorted_quantile
from winchkit.runs.sanity.sampling import with_lost_samples
from winchkit.schema.mapping import CHANNEL_DIMENSIONS

_BINS = 8192
"""Bins of the histogram of the differences: with `_BINS_PER_STEP` it shows steps down to 1/512 of
the largest difference."""
_BINS_PER_STEP = 16
"""Bins of the histogram within the smallest step that is looked for."""
_PADDED = 4 * _BINS
"""Values of the transform: a maximum lies within an eighth of a period of the largest difference
from a coefficient, where its mean cosine is still above _SCREENED."""
_SEARCHED = _PADDED // _BINS_PER_STEP + 2
"""Coefficients up to that step, and those beside them."""
_ROTATION = np.exp(-1j * np.pi * np.arange(_SEARCHED) / _PADDED)
_COHERENCE = 0.99
"""Mean cosine of differences over a step; 0.99 is a jitter of 2 % of the step (rms)."""
_EXACT = 1 - 2e-5
"""Mean cosine of deviations of a thousandth of a step: multiples, not close to multiples."""
_SCREENED = 0.8
_TIE = 0.005
"""Coherences that differ by less are equal, and the larger step is taken: its divisors fit as
well."""
_LEAST_DIFFERENCES = 30
"""Fewer differences fit some step by chance; rule of thumb."""
_LEAST_SHARE = 0.2
"""Share of the differences beyond rounding that are at least half a step."""
_LEAST_LEVELS = 8
"""Fewer levels occur in a signal at rest, which shows nothing of the step."""
_FEW_LEVELS = 4
"""Exact levels of a command that changes in steps; with fewer, the values must be dithered."""
_SHORT = 3.0
"""Samples from a change of the level to the next or the last one, in the median, up to which noise
makes it: white noise near a limit of rounding crosses it in every second sample, a command stays
for many."""
_NEAR = 50
"""Steps up to which a difference is not affected by the uncertainty of the step."""
_MANY_MULTIPLES = 8
"""Distinct multiples from which a common divisor of a few is excluded. Rule of thumb."""
_USUAL = 0.9
"""Quantile of the multiples that is compared: a few jumps do not count."""
_SCALES = (0.99, 0.5, 0.2)
"""Quantiles of the differences up to which the three searches take them."""
_MOST = 50_000
"""Samples that are searched: more add nothing to a step, and the search takes milliseconds."""
_MOST_DIGITS = 7
"""Significant digits of a printed value that are looked for: numbers of single precision have
more, and no instrument resolves them."""
_DECIMAL = 1e-13
"""Rounding error of a decimal number and of its conversion to another unit; numerical."""
_REFINEMENTS = 4
"""Steps of the refinement, which converges in two or three."""


def quantisation_noise(step: float) -> float:
    """Standard deviation of the error of rounding to multiples of ``step``: step/√12."""
    return step / sqrt(12)


def resolution(values: Array) -> float:
    """Step of a quantised channel (n,); 0 where none is found, as for one far below the noise."""
    few = values[:_MOST]
    differences, _ = smallest_differences(few)
    sizes = np.abs(differences)
    sizes = np.sort(sizes[sizes > 0])
    if len(sizes) < _LEAST_DIFFERENCES:
        return 0.0
    for scale in _SCALES:
        own = sizes[: np.searchsorted(sizes, sorted_quantile(sizes, scale), side="right")]
        step, score = _largest_step(own)
        levels = _levels(few, step) if step and _steps_are_multiples(few, step) else 0
        least = _LEAST_LEVELS
        if score >= _EXACT:
            least = 2 if _is_dithered(few) else _FEW_LEVELS
        if levels >= least:
            return step
    return 0.0


def printed_resolution(values: Array) -> float:
    """Step, rms, of values (n,) printed with seven significant digits or fewer; 0 for others.

    The step of such a value follows its magnitude, so that it is no common step of a channel:
    1.00001 and 0.100001 beside each other, as the default of C++ streams and %g write them.
    """
    sizes = np.abs(values[np.isfinite(values) & (values != 0.0)])[:_MOST]
    if len(sizes) < _LEAST_DIFFERENCES:
        return 0.0
    decade = 10.0 ** np.floor(np.log10(sizes))
    for digits in range(1, _MOST_DIGITS + 1):
        steps = decade * 10.0 ** (1 - digits)
        if np.all(np.abs(sizes / steps - np.round(sizes / steps)) < _DECIMAL * 10.0**digits):
            return float(np.sqrt(np.mean(steps**2)))
    return 0.0


def resolutions(run: Run) -> dict[str, float]:
    """Resolution of every channel of the model, in its unit, from differences without a gap."""
    return {
        name: resolution(with_lost_samples(run.time, run[name]))
        for name in run
        if name.rpartition(".")[2] in CHANNEL_DIMENSIONS
    }


def shared_resolutions(runs: Sequence[Run]) -> list[dict[str, float]]:
    """Resolutions of each run; of a channel that shows none, the largest of the other runs, if its
    values are multiples of that.
    """
    found = [resolutions(run) for run in runs]
    out = []
    for run, own in zip(runs, found, strict=True):
        known = dict(own)
        for name in (name for name, step in own.items() if not step):
            shared = max(each.get(name, 0.0) for each in found)
            if shared and _steps_are_multiples(run[name], shared, least=1):
                known[name] = shared
        out.append(known)
    return out


def quantised(run: Run, name: str, step: float) -> Iterator[Finding]:
    """A channel whose resolution ``step`` is not small against its noise; value: the step."""
    channel = run.channels[name]
    if step and step >= local_noise(with_lost_samples(run.time, channel.values)):
        floor = quantisation_noise(step)
        yield Finding(
            "quantised",
            run.name,
            name,
            step,
            f"resolution {quantity(step, channel.unit)}: errors below "
            f"{quantity(floor, channel.unit)} (resolution/√12) are not judged",
        )


def _largest_step(sizes: Array) -> tuple[float, float]:
    """Largest step of which sorted sizes are multiples, 0 without one, and its score."""
    if len(sizes) < _LEAST_DIFFERENCES:
        return 0.0, 0.0
    high = float(sizes[-1])
    counts = np.bincount((sizes * (_BINS / high)).astype(int).clip(max=_BINS - 1), minlength=_BINS)
    frequency = np.arange(_SEARCHED) * _BINS / (_PADDED * high)
    coherence = _cosine_sums(counts) / len(sizes)
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


def _cosine_sums(counts: NDArray[np.intp]) -> Array:
    """Σ counts[n] cos(2πk(n + ½)/_PADDED) at the first frequencies k, (_SEARCHED,).

    This is a DCT-II of half as many values, by a real FFT of the same length (Makhoul 1980, IEEE
    Trans. Acoust. Speech Signal Process. 28, 27-34).
    """
    ordered = np.zeros(_PADDED // 2)
    ordered[: _BINS // 2], ordered[-_BINS // 2 :] = counts[::2], counts[::-2]
    spectrum = np.fft.rfft(ordered)[:_SEARCHED]
    return np.asarray(np.real(spectrum * _ROTATION))


def _refined(sizes: Array, step: float) -> tuple[float, float]:
    """Step by least squares of sorted sizes, and mean cosine of their deviations from multiples."""
    multiples = np.zeros(len(sizes))
    for _ in range(_REFINEMENTS):
        before, multiples = multiples, np.round(sizes / step)
        if not multiples[-1]:
            return step, 0.0
        if np.array_equal(before, multiples):
            break
        step = float(sizes @ multiples / (multiples @ multiples))
    beyond = sizes[np.searchsorted(multiples, 1) :]
    if len(beyond) < max(_LEAST_DIFFERENCES, _LEAST_SHARE * len(sizes)):
        return step, 0.0  # equal jumps of a continuous signal, such as a command's
    # Few different multiples far apart are those of a periodic signal with few samples a period.
    different = np.count_nonzero(np.diff(multiples, prepend=0.0))
    if different < _MANY_MULTIPLES and different < sorted_quantile(multiples, _USUAL) / 2:
        return step, 0.0
    return step, float(np.mean(np.cos(2 * np.pi * beyond / step)))


def _steps_are_multiples(values: Array, step: float, least: int = _LEAST_DIFFERENCES) -> bool:
    """Whether also the first differences are multiples of a step that those of higher order are, or
    those of another run.

    Those of a wave with few samples a period have few values, which may be so by chance; ``least``
    are needed.
    """
    steps = np.abs(np.diff(values))
    steps = steps[np.isfinite(steps) & (steps > step / 2)]
    if len(steps) < least:
        return False
    near = steps[steps < _NEAR * step]
    return len(near) < least or bool(np.mean(np.cos(2 * np.pi * near / step)) >= _COHERENCE - _TIE)


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

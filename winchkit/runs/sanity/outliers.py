"""Outliers: single samples far from both neighbours, as transmission errors make them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.local_noise import sorted_quantile
from winchkit.runs.sanity.quantisation import quantisation_noise, resolution
from winchkit.schema.mapping import CHANNEL_DIMENSIONS

_LIMIT = 12.0
"""Local standard deviations: beyond 8 in none of 10¹⁵ Gaussian samples, and room for tails."""
_AGREEMENT = 0.25
"""Largest range of the four neighbours, in deviations of the sample."""
_STEPS = 8
"""Steps of a local slope, four on each side: the sample itself and one more spike take four."""
_PERIODS = (2, 3)
"""Samples between the extremes of an oscillation that look like spikes: at a quarter of the rate
they alternate, at a third each is a period. Errors of transmission in 1 % of the samples are so
once in 5000."""
_END = 3.0
"""Largest other steps of a run in the step from its first sample, or to its last one."""
_SAME_EVENT = 4.0
"""Local standard deviations of another channel at the same time, with which a peak is physical."""
_LEVEL = 0.01
"""Level of the test that spikes coincide with deviations of other channels by chance."""
_WINDOW = 50
"""Samples of a local median: the scale follows the motion, and is known to 16 %."""
_MAD = 0.6745
"""Median of the absolute value of a standard normal variable."""


def outlier_mask(values: Array) -> NDArray[np.bool_]:
    """Samples of one channel that are spikes, (n,).

    The deviation from the median of two neighbours on each side, less the local slope (the median
    of the eight nearest steps), exceeds twelve local standard deviations (of the deviations, by
    their median over 50 samples), and the neighbours agree within a quarter of it. Where one of the
    two at a distance of two samples deviates as much, it is left out: of two spikes with one sample
    between them, neither hides the other. A peak that lasts two samples, a step, or an oscillation
    is none; an oscillation at a quarter or a third of the rate has three or more of them at equal
    distances. The first and the last sample have neighbours on one side: they are spikes where the
    step to the next sample exceeds twelve standard deviations and three times the largest other
    step, and the next four samples agree.
    """
    spikes, _, ends = _spikes(values, resolution(values))
    return spikes | ends


def outlier_masks(run: Run, resolutions: Mapping[str, float]) -> dict[str, NDArray[np.bool_]]:
    """Masks (n,) of channels with spikes that no other channel of the same winch shares.

    A peak of the force that lasts one sample, as at a jerk, appears in several channels at the same
    time: it is none. Spikes of independent transmission errors coincide too: each with a deviation
    of another channel as often as that channel deviates. Peaks are physical where the spikes of a
    channel coincide with more deviations, counted over the other channels, than as many rows drawn
    at random (level 1 %): at a jerk, several channels deviate together. A position cannot leave and
    return within two samples: its peaks are spikes, and no evidence that others are physical, as
    its other deviations are. A first or last row of another moment differs in several channels.
    """
    names = [name for name in run if name.rpartition(".")[2] in CHANNEL_DIMENSIONS]
    found = {name: _spikes(run[name], resolutions[name]) for name in names}
    out = {}
    for name, (spikes, _, ends) in found.items():
        if ends.any():
            out[name] = ends
        if not spikes.any():
            continue
        winch = name.rpartition(".")[0]
        others = {
            n: f for n, f in found.items() if n != name and n.rpartition(".")[0] in {"", winch}
        }
        corrupt = {n: _within_one(own) for n, (own, _, _) in others.items() if is_position(n)}
        none = np.zeros_like(spikes)
        beside = [shared & ~corrupt.get(n, none) for n, (_, shared, _) in others.items()]
        physical = _physical(spikes, beside) & ~np.any([none, *corrupt.values()], axis=0)
        alone = spikes & (is_position(name) | ~physical)
        if alone.any():
            out[name] = alone | ends
    return out


def is_position(name: str) -> bool:
    """Whether a channel has the dimension of an angle or a length."""
    return CHANNEL_DIMENSIONS[name.rpartition(".")[2]] in {"angle", "length"}


def outliers(run: Run, masks: Mapping[str, NDArray[np.bool_]]) -> Iterator[Finding]:
    """Spikes of the channels; value: largest deviation."""
    for name, spikes in masks.items():
        largest = spike_size(run[name], spikes)
        yield Finding(
            "outliers",
            run.name,
            name,
            largest,
            f"{_many(int(np.count_nonzero(spikes)))} {quantity(largest, run.channels[name].unit)} "
            f"left out of {len(run)} samples",
        )


def _many(spikes: int) -> str:
    return "1 spike of" if spikes == 1 else f"{spikes} spikes of up to"


def spike_size(values: Array, spikes: NDArray[np.bool_]) -> float:
    """Largest distance of the spikes from the line between the other samples; 0 without any."""
    if not spikes.any():
        return 0.0
    good = ~spikes & np.isfinite(values)
    between = np.interp(np.flatnonzero(spikes), np.flatnonzero(good), values[good])
    return float(np.max(np.abs(values[spikes] - between)))


def _spikes(
    values: Array, step: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Spikes, samples whose deviation is large enough to be the same event, and ends apart.

    Of several spikes close together some hide others: the search is repeated without those found.
    """
    out, event, ends = _search(values, step)
    found = out
    while found.any():
        found = _search(np.where(out, np.nan, values), step)[0]
        out = out | found
    return out & ~_oscillates(out), event, ends


def _oscillates(spikes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Spikes that are periods of an oscillation: three or more, each as far from the last one."""
    found = np.zeros_like(spikes)
    for period in _PERIODS:
        middle = np.zeros_like(spikes)
        middle[period:-period] = (
            spikes[2 * period :] & spikes[period:-period] & spikes[: -2 * period]
        )
        found |= middle
        found[period:] |= middle[:-period]
        found[:-period] |= middle[period:]
    return found


def _search(
    values: Array, step: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Spikes, events and ends of one search."""
    out, event, ends = (np.zeros(len(values), dtype=bool) for _ in range(3))
    rows = np.flatnonzero(np.isfinite(values))
    known = values[rows]
    if len(known) < _WINDOW:
        return out, event, ends
    slope = _slope(known)[2:-2]
    around = np.stack([known[:-4], known[1:-3], known[3:-1], known[4:]])
    around += np.array([[2.0], [1.0], [-1.0], [-2.0]]) * slope
    deviation = np.abs(known[2:-2] - _median_of_four(*around))
    # Neighbours that are equal in a quantised or held channel have a local deviation of zero.
    usual = np.minimum(deviation, sorted_quantile(np.sort(deviation), 0.95))
    floor = float(np.sqrt(np.mean(usual**2)))
    scale = np.maximum(_local(deviation), max(floor, quantisation_noise(step)))
    large = deviation > _LIMIT * scale
    before, after = np.append([False, False], large[:-2]), np.append(large[2:], [False, False])
    around[0] = np.where(before & ~after, around[1], around[0])
    around[3] = np.where(after & ~before, around[2], around[3])
    agree = np.ptp(around, axis=0) < _AGREEMENT * deviation
    out[rows[2:-2][large & agree]] = True
    event[rows[2:-2][deviation > _SAME_EVENT * scale]] = True
    ends[rows[0]] = _is_apart(known, float(scale[0]))
    ends[rows[-1]] = _is_apart(known[::-1], float(scale[-1]))
    return out, event, ends


def _is_apart(values: Array, scale: float) -> bool:
    """Whether the first value is no sample of the signal that follows it."""
    steps = np.abs(np.diff(values))
    limit = max(_LIMIT * scale, _END * float(np.max(steps[1:])))
    return bool(steps[0] > limit and np.ptp(values[1:5]) < _AGREEMENT * steps[0])


def _slope(values: Array) -> Array:
    """Change per sample: median of the nearest steps, of which a spike has one up and one down."""
    steps = np.diff(values)
    median = np.median(np.lib.stride_tricks.sliding_window_view(steps, _STEPS), axis=1)
    return np.pad(median, _STEPS // 2, mode="edge")


def _median_of_four(a: Array, b: Array, c: Array, d: Array) -> Array:
    largest_of_low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    smallest_of_high = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return (largest_of_low + smallest_of_high) / 2


def _physical(spikes: NDArray[np.bool_], beside: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """Spikes at which other channels deviate; none where that is chance."""
    deviating = sum(map(_within_one, beside), np.zeros(len(spikes), dtype=int))
    count, trials = int(np.sum(deviating[spikes])), int(np.count_nonzero(spikes))
    shares = np.bincount(deviating) / len(spikes)
    if not count or _chance(count, trials, shares) >= _LEVEL:
        return np.zeros_like(spikes)
    return np.asarray(spikes & (deviating > 0))


def _chance(count: int, trials: int, shares: Array) -> float:
    """Probability of a sum of at least ``count`` in ``trials`` draws, a k having ``shares[k]``."""
    length = trials * (len(shares) - 1) + 1
    transform = np.fft.fft(shares, max(length, len(shares))) ** trials
    return float(np.fft.ifft(transform).real[count:].sum())


def _within_one(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples of which one or a neighbour is in the mask."""
    out = mask.copy()
    out[1:] |= mask[:-1]
    out[:-1] |= mask[1:]
    return out


def _local(deviation: Array) -> Array:
    """Standard deviation from the median of the deviations in blocks, the larger of two blocks."""
    count = len(deviation) // _WINDOW
    if count == 0:
        return np.full(len(deviation), float(np.median(deviation)) / _MAD)
    blocks = deviation[: count * _WINDOW].reshape(count, _WINDOW)
    medians = np.median(blocks, axis=1)
    wide = np.maximum(medians, np.maximum(np.append(medians[1:], 0), np.append(0, medians[:-1])))
    local = np.repeat(wide / _MAD, _WINDOW)
    return np.append(local, np.full(len(deviation) - len(local), local[-1]))

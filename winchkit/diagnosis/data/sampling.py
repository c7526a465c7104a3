"""Sampling of a run: missing samples, gaps in time, and stamps that jitter."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.smoothing_spline import SmoothingSpline
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.repeated_values import REPEATED

Mask = NDArray[np.bool_]

_GAP = 2.5
"""Shortest gap in median sampling intervals (rule of thumb: one missing sample and jitter)."""

_HELD = 3
"""Rows from which an angle is held: every second row may be one of two clocks in step."""
_SAME = 1e-3
"""Deviation of stamps from even instants, in steps, that is none (as in the even clock)."""
_LEAST_STAMPS = 16
"""Stamps from which a period is estimated."""
_BINS = 8
"""Bins per median step of the stamps' spectrum."""
_FINER = 32
"""Steps of a frequency within that spectrum's resolution."""
_MOST_BINS = 8_000_000
"""Bins above which no period is estimated; computing cost."""


def bridged(values: Array) -> Array:
    """Values with missing ones (NaN) interpolated linearly; the nearest value beyond both ends."""
    known = np.isfinite(values)
    if known.all():
        return values
    index = np.arange(len(values))
    return np.interp(index, index[known], values[known])


def bridged_channel(run: Run, name: str) -> Array | None:
    """A channel of a run with missing values interpolated, (n,); None without any value."""
    return bridged(run[name]) if name in run and np.isfinite(run[name]).any() else None


def gaps(time: Array) -> NDArray[np.intp]:
    """Indices of the last samples before gaps, (k,)."""
    steps = np.diff(time)
    return np.flatnonzero(steps > _GAP * np.median(steps))


def even_instants(time: Array, angle: Array) -> Array | None:
    """Even sampling instants of a run whose stamps jitter, some of them missing.

    None is returned where the stamps are even but for lost samples, or where the restricted
    likelihood of the angle's smoothing spline is larger over the stamps: a logger may sample evenly
    and stamp late, or sample whenever it has time.
    """
    if SamplingTimes(time).even or len(time) < _LEAST_STAMPS or not np.ptp(angle):
        return None
    instants = _nearest_even(time - time[0])
    step = float(np.median(np.diff(time)))
    if instants is None or np.max(np.abs(instants - (time - time[0]))) <= _SAME * step:
        return None
    stamped = SmoothingSpline.fit(time - time[0], angle)
    even = SmoothingSpline.fit(instants - instants[0], angle)
    return time[0] + instants if even.deviance < stamped.deviance else None


def _nearest_even(time: Array) -> Array | None:
    """Multiples of the most regular period nearest to the stamps; None where two coincide.

    The period is that of the largest peak of the stamps' own spectrum (Bartlett, M. S., 1963, J. R.
    Statist. Soc. B 25, 264-296) within a third of the median rate.
    """
    bin_width = float(np.median(np.diff(time))) / _BINS
    count = int(time[-1] / bin_width) + 1
    if count > _MOST_BINS:
        return None
    counts = np.bincount((time / bin_width).astype(np.intp), minlength=count).astype(float)
    power = np.abs(np.fft.rfft(counts - counts.mean()))
    low, high = 2 * count // (3 * _BINS), min(4 * count // (3 * _BINS), len(power) - 1)
    peak = low + int(np.argmax(power[low : high + 1]))
    near = (peak + np.linspace(-1.0, 1.0, 2 * _FINER + 1)) / (count * bin_width)
    sums = np.array([np.sum(np.exp(2j * np.pi * frequency * time)) for frequency in near])
    best = int(np.argmax(np.abs(sums)))
    frequency, phase = near[best], np.angle(sums[best]) / (2 * np.pi)
    number = np.round(time * frequency - phase)
    step, start = np.polyfit(number, time, 1)
    number = np.round((time - start) / step)
    if np.any(np.diff(number) < 1):
        return None
    step, start = np.polyfit(number, time, 1)
    return np.asarray(start + step * number)


def at_new_angles(runs: Sequence[Run], findings: Iterable[Finding]) -> tuple[list[Run], list[str]]:
    """Runs whose motor angle was held over most rows, at the rows of its new values, and notes.

    Differences of a held angle are zero but for steps. At rest the rows go on at the usual number
    of rows that a value is held.
    """
    held = {f.run for f in findings if (f.code, f.channel) == (REPEATED, "motor_angle")}
    out, notes = [], []
    for run in runs:
        angle = run["motor_angle"]
        new = np.flatnonzero(np.concatenate([[True], np.diff(bridged(angle)) != 0]))
        usual = round(float(np.median(np.diff(new)))) if len(new) > 1 else 1
        if run.name not in held or usual < _HELD:
            out.append(run)
            continue
        ends = [*new.tolist(), len(run)]
        rows = [
            row for a, b in pairwise(ends) for row in range(a, max(a + 1, b - usual // 2), usual)
        ]
        channels = {n: replace(c, values=c.values[rows]) for n, c in run.channels.items()}
        out.append(replace(run, time=run.time[rows], channels=channels))
        notes.append(
            f"{run.name}: the motor angle is new in every {usual}th row only; of {len(run)} rows "
            f"the {len(rows)} at its new values are compared"
        )
    return out, notes


def away_from(unknown: Mask, reach: int) -> Mask:
    """Samples whose differences over ``reach`` samples use no unknown one, (n,); samples beyond
    both ends of a run are unknown too."""
    padded = np.pad(unknown, reach, constant_values=True).astype(float)
    return np.convolve(padded, np.ones(2 * reach + 1), mode="valid") < 0.5


def evenly_stamped(runs: Sequence[Run]) -> tuple[list[Run], list[str]]:
    """Runs at even sampling instants where their stamps jitter about them, and notes on these."""
    out, notes = [], []
    for run in runs:
        instants = even_instants(run.time, bridged(run["motor_angle"]))
        if instants is not None:
            jitter = float(np.std(run.time - instants))
            notes.append(
                f"{run.name}: the stamps jitter by {jitter:.2g} s about even sampling instants, at "
                "which the motor angle is a smoother motion; these are used"
            )
        out.append(run if instants is None else replace(run, time=instants))
    return out, notes

"""Time stamps of a run: jitter of the clock, gaps, stamps that repeat or go back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from winchkit.arrays import Array
from winchkit.quantity_text import quantity
from winchkit.runs.gaps import gap_lengths, lost_samples
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding, counted, share

_JITTER = 0.05
"""Standard deviation of the intervals, relative to their mean, that is reported."""
_LEAST_SAMPLES = 20
"""Fewer samples have no usual step; rule of thumb."""


def sampling(run: Run) -> Iterator[Finding]:
    """Findings ``clock-jitter`` (value: relative standard deviation) and ``gap`` (value: s)."""
    if len(run) < _LEAST_SAMPLES or run.metadata.get("time") == "row number":
        return
    steps = np.diff(run.time)
    usual = float(np.median(steps))
    even = steps[~lost_samples(run.time)]
    gaps = np.array(gap_lengths(run.time, {name: run[name] for name in run}))
    jitter = float(np.std(even) / np.mean(even))
    if jitter > _JITTER:
        yield Finding(
            "clock-jitter",
            run.name,
            "time",
            jitter,
            f"sampled every {quantity(float(np.mean(even)), 's')} with {share(jitter)} of jitter: "
            "a smoothing spline gives speed and acceleration",
        )
    if len(gaps):
        lost = float(np.sum(gaps - usual))
        yield Finding(
            "gap",
            run.name,
            "time",
            lost,
            f"{counted(len(gaps), 'gap')}, together {lost:.3g} s of {np.ptp(run.time):.3g} s, the "
            f"longest {gaps.max():.3g} s",
        )


def with_lost_samples(time: Array, values: Array) -> Array:
    """Values with one NaN for every gap, so that differences are those of consecutive samples."""
    if len(time) < _LEAST_SAMPLES:
        return values
    return np.insert(values, np.flatnonzero(lost_samples(time)) + 1, np.nan)

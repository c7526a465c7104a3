"""Time stamps of a run: jitter of the clock, gaps, stamps that repeat or go back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.run import Run, lost_samples
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.text import counted, share

__all__ = ["increasing_rows", "sampling", "with_lost_samples"]

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
    lost_some = lost_samples(run.time)
    gaps, even = steps[lost_some], steps[~lost_some]
    jitter = float(np.std(even) / np.mean(even))
    if jitter > _JITTER:
        yield Finding(
            "clock-jitter",
            run.name,
            "time",
            jitter,
            f"intervals vary by {share(jitter)} (standard deviation) about {np.mean(even):.3g} s: "
            "speeds and accelerations are those of a smoothing spline",
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
    """Values of a channel with NaN at the places where samples were lost.

    Differences of the values are then those of consecutive samples.

    Parameters
    ----------
    time : (n,) array
        Stamps, s, increasing.
    values : (n,) array

    Returns
    -------
    (m,) array
        One NaN for every gap, whatever its length.
    """
    if len(time) < _LEAST_SAMPLES:
        return values
    return np.insert(values, np.flatnonzero(lost_samples(time)) + 1, np.nan)


def increasing_rows(time: Array, run: str) -> tuple[NDArray[np.intp], list[Finding]]:
    """Rows in order of time, each later than all before, for importers of other loggers' files.

    Parameters
    ----------
    time : (n,) array
        Stamps as recorded, s.
    run : str
        Name of the run.

    Returns
    -------
    rows : (m,) array of int
        Rows to keep: the first of equal stamps, none that goes back or has no stamp.
    findings : list of Finding
        ``duplicated-stamps`` and ``backward-stamps`` (value: number of rows left out).
    """
    known = np.where(np.isfinite(time), time, -np.inf)
    latest = np.concatenate([[-np.inf], np.maximum.accumulate(known)[:-1]])
    repeated = np.isfinite(time) & (known == latest)
    back = np.isfinite(time) & (known < latest)
    found = []
    for code, rows, word in (
        ("duplicated-stamps", repeated, "repeat the time of an earlier row"),
        ("backward-stamps", back, "go back in time"),
    ):
        count = int(np.count_nonzero(rows))
        if count:
            text = f"{count} of {len(time)} rows {word}; they are left out"
            found.append(Finding(code, run, "time", float(count), text))
    return np.flatnonzero(known > latest), found

"""Recognises runs that repeat each other, and lines up their clocks.

Two runs are repeats when their aligned motor angles agree and their mean loads agree within 2 %.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlate

from winchkit.model.line import GRAVITY
from winchkit.model.stages import Signals

__all__ = ["Repeats", "find_repeats"]

Array = NDArray[np.float64]
_ANGLE_AGREES = 0.02
_LOAD_AGREES = 0.02
_OVERLAP = 0.8


@dataclass(frozen=True)
class Repeats:
    """Runs of one programme and load: their indices and the samples that belong together."""

    runs: tuple[int, ...]
    rows: tuple[NDArray[np.intp], ...]
    """Per run the sample indices that line up, all of equal length."""


def find_repeats(signals: list[Signals]) -> list[Repeats]:
    """Partition of all runs into sets of repeats; a run without any is a set of its own."""
    sets: list[tuple[list[int], list[int]]] = []
    for index, run in enumerate(signals):
        for members, shifts in sets:
            shift = _shift(signals[members[0]], run)
            if shift is not None:
                members.append(index)
                shifts.append(shift)
                break
        else:
            sets.append(([index], [0]))
    return [_lined_up(members, shifts, signals) for members, shifts in sets]


def mean_load(run: Signals) -> float | None:
    """Mean tension at the platform, else at the cell, N; None where neither is known."""
    if run.load is not None:
        return float(np.mean(run.load))
    if run.load_mass is not None:
        return GRAVITY * run.load_mass
    return None if run.tension is None else float(np.mean(run.tension))


def _shift(first: Signals, other: Signals) -> int | None:
    """Samples by which ``other`` is later than ``first``, or None where it is no repeat."""
    loads = mean_load(first), mean_load(other)
    if (loads[0] is None) != (loads[1] is None):
        return None
    if loads[0] is not None and loads[1] is not None:
        larger = max(abs(loads[0]), abs(loads[1]))
        if abs(loads[0] - loads[1]) > _LOAD_AGREES * larger:
            return None
    steps = np.median(np.diff(first.time)), np.median(np.diff(other.time))
    if abs(steps[0] - steps[1]) > 0.01 * steps[0]:
        return None
    a, b = np.diff(first.motor_angle), np.diff(other.motor_angle)
    if not a.any() or not b.any():
        return None
    lag = int(np.argmax(correlate(b, a, mode="full"))) - (len(a) - 1)
    start, stop = max(0, -lag), min(len(first.time), len(other.time) - lag)
    if stop - start < _OVERLAP * min(len(first.time), len(other.time)):
        return None
    apart = first.motor_angle[start:stop] - other.motor_angle[start + lag : stop + lag]
    spread = float(np.std(first.motor_angle[start:stop]))
    return lag if float(np.sqrt(np.mean(apart**2))) <= _ANGLE_AGREES * spread else None


def _lined_up(members: list[int], shifts: list[int], signals: list[Signals]) -> Repeats:
    """Common samples of all members, counted on the first one's clock."""
    counts = [len(signals[m].time) for m in members]
    start = max(-shift for shift in shifts)
    stop = min(count - shift for count, shift in zip(counts, shifts, strict=True))
    rows = tuple(np.arange(start, stop) + shift for shift in shifts)
    return Repeats(tuple(members), rows)

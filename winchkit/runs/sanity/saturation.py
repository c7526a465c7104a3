"""Saturation: values of an instrument that are cut off at the end of its range."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding, share

SATURATED = "saturated"
"""Code of the finding."""
_LEAST_SAMPLES = 5
"""Fewer equal samples at an end are an extremum that the resolution flattens. Rule of thumb."""
_TIES = 0.01
"""Share of equal neighbours below which a channel has continuous values."""
_ALTERNATING = 0.2
"""Share of changes in opposite direction to the one before from which a channel has noise: white
noise has two thirds, a smooth signal few."""
_LONGEST = 10
"""Samples at a level that noise leaves by chance at once; with `_TIMES` usual stretches the least
of a saturation. Rule of thumb."""
_TIMES = 3
_DITHERED = 12
"""Longest repetition elsewhere of a channel whose noise is not small against its resolution."""
_LEAST_LEVELS = 8
"""Levels below which the extreme of a quantised channel is one of the few values that it has."""
_OVERSHOOT = 3.0
"""Steps by which a continued slope would pass the level: below, it could have ended there."""
_JITTER = 0.5
"""Share of second differences that alternate from which a channel has noise on a slope as well:
white noise has three quarters."""
_ABOVE_STEP = 3.0
"""Noise in steps of the resolution from which equal values are no matter of rounding."""
_FORCES = ("motor_torque", "tension", "load")
"""Channels whose instruments have noise at rest as well: an encoder at rest repeats its value."""
_BEFORE = 6
"""Samples before a level from which its slope is continued: few, since a motion bends."""


def saturated(run: Run, name: str, step: float) -> Iterator[Finding]:
    """An extreme at which values of resolution ``step`` are cut off; value: share of samples there.

    Notes
    -----
    Continuous noise has no two equal values: an extreme that repeats is a limit. Values of a coarse
    resolution repeat, but three times as long as elsewhere only at a limit; with a resolution far
    above the noise nothing can be concluded. A channel without
    noise may rest at its extreme, but then approaches it slowly: there, the linear extrapolation of
    the two samples before must exceed the extreme by three times the second differences before it.
    A force with noise on its slopes has it at its extreme too. An extreme of zero is that of an
    instrument at rest.
    """
    values = run[name]
    values = values[np.isfinite(values)]
    if len(values) < _LEAST_SAMPLES or np.ptp(values) == 0:
        return
    kind = name.rpartition(".")[2]
    for sign, word in ((1.0, "largest"), (-1.0, "smallest")):
        signal = sign * values
        level = float(signal.max())
        at = signal >= level - 1e-9 * float(np.ptp(values))
        count = int(np.count_nonzero(at))
        if count < _LEAST_SAMPLES or level == 0:
            continue
        noisy = kind in _FORCES and _is_noisy(signal, at | (signal == signal.min()), step)
        if not noisy and not _is_cut_off(signal, at, level):
            continue
        if np.ptp(values) < _LEAST_LEVELS * step:
            return
        limit = quantity(sign * level, run.channels[name].unit)
        text = (
            f"{share(count / len(values))} of the samples are at the {word} value, {limit}: the "
            "instrument or the logger saturates; "
            + (
                "these samples are not compared"
                if noisy and kind == "motor_torque"
                else "larger errors there are no effect of the winch"
            )
        )
        yield Finding(SATURATED, run.name, name, count / len(values), text)


def at_limit(values: Array, step: float) -> NDArray[np.bool_]:
    """Samples of a force with noise at an extreme that repeats and is not zero, (n,).

    None of a force without noise: a computed friction has the same value in all of its motion.
    """
    out = np.zeros(len(values), dtype=bool)
    for end in (np.nanmin(values), np.nanmax(values)):
        at = values == end
        if end and np.count_nonzero(at) >= _LEAST_SAMPLES:
            out |= at
    known = np.isfinite(values)
    return out & _is_noisy(values[known], out[known], step)


def _is_noisy(signal: Array, ends: NDArray[np.bool_], step: float) -> bool:
    """Whether a force has noise well above its resolution, and no equal values but at its ends."""
    inner = ~(ends[2:] | ends[1:-1] | ends[:-2])
    bends = np.diff(signal, 2)[inner]
    if (
        len(bends) < _LEAST_SAMPLES
        or np.mean(np.diff(signal)[~(ends[1:] & ends[:-1])] == 0) > _TIES
    ):
        return False
    alternating = float(np.mean(bends[1:] * bends[:-1] < 0))
    # The variance of a second difference of white noise is six times that of the noise.
    return alternating > _JITTER and float(np.std(bends)) > _ABOVE_STEP * step * 6**0.5


def _is_cut_off(signal: Array, at: NDArray[np.bool_], level: float) -> bool:
    steps = np.diff(signal)
    between = at[1:] & at[:-1]
    opposite = signal == signal.min()
    elsewhere = (steps == 0) & ~between & ~(opposite[1:] & opposite[:-1])
    changing = steps[steps != 0]
    alternating = np.count_nonzero(changing[1:] * changing[:-1] < 0)
    if alternating > _ALTERNATING * len(changing):
        if np.count_nonzero(elsewhere) < _TIES * len(signal):
            return True
        usual = _longest(elsewhere)
        return usual <= _DITHERED and _longest(between) > max(_LONGEST, _TIMES * usual)
    begins = np.flatnonzero(between & ~np.append(False, between[:-1]))
    beyond = [_overshoot(signal, int(begin), level) for begin in begins if begin >= _BEFORE]
    return len(beyond) > 0 and float(np.median(beyond)) > _OVERSHOOT


def _longest(flags: NDArray[np.bool_]) -> int:
    """Length of the longest sequence of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return int(np.max(edges[1::2] - edges[::2], initial=0))


def _overshoot(signal: Array, begin: int, level: float) -> float:
    """Extrapolation beyond the extreme, in the largest second difference just before it."""
    before = signal[begin - _BEFORE : begin]
    usual = float(np.abs(np.diff(before, 2)).max())
    beyond = float(2 * before[-1] - before[-2] - level)
    return beyond / usual if usual > 0 else (np.inf if beyond > 0 else 0.0)

"""Saturation: values of an instrument that are cut off at the end of its range."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtrc

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
_CHANCE = 1e-2
"""Chance of the samples at the largest level, if that is a bend, below which they are a limit."""
_DITHERED = 12
"""Longest repetition elsewhere of a channel whose noise is not small against its resolution."""
_LEAST_LEVELS = 8
"""Levels below which the extreme of a quantised channel is one of the few values that it has."""
_JITTER = 0.5
"""Share of second differences that alternate from which a channel has noise on a slope as well:
white noise has three quarters."""
_ABOVE_STEP = 3.0
"""Noise in steps of the resolution from which equal values are no matter of rounding."""
_FORCES = ("motor_torque", "tension", "load")
"""Channels whose instruments have noise at rest as well: an encoder at rest repeats its value."""
_RISE, _RISE_SAMPLES = 4.0, 3
"""Steps of the resolution and of the time by which a signal must rise before a level, so that
neither shapes the rise by more than a quarter."""
_JUMP, _KINK, _PARABOLA = 1.5, 3.0, 5.0
"""Bounds of the ratio of a signal's rises over twice and once a time before a level: one at a jump,
two at a slope that ends there, four at the end of a parabola."""


def saturated(run: Run, name: str, step: float) -> Iterator[Finding]:
    """An extreme at which values of resolution ``step`` are cut off; value: share of samples there.

    Continuous noise has no two equal values: an extreme that repeats is a limit. Values of a coarse
    resolution repeat, but a bend is not at its last level longer than its shape allows, and values
    repeat three times as long as elsewhere only at a limit; with a resolution far above the noise
    nothing can be concluded. A channel without noise may rest at its extreme, but
    then approaches it slowly, and a friction jumps to it: a limit ends a slope. A force with noise
    on its slopes has it at its extreme too. An extreme of zero is that of an instrument at rest.
    """
    kind, values = name.rpartition(".")[2], run[name]
    known = np.isfinite(values)
    for sign, at in _limits(values[known], step, is_force=kind in _FORCES):
        limit = quantity(sign * float((sign * values[known]).max()), run.channels[name].unit)
        text = (
            f"{share(float(at.mean()))} of the samples are at the "
            f"{'largest' if sign > 0 else 'smallest'} value, {limit}: the instrument or the "
            "logger saturates; "
            + (
                "these samples are not compared"
                if kind == "motor_torque"
                else "larger errors there are no effect of the machine"
            )
        )
        yield Finding(SATURATED, run.name, name, float(at.mean()), text)


def at_limit(torque: Array, step: float) -> NDArray[np.bool_]:
    """Samples at which a torque of resolution ``step`` is cut off, (n,)."""
    out = np.zeros(len(torque), dtype=bool)
    known = np.isfinite(torque)
    for _, at in _limits(torque[known], step, is_force=True):
        out[known] |= at
    return out


def _limits(
    values: Array, step: float, *, is_force: bool
) -> Iterator[tuple[float, NDArray[np.bool_]]]:
    """Each end at which values are cut off: 1 for the largest or -1, and the samples there."""
    if len(values) < _LEAST_SAMPLES or np.ptp(values) <= _LEAST_LEVELS * step:
        return
    found = []
    for sign in (1.0, -1.0):
        signal = sign * values
        at = signal >= signal.max() - 1e-9 * np.ptp(values)
        if np.count_nonzero(at) < _LEAST_SAMPLES or signal.max() == 0:
            continue
        ends = at | (signal == signal.min())
        noisy = is_force and _is_noisy(signal, ends, step)
        found.append((sign, at, noisy or _is_cut_off(signal, at, ends, step)))
    # A drive has one limit for both directions: what is seen at one end holds at the other.
    is_symmetric = is_force and abs(values.max() + values.min()) <= 1e-9 * np.ptp(values)
    for sign, at, is_cut_off in found:
        if is_cut_off or (is_symmetric and any(other for _, _, other in found)):
            yield sign, at


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
    return alternating > _JITTER and bool(np.std(bends) > _ABOVE_STEP * step * 6**0.5)


def _is_cut_off(signal: Array, at: NDArray[np.bool_], ends: NDArray[np.bool_], step: float) -> bool:
    """Whether values stay at their largest by more than rounding and a bend of the signal do."""
    steps, between = np.diff(signal), ends[1:] & ends[:-1]
    elsewhere = (steps == 0) & ~between
    changing = steps[(steps != 0) & ~between]
    alternating = np.count_nonzero(changing[1:] * changing[:-1] < 0)
    is_alternating = bool(alternating > _ALTERNATING * len(changing))
    is_continuous = is_alternating and np.mean(elsewhere) < _TIES
    if (step or not is_continuous) and _chance_of_a_bend(signal, at, step) > _CHANCE:
        return False
    if is_continuous:
        return True
    usual = _longest(elsewhere)
    if _longest(at) <= max(_LONGEST, _TIMES * usual):
        return False
    return (is_alternating and usual <= _DITHERED) or _ends_slopes(signal, at, step)


def _chance_of_a_bend(signal: Array, at: NDArray[np.bool_], step: float) -> float:
    """Chance that smooth maxima of any heights give so large a share of samples at the top level.

    A parabola whose height above a level is h <= 1 step is above it for a time ~ √h, and above the
    level below for ~ √(h + 1): the share is at most 1/√2.
    """
    held = at & (np.append(at[1:], False) | np.append(False, at[:-1]))
    if 2 * np.count_nonzero(held) < np.count_nonzero(at):
        return 1.0  # single samples of a wave with few samples a period
    # Bends that do not reach the level are no part of it.
    near = zip(*_stretches(signal >= signal.max() - 1.5 * step), strict=True)
    reached = [at[begin : begin + length] for begin, length in near]
    count, size = (sum(map(of, (part for part in reached if part.any()))) for of in (np.sum, len))
    return float(bdtrc(count - 1, size, 2**-0.5))


def _ends_slopes(signal: Array, at: NDArray[np.bool_], step: float) -> bool:
    """Whether the stretches at the largest value mostly end a slope, before and after them.

    A parabola that stays within one step for a stretch is three steps lower half a stretch before.
    """
    kinks = []
    for values, flags in ((signal, at), (signal[::-1], at[::-1])):
        for begin, length in zip(*_stretches(flags), strict=True):
            rise = values[begin] - values[:begin][::-1]
            high = _RISE_SAMPLES + np.flatnonzero(rise[_RISE_SAMPLES:] > _RISE * step)
            if length > _LONGEST and len(high) and 2 * high[0] + 1 < len(rise):
                ratio = rise[2 * high[0] + 1] / rise[high[0]]
                if ratio < _PARABOLA:
                    kinks.append(_JUMP < ratio < _KINK and high[0] < length / 2)
    return len(kinks) > 0 and float(np.mean(kinks)) > 1 / 2


def _stretches(flags: NDArray[np.bool_]) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """First index and length of each sequence of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return edges[::2], edges[1::2] - edges[::2]


def _longest(flags: NDArray[np.bool_]) -> int:
    return int(np.max(_stretches(flags)[1], initial=0))

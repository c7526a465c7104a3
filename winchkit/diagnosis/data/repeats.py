"""Detection of repeats (replicate runs) and alignment of their clocks.

Two runs are repeats when their motor angles, aligned by the lag of least mean-square difference,
agree to 2 % of their standard deviation and their mean loads to 2 %. Repeats have the same recorded
inputs, so that every model predicts the same outputs for them. A run that its nearest repeat
predicts no better than the profile does, while the others predict each other, was made under
another value of something that is not recorded, such as the zero of the angle; taken for noise,
this difference would hide all effects. Several such runs that predict each other are repeats of
each other.

References
----------
Cochran, W. G. (1941). The distribution of the largest of a set of estimated variances as a fraction
of their total. Ann. Eugenics 11, 47-52.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, irfft, next_fast_len, rfft
from scipy.sparse.csgraph import connected_components
from scipy.special import fdtrc

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import fast_count
from winchkit.model.stages import Signals
from winchkit.units import GRAVITY

_ANGLE_TOLERANCE = 0.02
"""Rms difference of aligned motor angles of repeats, over their standard deviation; screened."""
_LOAD_TOLERANCE = 0.02
"""Relative difference of mean loads of repeats; screened."""
_LEAST_OVERLAP = 0.8
"""Share of the shorter run that two repeats must overlap; screened."""
_TIE = 1e-6
"""Relative difference of mean-square lag criteria that counts as equal; numerical: rounding of a
correlation by FFT."""
_RATE_TOLERANCE = 0.05
"""Relative difference of sampling intervals of repeats; screened."""
_LEAST_REPEATS = 3
"""Repeats from which one can be outlying; theory: of two, neither is."""
_LEAST_SEPARABLE = 4
"""Repeats from which there can be two sets; theory: of fewer, one has a single run."""
_LEAST_RATIO = 4.0
"""Mean square of the difference from the nearest repeat over that of the others, below which a run
is only noisier; screened: twice the rms."""
_STEP = 0.2
"""Share of the variation of a difference beside a step, up to which it is one; rule of thumb."""
_LEAST_COMMON = 64
"""Samples that all repeats have, from which a step is looked for; as of a difference between them
(:mod:`winchkit.diagnosis.data.zeroing`)."""
_LEVEL = 1e-3
"""Level of the F test, Bonferroni over the repeats; convention."""


@dataclass(frozen=True)
class Repeats:
    """Runs of one motion programme and load, with the samples that correspond."""

    runs: tuple[int, ...]
    rows: tuple[NDArray[np.intp], ...]
    """Per run the indices of the samples that correspond, all of one length."""


def find_repeats(
    signals: list[Signals], stated: Sequence[float | None] | None = None
) -> list[Repeats]:
    """Partition all runs into sets of repeats.

    ``stated`` is the mass that each run states, kg, also where no cable of the model carries it.
    """
    masses = stated or [run.load_mass for run in signals]
    sets: list[tuple[list[int], list[float]]] = []
    for index, run in enumerate(signals):
        for members, shifts in sets:
            is_same = masses[members[0]] == masses[index]
            shift = _shift(signals[members[0]], run) if is_same else None
            if shift is not None and _share_time(
                [*(signals[m] for m in members), run], [*shifts, shift]
            ):
                members.append(index)
                shifts.append(shift)
                break
        else:
            sets.append(([index], [0.0]))
    return [_aligned(members, shifts, signals) for members, shifts in sets]


def _share_time(runs: list[Signals], shifts: list[float]) -> bool:
    """Whether all runs have a stretch of the motion in common: two halves of one have none."""
    ends = [
        (run.time[0] - shift, run.time[-1] - shift) for run, shift in zip(runs, shifts, strict=True)
    ]
    common = min(end for _, end in ends) - max(start for start, _ in ends)
    return bool(common >= _LEAST_OVERLAP * min(end - start for start, end in ends))


def mean_load(run: Signals) -> float | None:
    """Mean tension at the platform, else at the cell, N; None where neither is known."""
    if run.load is not None:
        return float(np.mean(run.load))
    if run.load_mass is not None:
        return GRAVITY * run.load_mass
    return None if run.tension is None else float(np.mean(run.tension))


def _shift(first: Signals, other: Signals) -> float | None:
    """Time by which the clock of ``other`` is ahead, s; None where it is not a repeat."""
    if not _same_load(first, other):
        return None
    step = float(np.median(np.diff(first.time)))
    if abs(float(np.median(np.diff(other.time))) - step) > _RATE_TOLERANCE * step:
        return None
    starts = first.time[0], other.time[0]
    a, b = (_resampled(run, step) for run in (first, other))
    if not np.ptp(a) or not np.ptp(b):
        return None
    lag = _best_lag(a, b)
    start, stop = max(0, -lag), min(len(a), len(b) - lag)
    differences = a[start:stop] - b[start + lag : stop + lag]
    spread = float(np.std(a[start:stop]))
    if float(np.sqrt(np.mean(differences**2))) > _ANGLE_TOLERANCE * spread:
        return None
    return lag * step + float(starts[1] - starts[0])


def _best_lag(a: Array, b: Array) -> int:
    """Lag of least mean-square difference, in samples by which ``b`` is behind ``a``; the lag of
    largest correlation is wrong where a log begins or ends in motion."""
    lags = np.arange(1 - len(a), len(b))
    start, stop = np.maximum(0, -lags), np.minimum(len(a), len(b) - lags)
    mean = a.mean()
    a, b = a - mean, b - mean
    within_a, within_b = (np.concatenate([[0.0], np.cumsum(x**2)]) for x in (a, b))
    squares = within_a[stop] - within_a[start] + within_b[stop + lags] - within_b[start + lags]
    differences = (squares - 2 * _correlation(a, b)) / (stop - start)
    overlapping = stop - start >= _LEAST_OVERLAP * min(len(a), len(b))
    differences = np.where(overlapping, differences, np.inf)
    # A periodic motion fits at several lags: take the one of largest overlap.
    best = differences <= differences.min() + _TIE * float(np.mean(a**2))
    return int(lags[best][np.argmax((stop - start)[best])])


def _correlation(a: Array, b: Array) -> Array:
    """Sums of products a[i] b[i + lag] for the lags from 1 − len(a) to len(b) − 1."""
    count = len(a) + len(b) - 1
    length = next_fast_len(count, real=True)
    return np.asarray(irfft(rfft(b, length) * rfft(a[::-1], length), length)[:count])


def _same_load(first: Signals, other: Signals) -> bool:
    loads = mean_load(first), mean_load(other)
    if loads[0] is None or loads[1] is None:
        return loads[0] is loads[1]
    return abs(loads[0] - loads[1]) <= _LOAD_TOLERANCE * max(abs(loads[0]), abs(loads[1]))


def _resampled(run: Signals, step: float) -> Array:
    """Motor angle on an even grid: logs of a real bench have gaps and jitter."""
    grid = np.arange(run.time[0], run.time[-1], step)
    return np.interp(grid, run.time, run.motor_angle)


def _aligned(members: list[int], shifts: list[float], signals: list[Signals]) -> Repeats:
    """Nearest samples of all members on the clock of the first, over their common time."""
    clocks = [signals[m].time - shift for m, shift in zip(members, shifts, strict=True)]
    low, high = max(c[0] for c in clocks), min(c[-1] for c in clocks)
    half = float(np.median(np.diff(clocks[0]))) / 2
    common = clocks[0][(clocks[0] >= low - half) & (clocks[0] <= high + half)]
    common = common[: fast_count(len(common))]
    return Repeats(tuple(members), tuple(_nearest(clock, common) for clock in clocks))


def _nearest(clock: Array, times: Array) -> NDArray[np.intp]:
    """Index of the sample of ``clock`` nearest to each time."""
    after = np.clip(np.searchsorted(clock, times), 1, len(clock) - 1)
    return np.where(times - clock[after - 1] <= clock[after] - times, after - 1, after)


@dataclass(frozen=True)
class Outlying:
    """A run that differs from its repeats, and by how much, SI."""

    index: int
    """Among the repeats."""
    rms: float
    """Of its difference from the nearest repeat."""
    usual: float
    """The same of the other repeats, median."""


def outlying_repeat(errors: Array) -> Outlying | None:
    """The repeat, of at least three, that differs most from the others, if that is significant.

    ``errors`` are residuals of one output of m repeats on corresponding samples, (m, n), NaN where
    not compared. The mean square of the differences of a run from its nearest repeat, less their
    mean, over the median of the same of the others is tested by F at 10⁻³ over all repeats
    (Bonferroni). A variance estimate from coefficients c of a cosine transform has 3 (Σc²)²/Σc⁴
    degrees of freedom.
    """
    count = len(errors)
    if count < _LEAST_REPEATS:
        return None
    squares, dofs = _differences(errors)
    pairs = np.arange(count), np.argmin(squares, axis=1)
    nearest, dof = squares[pairs], dofs[pairs]
    index = int(np.argmax(nearest))
    others = np.delete(np.arange(count), index)
    usual = others[np.argsort(nearest[others])[len(others) // 2]]
    if nearest[index] < _mean_square(errors[index])[0]:
        return None
    if not _is_larger(nearest[index], nearest[usual], (dof[index], dof[usual]), count):
        return None
    return Outlying(index, float(np.sqrt(nearest[index])), float(np.sqrt(nearest[usual])))


def step_of(errors: Array, index: int) -> tuple[int, float] | None:
    """First sample and size of a step that is all by which a run differs from its repeats; None
    where it is another difference. The change point is that of least squares.
    """
    others = np.delete(errors, index, axis=0)
    difference = errors[index] - others.mean(axis=0)
    places = np.flatnonzero(np.isfinite(difference))
    values, count = difference[places], len(places)
    if count < _LEAST_COMMON:
        return None
    others = others[:, places]
    noise = np.var(others - others.mean(axis=0)) * len(others) / (len(others) - 1)
    before = np.arange(1, count)
    sums = np.cumsum(values)
    means = sums[:-1] / before, (sums[-1] - sums[:-1]) / (count - before)
    within = np.sum(values**2) - before * means[0] ** 2 - (count - before) * means[1] ** 2
    at = int(np.argmin(within))
    size = float(means[1][at] - means[0][at])
    is_step = within[at] < _STEP * np.sum((values - values.mean()) ** 2)
    is_equal_before = means[0][at] ** 2 < max(noise, _STEP * size**2)
    return (int(places[at + 1]), size) if is_step and is_equal_before else None


def separated(group: Repeats, errors: Array) -> list[Repeats]:
    """Repeats in sets whose members predict each other.

    ``errors`` are those of :func:`outlying_repeat`. There is one set, unless the nearest runs of
    two sets differ by more than all runs from the nearest of their own set, by the same test, and
    by more than the profile leaves of one of the runs.
    """
    if len(errors) < _LEAST_SEPARABLE:
        return [group]
    squares, dofs = _differences(errors)
    nearest = np.argmin(squares, axis=1)
    own = int(np.argmax(squares[np.arange(len(errors)), nearest]))
    within, dof = squares[own, nearest[own]], dofs[own, nearest[own]]
    number, labels = connected_components(squares <= _LEAST_RATIO * within, directed=False)
    apart = np.where(labels[:, None] != labels, squares, np.inf)
    pair = np.unravel_index(np.argmin(apart), apart.shape)
    least = min(_mean_square(error)[0] for error in errors)
    is_apart = number > 1 and apart[pair] > least
    if not is_apart or not _is_larger(apart[pair], within, (dofs[pair], dof), len(errors)):
        return [group]
    parts = [np.flatnonzero(labels == label).tolist() for label in range(number)]
    return [
        Repeats(tuple(group.runs[i] for i in part), tuple(group.rows[i] for i in part))
        for part in parts
    ]


def excluded_alike(
    repeats: Sequence[Repeats], valid: Sequence[Mapping[str, NDArray[np.bool_]]]
) -> list[Mapping[str, NDArray[np.bool_]]]:
    """Masks in which repeats exclude what any of them excludes: else their difference there is what
    the model leaves, and counts as noise."""
    out = [dict(own) for own in valid]
    for group in repeats:
        members = list(zip(group.runs, group.rows, strict=True))
        for output in set.intersection(*(set(valid[run]) for run in group.runs)):
            common = np.all([valid[run][output][rows] for run, rows in members], axis=0)
            for run, rows in members:
                out[run][output] = out[run][output].copy()
                out[run][output][rows[~common]] = False
    return [*out]


def _differences(errors: Array) -> tuple[Array, Array]:
    """Mean squares of the differences of all pairs, (m, m), and their degrees of freedom."""
    count = len(errors)
    squares, dofs = np.full((count, count), np.inf), np.ones((count, count))
    for i, j in combinations(range(count), 2):
        squares[i, j], dofs[i, j] = _mean_square(errors[i] - errors[j])
    lower = np.tril_indices(count, -1)
    squares[lower], dofs[lower] = squares.T[lower], dofs.T[lower]
    return squares, dofs


def _is_larger(square: float, usual: float, dofs: tuple[float, float], count: int) -> bool:
    """Whether a mean square is at least four times another one, and significantly larger."""
    ratio = square / max(usual, np.finfo(float).tiny)
    return ratio > _LEAST_RATIO and count * float(fdtrc(*dofs, ratio)) <= _LEVEL


def _mean_square(values: Array) -> tuple[float, float]:
    """Mean square less the mean, and its degrees of freedom."""
    known = np.isfinite(values)
    if not known.any():
        return np.inf, 1.0
    centred = np.where(known, values - np.mean(values[known]), 0.0)
    squares = np.asarray(dct(centred, type=2, norm="ortho")) ** 2
    total = float(np.sum(squares))
    dof = 3 * total**2 / float(np.sum(squares**2)) if total > 0 else 1.0
    return total / np.count_nonzero(known), max(1.0, dof)

"""Pieces of a recording between jumps of the motor angle that are no motion.

Rows that were lost, a homing during the recording, and turns that an encoder lost change the angle
by a step of another size than all others. Both sides of it are right, and their difference is not.
Where the sampling interval changes, the samples of the longer one are no gaps of the shorter one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError
from winchkit.quantity_text import quantity
from winchkit.runs.importing.streams import Stream, Streams
from winchkit.schema.linear_axis import rotary_name

_MOST = 5
"""Jumps of a recording; more large steps are motions between slow samples."""
_TIMES = 10.0
"""Size of a jump over that of the largest other step."""
_FEWEST = 20
"""Samples of a piece; the steps of fewer do not say which is a jump."""
_SHORT = 3
"""Samples after which a spike has returned."""
_GAP = 2.5
"""Median intervals of a gap, as two lost samples are."""
_FASTER = 2.0
"""Rate over a gap, in the largest rate elsewhere, from which it is no motion."""
_AMBIGUOUS = 0.5
"""Share of the modulus that a counter passes in a gap over which its turns are not known."""
_EVEN = 0.1
"""Deviation from the usual interval, in that interval, of a sample that is taken in time."""
_STEADY = 100
"""Samples before and after a change of the interval; fewer may be chance among lost ones."""
_MOSTLY = 0.97
"""Share of them that are in time there."""


@dataclass(frozen=True)
class Jump:
    """A step of an angle that is no motion."""

    channel: str
    time: float
    """Of the last sample before it, s on the clock of the file."""
    until: float
    """Of the first sample after it, s."""
    text: str


def jumps_of(streams: Streams) -> tuple[Jump, ...]:
    """Jumps of every motor angle, in the order of time.

    They are steps ten times as large as any other, beside a motion as large, which do not return
    within three samples and which the velocity does not have; and gaps of a counter that wraps in
    which it may have wrapped.
    """
    if not streams.has_time:
        return ()
    found = [
        jump
        for stream in streams.streams
        for name, values in stream.channels.items()
        if rotary_name(name.rpartition(".")[2]) == "motor_angle"
        for jump in _jumps(streams, stream, name, values)
    ]
    return tuple(sorted(found, key=lambda jump: jump.time))


def _jumps(streams: Streams, stream: Stream, name: str, values: Array) -> Iterator[Jump]:
    known = np.flatnonzero(np.isfinite(values) & np.isfinite(stream.time))
    time, angle = stream.time[known], values[known]
    if len(known) < _FEWEST or np.any(np.diff(time) <= 0):
        return
    intervals, steps = np.diff(time), np.diff(angle)
    for index in _changes_of_interval(intervals):
        before, after = (quantity(float(np.median(part)), "s") for part in _sides(intervals, index))
        what = f"the sampling interval changes from {before} to {after} after {time[index]:.6g} s"
        yield Jump("time", float(time[index]), float(time[index + 1]), what)
    usual = float(np.median(intervals))
    rates = steps / np.maximum(intervals, usual)
    winch, dot, base = name.rpartition(".")
    is_linear = base == "position"
    velocity = stream.channels.get(f"{winch}{dot}{'velocity' if is_linear else 'motor_velocity'}")
    unit = "m" if is_linear else "rad"
    beyond = _outstanding(rates, steps)
    modulus = streams.wraps.get(name, np.inf)
    is_gap = intervals > _GAP * usual
    others = np.setdiff1d(np.flatnonzero(~is_gap), beyond)
    fastest = float(np.max(np.abs(rates[others]), initial=0.0))
    beyond += map(int, np.flatnonzero(is_gap & (np.abs(rates) > _FASTER * fastest)))
    largest = float(np.max(np.abs(np.delete(steps, beyond)), initial=0.0))
    gaps = is_gap & (fastest * intervals > _AMBIGUOUS * modulus)
    for index in sorted({*beyond, *map(int, np.flatnonzero(gaps))}):
        is_lost = bool(gaps[index])
        if not is_lost and velocity is not None:
            passed = float(np.mean(velocity[known[index : index + 2]])) * intervals[index]
            if abs(steps[index] - passed) < 0.5 * abs(steps[index]):
                continue
        line = streams.line_of(int(stream.rows[known[index + 1]]))
        where = f" (line {line})" if line is not None else ""
        at = f"{time[index] - time[0]:.6g} s{where}"
        what = (
            f"{name} has a gap of {intervals[index]:.3g} s after {at}, in which its counter may "
            "have wrapped"
            if is_lost
            else f"{name} jumps by {steps[index]:.4g} {unit} after {at}, beside steps of at most "
            f"{largest:.3g} {unit}: rows were lost, the axis was "
            "homed or the encoder lost turns"
        )
        yield Jump(name, float(time[index]), float(time[index + 1]), what)


def _sides(intervals: Array, index: int) -> tuple[Array, Array]:
    """The intervals before one, and as many as are needed after it."""
    return intervals[max(0, index - _STEADY) : index], intervals[index + 1 : index + 1 + _STEADY]


def _changes_of_interval(intervals: Array, first: int = 0) -> list[int]:
    """Intervals at which a recording with an even clock goes on with another one.

    ``first``: index of the first of them, counted from the start of the recording.
    """
    if len(intervals) < 2 * _STEADY:
        return []
    late = ~_in_time(intervals, intervals)
    lately = np.convolve(late, np.ones(_STEADY), "valid") >= _MOSTLY * _STEADY
    start = int(np.argmax(lately))
    index = start + int(np.argmax(late[start:]))
    after = intervals[index + 1 : index + 1 + _STEADY]
    is_change = lately.any() and index >= _STEADY and len(after) == _STEADY
    if not is_change or max(np.mean(late[:index]), np.mean(~_in_time(after, after))) > 1 - _MOSTLY:
        return []
    return [first + index, *_changes_of_interval(intervals[index + 1 :], first + index + 1)]


def _in_time(intervals: Array, usual: Array) -> NDArray[np.bool_]:
    """Whether intervals are the usual one at the start of others."""
    one = float(np.median(usual[:_STEADY]))
    return np.asarray(np.abs(intervals - one) <= _EVEN * one)


def _outstanding(rates: Array, steps: Array) -> list[int]:
    """Indices of the few steps that are far larger than all others and do not return."""
    order = np.argsort(-np.abs(rates))
    sizes = np.abs(rates[order])
    count = next(
        (n for n in range(min(_MOST, len(sizes) - 1), 0, -1) if sizes[n - 1] > _TIMES * sizes[n]), 0
    )
    found = sorted(int(index) for index in order[:count])
    others = float(np.sum(np.abs(np.delete(steps, found))))
    kept = []
    for index in found:
        near = [other for other in found if abs(other - index) <= _SHORT]
        returns = abs(sum(float(steps[other]) for other in near)) < abs(float(steps[index])) / 2
        if not returns and others > abs(float(steps[index])):
            kept.append(index)
    return kept


def pieces_of(streams: Streams, jumps: tuple[Jump, ...]) -> tuple[Streams, ...]:
    """A file in pieces between its jumps, those with enough samples; RunError without any."""
    if not jumps:
        return (streams,)
    edges = [-np.inf, *((jump.time + jump.until) / 2 for jump in jumps), np.inf]
    pieces = []
    for start, end in pairwise(edges):
        parts = [s.at((s.time > start) & (s.time < end)) for s in streams.streams]
        if min(len(part.time) for part in parts) >= _FEWEST:
            pieces.append(replace(streams, streams=tuple(parts)))
    if not pieces:
        short = f"; no piece between the jumps has {_FEWEST} samples"
        raise RunError([Fault(jump.text + short, streams.path) for jump in jumps])
    return tuple(pieces)

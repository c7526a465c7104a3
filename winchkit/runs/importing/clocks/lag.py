"""Alignment of the clocks of two files, by their stamps or by cross-correlation.

Signals that follow each other are a quantity that both files have, or a tension and a torque, a
cable length and an angle; of a robot's lines and a tracker, those of :mod:`multilateration`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from winchkit.runs.importing.clocks.cross_correlation import (
    Agreement,
    TimedSignal,
    correlated,
    signals_by_base,
)
from winchkit.runs.importing.clocks.multilateration import pose_agreement
from winchkit.runs.importing.streams import Streams

_PAIRS = (
    ("motor_angle", "motor_angle"),
    ("tension", "tension"),
    ("cable_length", "cable_length"),
    ("motor_torque", "motor_torque"),
    ("motor_velocity", "motor_velocity"),
    ("cable_length", "motor_angle"),
    ("tension", "motor_torque"),
    ("load", "motor_torque"),
    ("load", "tension"),
    ("platform_x", "motor_angle"),
    ("platform_y", "motor_angle"),
    ("platform_z", "motor_angle"),
    ("position", "position"),
    ("velocity", "velocity"),
    ("force", "force"),
    ("force", "tension"),
)
"""Channels that follow each other up to a scale, an offset and a small error."""


def agreement_of(first: Streams, second: Streams) -> Agreement | None:
    """Lag of two files by the channel pair with the largest correlation.

    Returns: None without channels that follow each other.
    """
    best = pose_agreement(first, second)
    has_pose = best is not None
    for one, two in _signals(first, second):
        if has_pose and "platform_" in f"{one.channel} {two.channel}":
            continue
        found = correlated(one, two)
        if found is None:
            continue
        better = best is None or (found.is_known, abs(found.correlation)) > (
            best.is_known,
            abs(best.correlation),
        )
        if better:
            best = found
    return best


def span_of(streams: Streams) -> tuple[float, float]:
    """First and last time of a file, s."""
    times = [item.time for item in streams.streams if len(item.time)]
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)


def shifted(streams: Streams, lag: float, drift: float = 0.0, reference: float = 0.0) -> Streams:
    """Streams on another clock: t + lag + drift (t − reference).

    ``lag``: s. ``reference``: time at which the lag is valid, s. Returns: the same samples.
    """
    moved = tuple(
        replace(item, time=item.time + lag + drift * (item.time - reference))
        for item in streams.streams
    )
    return replace(streams, streams=moved)


def _signals(first: Streams, second: Streams) -> Iterator[tuple[TimedSignal, TimedSignal]]:
    """Pairs of signals of the two files."""
    ours, theirs = signals_by_base(first), signals_by_base(second)
    for one, two in _PAIRS:
        for a, b in {(one, two), (two, one)}:
            for left in ours.get(a, ()):
                for right in theirs.get(b, ()):
                    yield left, right

"""Files joined to one run: by the names of points, by time stamps, or by cross-correlation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from winchkit.errors import Fault, RunError, some_of
from winchkit.runs.importing.clocks.cross_correlation import (
    Agreement,
    TimedSignal,
    correlated,
    signals_by_base,
)
from winchkit.runs.importing.clocks.friction import TORQUE, correlated_without_friction
from winchkit.runs.importing.clocks.multilateration import pose_agreement
from winchkit.runs.importing.clocks.point_names import by_names, unlike_names
from winchkit.runs.importing.streams import Stream, Streams

_SIGNIFICANT = 3.0
"""Standard deviations of a drift that is applied, and of a lag that contradicts the stamps."""

_ROW_BY_ROW = ("names", "rows")
"""Methods that put a row of one file beside one of the other."""


@dataclass(frozen=True)
class Joint:
    """How a file was joined to the first one."""

    path: str
    method: str
    """``time stamps``, ``cross-correlation``, ``given lag``, ``names`` or ``rows``."""
    lag: float
    """s, added to the clock of the file for that of the first one."""
    drift: float
    """Relative correction of the rate of its clock; 0 where none was applied."""
    text: str
    agreement: Agreement | None = None


def joined(parts: Sequence[Streams], lag: float | None = None) -> tuple[Streams, tuple[Joint, ...]]:
    """All channels of several files on the clock of the first one: its time = theirs + ``lag`` (s).

    Raises RunError where the difference of the clocks cannot be determined.
    """
    first, more = parts[0], list[Stream]()
    notes, joints = list(first.notes), []
    faults = tuple(fault for part in parts for fault in part.faults)
    for other in parts[1:]:
        named = _as_named(first, other)
        paired = by_names(first, named) if lag is None and not more else None
        if paired is not None:
            first, moved, text = paired
            joint = Joint(other.path, "names", 0.0, 0.0, text)
        elif not named.has_time or not first.has_time:
            first, moved, joint = _by_rows(first, named)
        else:
            moved, joint = _aligned(first, named, lag)
        joints.append(joint)
        notes += other.notes
        known = {name for item in (*first.streams, *more) for name in item.channels}
        for item in moved.streams:
            if doubled := sorted(known & set(item.channels)):
                notes.append(
                    f"{Path(other.path).name}: {', '.join(doubled)} left out: given before"
                )
            own = {name: values for name, values in item.channels.items() if name not in known}
            if own and joint.method in _ROW_BY_ROW:
                (stream,) = first.streams
                stream = replace(stream, channels={**stream.channels, **own})
                first = replace(first, streams=(stream,))
            elif own:
                more.append(Stream(item.time, own, item.rows))
    whole = replace(first, streams=(*first.streams, *more), faults=faults, notes=tuple(notes))
    return whole, tuple(joints)


def _as_named(first: Streams, other: Streams) -> Streams:
    """Another file with the winches named as the first one spells them: ``A`` for ``a``."""
    labels = {name.rpartition(".")[0] for name in first.channels}
    spelled = {label.casefold(): label for label in labels if label}

    def named(channel: str) -> str:
        label, dot, base = channel.rpartition(".")
        return f"{spelled.get(label.casefold(), label)}{dot}{base}"

    streams = tuple(
        replace(item, channels={named(name): values for name, values in item.channels.items()})
        for item in other.streams
    )
    wraps = {named(name): size for name, size in other.wraps.items()}
    return replace(other, streams=streams, wraps=wraps)


def _aligned(first: Streams, other: Streams, lag: float | None) -> tuple[Streams, Joint]:
    """Another file on the clock of the first one."""
    stamped = other.origin - first.origin
    if lag is not None:
        moved = shifted(other, stamped + lag)
        _require_overlap(first, moved)
        found = agreement_of(first, other)
        text = f"joined with a lag of {lag:g} s{_doubts(first, moved, found, stamped + lag)}"
        return moved, Joint(other.path, "given lag", lag, 0.0, text, found)
    found = agreement_of(first, other)
    known = found is not None and found.is_known
    overlapping = _overlap(first, shifted(other, stamped)) > 0
    if first.is_absolute and other.is_absolute and overlapping:
        apart = found.lag - stamped if found is not None and known else 0.0
        if found is None or not known:
            text = (
                "joined by time stamps; no channels follow each other clearly enough to test them"
            )
            return shifted(other, stamped), Joint(other.path, "time stamps", 0.0, 0.0, text, found)
        if abs(apart) <= _resolution(first, other) + _SIGNIFICANT * found.lag_std:
            text = f"joined by time stamps, which agree to {apart * 1e3:.3g} ms ({found.text})"
            return shifted(other, stamped), Joint(other.path, "time stamps", 0.0, 0.0, text, found)
    if found is None or not known:
        raise RunError(Fault(_unknown(first, other, found), other.path))
    drift = found.drift if abs(found.drift) > _SIGNIFICANT * found.drift_std else 0.0
    moved = shifted(other, found.lag, drift, found.reference)
    text = f"joined by cross-correlation of {found.text}"
    if first.is_absolute and other.is_absolute:
        text += f"; the time stamps differ from it by {(found.lag - stamped):.4g} s"
    return moved, Joint(other.path, "cross-correlation", found.lag - stamped, drift, text, found)


def _by_rows(first: Streams, other: Streams) -> tuple[Streams, Streams, Joint]:
    """Rows at the same places of both files, without those of which one file has no values."""
    counts = [len(item.time) for item in (*first.streams, *other.streams)]
    one_each = len(first.streams) == len(other.streams) == 1
    if one_each and counts[0] == counts[1]:
        text = f"joined row by row ({counts[0]} rows each){unlike_names(first, other)}"
        return first, other, Joint(other.path, "rows", 0.0, 0.0, text)
    whole, less = (first, other) if counts[0] > counts[1] else (other, first)
    if one_each and all(counts) and less.streams[0].rows[-1] == max(counts) - 1:
        kept = less.streams[0].rows
        whole = replace(whole, streams=(whole.streams[0].at(kept),))
        empty = [str(less.line_of(r) or r + 1) for r in range(max(counts)) if r not in kept]
        text = (
            f"joined row by row ({len(kept)} rows); line {some_of(empty)} of {less.path} left out, "
            f"without values{unlike_names(first, other)}"
        )
        joint = Joint(other.path, "rows", 0.0, 0.0, text)
        return (whole, less, joint) if less is other else (less, whole, joint)
    message = (
        f"has no times, and not as many rows as {first.path} ({' and '.join(map(str, counts))}); "
        "give both files a column with the names of the points, or times, e.g. by --sample-rate"
    )
    raise RunError(Fault(message, other.path))


def _overlap(first: Streams, other: Streams) -> float:
    (start, end), (begin, stop) = span_of(first), span_of(other)
    return min(end, stop) - max(start, begin)


def _require_overlap(first: Streams, other: Streams) -> None:
    if _overlap(first, other) <= 0:
        (start, end), (begin, stop) = span_of(first), span_of(other)
        message = (
            f"does not overlap {first.path}: {begin:.6g} to {stop:.6g} s against {start:.6g} to "
            f"{end:.6g} s on its clock; is the lag right?"
        )
        raise RunError(Fault(message, other.path))


def _doubts(first: Streams, moved: Streams, found: Agreement | None, lag: float) -> str:
    """Doubts of a given lag; raises RunError where rows are left over and signals contradict it."""
    shorter = min((first, moved), key=lambda part: span_of(part)[1] - span_of(part)[0])
    (start, _), (begin, _) = span_of(first), span_of(moved)
    low, high = max(start, begin), max(start, begin) + _overlap(first, moved)
    stamps = max(shorter.streams, key=lambda stream: len(stream.time)).time
    both = int(np.count_nonzero((stamps >= low) & (stamps <= high)))
    text = "" if both == len(stamps) else f"; {both} of {len(stamps)} rows are in both files"
    if found is not None and found.is_known:
        apart = found.lag - lag
        if abs(apart) > _resolution(first, moved) + _SIGNIFICANT * found.lag_std:
            text += f"; the signals follow each other {apart:.4g} s beside it ({found.text})"
            if 2 * both < len(stamps):
                advice = ": was the clock of a file shifted? Leave out --lag, or correct it"
                raise RunError(Fault(f"the lag cannot be right{text}{advice}", moved.path))
    return text


def _resolution(first: Streams, other: Streams) -> float:
    """Longest sampling interval of the two files, s."""
    steps = [item.interval for item in (*first.streams, *other.streams)]
    return max((step for step in steps if np.isfinite(step)), default=0.0)


def _unknown(first: Streams, other: Streams, found: Agreement | None) -> str:
    if found is None:
        why = (
            f"its channels ({', '.join(other.channels) or 'none'}) and those of {first.path} "
            f"({', '.join(first.channels)}) do not follow each other"
        )
    elif abs(found.correlation) < abs(found.rival) + 0.05:
        why = f"several lags fit equally, as in a periodic motion ({found.text})"
    else:
        why = f"the correlation is too small ({found.text})"
    return (
        f"the difference of its clock from that of {first.path} is not known: {why}; give it as "
        '--lag, "0 s" for one clock'
    )


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
    """Lag of two files by the channel pair with the largest correlation; None without a pair."""
    best = pose_agreement(first, second)
    has_pose = best is not None
    for one, two in _signals(first, second):
        if has_pose and "platform_" in f"{one.channel} {two.channel}":
            continue
        found = _correlated(one, two, first, second)
        if found is None:
            continue
        better = best is None or (found.is_known, abs(found.correlation)) > (
            best.is_known,
            abs(best.correlation),
        )
        if better:
            best = found
    return best


def _correlated(
    one: TimedSignal, two: TimedSignal, first: Streams, second: Streams
) -> Agreement | None:
    """Largest correlation of two signals; of a torque with a force without its friction."""
    bases = [signal.channel.rpartition(".")[2] for signal in (one, two)]
    if bases.count(TORQUE) == 1:
        is_first = bases[0] == TORQUE
        torque, force = (one, two) if is_first else (two, one)
        name = f"{torque.channel.removesuffix(TORQUE)}motor_angle"
        angles = signals_by_base(first if is_first else second).get("motor_angle", ())
        for angle in angles:
            if angle.channel == name:
                return correlated_without_friction(torque, force, angle, is_first=is_first)
    return correlated(one, two)


def span_of(streams: Streams) -> tuple[float, float]:
    """First and last time of a file, s."""
    times = [item.time for item in streams.streams if len(item.time)]
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)


def shifted(streams: Streams, lag: float, drift: float = 0.0, reference: float = 0.0) -> Streams:
    """Streams on another clock: t + lag + drift (t − reference), s."""
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

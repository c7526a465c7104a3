"""Channels in SI with their own time stamps, from a table and its assignments."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import Fault
from winchkit.model.rotation import quaternion_of
from winchkit.runs.align import values_at
from winchkit.runs.importing.assignment import Assignment, Guess
from winchkit.runs.importing.clocks.row_order import STILL, rows_in_order
from winchkit.runs.importing.formats.point_table import names_of_points
from winchkit.runs.importing.formats.stamps import epoch_unit, read_stamps
from winchkit.runs.importing.long_table import axes_of
from winchkit.runs.importing.orientation import rotation_as
from winchkit.runs.importing.stored.numbers import range_of, restored
from winchkit.runs.importing.table import ColumnTable, FileColumn, clock_before
from winchkit.schema.mapping import ANGLES, DATE, EXCEL, MATRIX, QUATERNION, STAMP

_PADDED = 0.67
"""Share of rows with a value below which a column has a rate of its own: half the rate or less."""
_BRIDGED = 2.5
"""Median intervals of a channel over which it is interpolated."""
_SLOW = ("temperature", "swivel")
"""Channels that do not determine the rows of a run."""
_EXCEL_EPOCH = 25_569.0
"""1970-01-01 in days since 1899-12-30."""
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:(\.\d{3}){2,}|(,\d{3}){2,})")
"""Whole numbers with separators of thousands: one separator alone may be a decimal sign."""


@dataclass(frozen=True)
class Stream:
    """Channels that are sampled together."""

    time: Array
    """s, on the clock of the file, from its first stamp; shape (n,)."""
    channels: dict[str, Array]
    """Values in SI by channel, shape (n,)."""
    rows: NDArray[np.intp]
    """Row of the table, shape (n,)."""

    def at(self, samples: NDArray[np.bool_] | NDArray[np.intp] | slice) -> Stream:
        """The same channels at some of the samples, by a mask or in an order."""
        channels = {name: values[samples] for name, values in self.channels.items()}
        return Stream(self.time[samples], channels, self.rows[samples])

    @property
    def interval(self) -> float:
        """Median interval, s; NaN with one sample."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else math.nan


@dataclass(frozen=True)
class Streams:
    """All streams of one file."""

    path: str
    streams: tuple[Stream, ...]
    origin: float
    """Time 0 on the clock of the file, s."""
    is_absolute: bool
    """Whether the clock of the file counts from 1970 UTC."""
    has_time: bool
    """Whether the rows have times; rows of poses may have none."""
    line_of: Callable[[int], int | None]
    faults: tuple[Fault, ...] = ()
    notes: tuple[str, ...] = field(default=())
    wraps: Mapping[str, float] = field(default_factory=dict)
    """Range in SI of every channel whose numbers wrap."""
    names: tuple[Sequence[str], ...] = ()
    """Columns that may be the names of points, a text per row of the table."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all channels."""
        return tuple(name for stream in self.streams for name in stream.channels)


def streams_of(guess: Guess) -> Streams:
    """Convert the used columns of a table to SI."""
    if guess.axis:
        return _of_axes(guess)
    table = guess.table
    used = {item.source: item for item in guess.used}
    columns = {c.source: c for c in table.columns if c.source in used}
    faults = [*table.faults, *_cell_faults(table, columns, used)]
    notes = list(table.notes)
    clocks = [columns[s] for s, item in used.items() if item.channel == "time"]
    if guess.sample_rate:
        clocks = []
    dates = {columns[s].group: columns[s] for s, item in used.items() if item.channel == DATE}
    read = {c.source: _clock(c, used[c.source], dates.get(c.group)) for c in clocks}
    absolute = [first for first, _, is_absolute in read.values() if is_absolute]
    origin = min((first for first, _, _ in read.values()), default=0.0)
    blocks: dict[str, dict[str, Array]] = {}
    for source, column in columns.items():
        item = used[source]
        if item.channel in {"time", DATE}:
            continue
        clock = clock_before(clocks, column)
        key = clock.source if clock is not None else f"\0{len(column)}"
        blocks.setdefault(key, {})[item.channel] = column.values
    assigned = {item.channel: item for item in guess.used}
    conventions = [rotation_as(item.stored) for item in guess.used if item.channel in ANGLES]
    convention = next(filter(None, conventions), None)
    streams = []
    for key, channels in blocks.items():
        first, time, _ = read.get(key, (0.0, None, False))
        count = len(next(iter(channels.values())))
        if time is None:
            time = np.arange(count, dtype=np.float64) / (guess.sample_rate or 1.0)
        elif len(time) != count:
            faults.append(
                Fault(f"column '{key}' has {len(time)} times for {count} values", table.path)
            )
            continue
        else:
            time = time + (first - origin)
        stream = Stream(time, channels, np.arange(count))
        stream, timeless = _with_times(stream, table.line_of)
        stream, early = _in_order(_forward(stream), table.line_of)
        stream, note = _without_copies(stream)
        notes += [*timeless, *early, *note]
        # Numbers that wrap are unwrapped in the order of time, without the rows left out.
        known = {name: _in_si(own, assigned[name]) for name, own in stream.channels.items()}
        stream = replace(stream, channels=_with_quaternion(known, convention))
        streams += _by_rate(stream)
    is_absolute = bool(absolute) and len(absolute) == len(read)
    return Streams(
        table.path,
        tuple(streams),
        origin,
        is_absolute,
        bool(clocks) or bool(guess.sample_rate),
        table.line_of,
        tuple(faults),
        tuple(notes),
        {item.channel: range_of(item.stored) * abs(item.factor) for item in guess.used},
        names_of_points(table, used),
    )


def _in_si(values: Array, item: Assignment) -> Array:
    """Numbers of a column in SI."""
    with np.errstate(over="ignore"):
        return np.asarray(restored(values, item.stored) * item.factor + item.offset)


def _of_axes(guess: Guess) -> Streams:
    """Streams of a table in long form: channels have the name of their axis before them."""
    parts = {
        name: streams_of(replace(guess, table=table, axis="", whole=None))
        for name, table in axes_of(guess.file, guess.axis).items()
    }
    origin = min(part.origin for part in parts.values())
    streams = [
        Stream(
            stream.time + (part.origin - origin),
            {f"{name}.{channel}": values for channel, values in stream.channels.items()},
            stream.rows,
        )
        for name, part in parts.items()
        for stream in part.streams
    ]
    first = next(iter(parts.values()))
    return replace(
        first,
        streams=tuple(streams),
        origin=origin,
        line_of=guess.file.line_of,
        faults=tuple(dict.fromkeys(fault for part in parts.values() for fault in part.faults)),
        notes=tuple(dict.fromkeys(note for part in parts.values() for note in part.notes)),
        wraps={f"{n}.{c}": size for n, part in parts.items() for c, size in part.wraps.items()},
    )


def _cell_faults(
    table: ColumnTable, columns: dict[str, FileColumn], used: dict[str, Assignment]
) -> list[Fault]:
    found = []
    for source, column in columns.items():
        wrong = list(column.wrong)
        if column.texts is not None and used[source].channel in {"time", DATE}:
            stamps = [(row, column.texts[row]) for row in read_stamps(column.texts).wrong]
            if 2 * len(stamps) > len(column.texts):
                found.append(_no_times(table, source, stamps))
            else:
                wrong += stamps
        elif column.texts is not None:
            message = f"column '{source}' has text, e.g. {column.texts[0]!r}, and no numbers"
            found.append(Fault(message, table.path, table.line_of(0)))
        kind = "stamp" if column.texts is not None else "number"
        found += [
            Fault(f"column '{source}' has {text!r}, not a {kind}", table.path, table.line_of(row))
            for row, text in wrong
        ]
    return found


def _no_times(table: ColumnTable, source: str, wrong: Sequence[tuple[int, str]]) -> Fault:
    """Fault of a column of text that is given as the time and has neither numbers nor stamps."""
    grouped = [(row, text) for row, text in wrong if _THOUSANDS.fullmatch(text)]
    row, text = (grouped or [*wrong])[0]
    message = f"column '{source}' has text, e.g. {text!r}, and neither numbers nor stamps"
    if grouped:
        message += ": separators of thousands; write the numbers without them"
    return Fault(message, table.path, table.line_of(row))


def _clock(
    column: FileColumn, item: Assignment, day: FileColumn | None
) -> tuple[float, Array, bool]:
    """First stamp, s; times from it, s; and whether the first one counts from 1970."""
    if item.unit == STAMP:
        stamps = read_stamps(column.texts or ())
        values, absolute = stamps.values, stamps.has_date
        if day is not None and day.texts is not None and not absolute:
            dates = read_stamps(day.texts).values
            # A date beside each time of day replaces the count of midnights.
            values, absolute = dates + np.mod(values, 86_400.0), True
    elif item.unit == EXCEL:
        values, absolute = (column.values - _EXCEL_EPOCH) * 86_400.0, True
    else:
        absolute = epoch_unit(column.values) == item.unit
        counted = restored(column.values, item.stored)
        known = counted[np.isfinite(counted)]
        raw = float(known[0]) if len(known) else 0.0
        # The difference first: nanoseconds since 1970 have no digits left for its fraction.
        return raw * item.factor + item.offset, (counted - raw) * item.factor, absolute
    known = values[np.isfinite(values)]
    first = float(known[0]) if len(known) else 0.0
    return first, values - first, absolute


def _with_quaternion(
    channels: dict[str, Array], convention: Callable[[Array], Array] | None
) -> dict[str, Array]:
    """A quaternion in place of numbers of a convention, or of the elements of a matrix."""
    names = ANGLES if convention and set(ANGLES) <= channels.keys() else MATRIX
    others = {name: values for name, values in channels.items() if name not in names}
    if not set(names) <= channels.keys():
        return others
    parts = np.stack([channels[name] for name in names], axis=-1)
    matrix = convention(parts) if convention and names is ANGLES else parts.reshape(-1, 3, 3)
    return {**others, **_quaternion(matrix)}


def _quaternion(matrix: Array) -> dict[str, Array]:
    """Quaternion of rotation matrices (n, 3, 3), NaN where one has a NaN."""
    known = np.isfinite(matrix).all(axis=(1, 2))
    quaternion = np.full((len(matrix), 4), np.nan)
    quaternion[known] = quaternion_of(matrix[known])
    return dict(zip(QUATERNION, quaternion.T, strict=True))


def _forward(stream: Stream) -> Stream:
    """The latest row last, in a file that has it first."""
    steps = np.diff(stream.time)
    is_backward = len(steps) > 0 and bool(np.all(steps < 0))
    return stream.at(slice(None, None, -1)) if is_backward else stream


def _with_times(stream: Stream, line_of: Callable[[int], int | None]) -> tuple[Stream, list[str]]:
    """Without a few rows that have no stamp, with a note."""
    kept = np.isfinite(stream.time)
    is_few = np.count_nonzero(~kept) <= STILL * len(kept)
    return _kept(stream, kept, "no time", line_of) if is_few else (stream, [])


def _in_order(stream: Stream, line_of: Callable[[int], int | None]) -> tuple[Stream, list[str]]:
    """Without a few single rows whose stamps are out of order, with a note."""
    return _kept(stream, rows_in_order(stream.time), "a time that is out of order", line_of)


def _kept(
    stream: Stream, kept: NDArray[np.bool_], words: str, line_of: Callable[[int], int | None]
) -> tuple[Stream, list[str]]:
    """Some of the rows, with a note on the others."""
    wrong = np.flatnonzero(~kept)
    if not len(wrong):
        return stream, []
    lines = [line for row in wrong if (line := line_of(int(stream.rows[row])))]
    where = f" (line {', '.join(map(str, lines))})" if lines else ""
    count = f"{len(wrong)} of {len(stream.time)} rows"
    return stream.at(kept), [f"{count}{where} have {words} and are left out"]


def _without_copies(stream: Stream) -> tuple[Stream, list[str]]:
    """Without rows that repeat the one before with its stamp, few others at one, and empty rows."""
    table = np.stack([stream.time, *stream.channels.values()], axis=1)
    same = np.zeros(len(table), dtype=bool)
    same[1:] = np.all((table[1:] == table[:-1]) | (np.isnan(table[1:]) & np.isnan(table[:-1])), 1)
    empty = np.all(np.isnan(table[:, 1:]), axis=1)
    notes = []
    if count := int(np.count_nonzero(same & ~empty)):
        notes.append(f"{count} rows that repeat the row before them are left out")
    left_out = same | empty
    found = stream.at(~left_out) if left_out.any() else stream
    still = np.zeros(len(found.time), dtype=bool)
    still[1:] = np.diff(found.time) == 0
    count = int(np.count_nonzero(still))
    if 0 < count <= STILL * len(still):
        notes.append(
            f"{count} of {len(still)} rows have the stamp of the row before them and are left out"
        )
        return found.at(~still), notes
    return found, notes


def _by_rate(stream: Stream) -> list[Stream]:
    """Streams of one rate each, where empty cells stand between the samples of slower channels."""
    known = {name: np.isfinite(values) for name, values in stream.channels.items()}
    counts = {name: int(np.count_nonzero(mask)) for name, mask in known.items()}
    padded = [name for name, count in counts.items() if count < _PADDED * len(stream.time)]
    if not padded or not all(_is_spread(known[name]) for name in padded if counts[name] > 1):
        return [stream]
    found: dict[bytes, list[str]] = {}
    for name in stream.channels:
        mask = known[name] if name in padded else known[name] | np.True_
        found.setdefault(mask.tobytes(), []).append(name)
    streams = []
    for names in found.values():
        only = replace(stream, channels={name: stream.channels[name] for name in names})
        streams.append(only.at(np.any([known[name] for name in names], axis=0)))
    return streams


def _is_spread(known: NDArray[np.bool_]) -> bool:
    """Whether values stand at even distances over the rows, and not in a few blocks."""
    steps = np.diff(np.flatnonzero(known))
    return float(np.percentile(steps, 90)) <= 2.0 * max(1.0, float(np.median(steps)))


def merged(parts: Sequence[Stream]) -> tuple[Array, dict[str, Array], NDArray[np.intp] | None]:
    """One time base for several streams of one clock: the samples of the slowest with channels.

    Others are interpolated there, and NaN without neighbours. Rows (n,) are None where channels of
    several streams are in a row.
    """
    if len(parts) == 1:
        return parts[0].time, parts[0].channels, parts[0].rows
    bases = [
        item
        for item in parts
        if any(name.rpartition(".")[2] not in _SLOW for name in item.channels)
    ]
    base = max(bases or parts, key=lambda item: item.interval)
    channels: dict[str, Array] = dict(base.channels)
    for item in parts:
        if item is base or not item.channels:
            continue
        gap = _BRIDGED * item.interval if len(item.time) > 1 else 0.0
        for name, values in item.channels.items():
            known = np.isfinite(values)
            found = values_at(item.time[known], values[known][:, None], base.time, gap)
            channels[name] = found[:, 0]
    kept = _covered(base, channels)
    return base.time[kept], {name: values[kept] for name, values in channels.items()}, None


def _covered(base: Stream, channels: dict[str, Array]) -> slice:
    """Rows between the first and the last with a value of every channel but the slow ones."""
    needed = [v for name, v in channels.items() if name.rpartition(".")[2] not in _SLOW]
    complete = np.flatnonzero(np.all([np.isfinite(values) for values in needed], axis=0))
    return slice(complete[0], complete[-1] + 1) if len(complete) else slice(0, len(base.time))

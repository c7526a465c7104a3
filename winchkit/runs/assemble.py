"""Construction of a run from a file's columns: SI units, one time base, all faults collected."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError, UsageError, suggest
from winchkit.runs.columns import column_dimension, near_miss, unit_fault
from winchkit.runs.run import Channel, Run
from winchkit.schema.mapping import POSE_DIMENSIONS
from winchkit.units import UNITS, convert, factor, parse

_SHOWN = 20
"""Faults of a file that are listed; the others are counted. About one screen."""
_LATEST = 9.2e9
"""Largest time stamp, s: nanoseconds in 64 bits, as MCAP and most instruments count."""


@dataclass
class RawColumns:
    """A file's columns before conversion."""

    path: str
    header: Sequence[tuple[str, str]]
    """Name and unit of each column."""
    columns: Sequence[Array | None]
    """Values in the file's units; None for an unknown column with text."""
    line_of: Callable[[int], int | None] = lambda _row: None
    """Line of a row; None where the source has no lines."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    metadata_lines: Mapping[str, int] = field(default_factory=dict)
    header_line: int | None = None
    notes: Sequence[str] = ()
    faults: Sequence[Fault] = ()
    """Faults of single cells."""
    is_part: bool = False
    """Whether it is a part of a log, which may have no rows."""

    @property
    def rows(self) -> int:
        """Number of samples."""
        return next((len(values) for values in self.columns if values is not None), 0)


def refuse(faults: Sequence[Fault]) -> None:
    """Raise RunError with the first faults and the number of the others, if there are any."""
    if not faults:
        return
    shown = list(faults[:_SHOWN])
    if len(faults) > _SHOWN:
        shown.append(Fault(f"and {len(faults) - _SHOWN} more faults", faults[0].path))
    raise RunError(shown)


def assemble(recording: RawColumns) -> Run:
    """Convert and check a recording; raises RunError with every fault of it."""
    names = [name for name, _ in recording.header]
    early = [*_header_faults(recording, names), *_metadata_faults(recording), *recording.faults]
    refuse(sorted(early, key=lambda fault: fault.line or 0))
    metadata, notes = dict(recording.metadata), [*recording.notes, *_near_misses(names)]
    channels: dict[str, Channel] = {}
    faults: list[Fault] = []
    for number, ((name, unit), values) in enumerate(
        zip(recording.header, recording.columns, strict=True), start=1
    ):
        if values is None:
            notes.append(f"column {number} '{name}' contains text and is left out")
            continue
        channels[name] = _channel(name, unit, values, number)
        if column_dimension(name) is not None:
            faults += _infinite(recording, name, channels[name].values)
    time = channels.pop("time", None)
    if time is None:
        metadata.setdefault("time", "row number")
        notes.append("there is no column 'time'; the number of the row is used instead")
        time = Channel(np.arange(recording.rows, dtype=np.float64), "s")
    refuse([*faults, *_time_faults(recording, time.values)])
    path = recording.path
    return Run(Path(path).stem, time.values, channels, metadata, path, tuple(notes))


def _header_faults(recording: RawColumns, names: list[str]) -> Iterator[Fault]:
    path, line = recording.path, recording.header_line
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            places = ", ".join(str(n) for n, other in enumerate(names, 1) if other == name)
            yield Fault(f"{names.count(name)} columns are called '{name}': {places}", path, line)
    for name, unit in dict.fromkeys(recording.header):
        dimension = column_dimension(name)
        if dimension is not None and (reason := unit_fault(name, unit, dimension)):
            yield Fault(reason, path, line)
    is_poses = _is_poses(names)
    if "time" not in names and not is_poses:
        yield _missing("time [s]", names, recording)
    # Of a cell alone, a run of readings without motion: its health, or its static calibration.
    kinds = {name.rpartition(".")[2] for name in names}
    is_misspelt = any(near_miss(name) == "motor_angle" for name in kinds)
    moves = not kinds.isdisjoint({"motor_angle", "position"})
    if not moves and (is_misspelt or kinds.isdisjoint({"tension", "load"})):
        yield _missing("motor_angle [rad]", names, recording)
    if names and _is_foreign(recording):
        file = shlex.quote(path)
        yield Fault(f"'winchkit import {file} -o runs' reads files of other programs", path, line)
    rows, needed = recording.rows, 0 if recording.is_part else 1 if is_poses else 2
    if rows < needed:
        there = "has no rows after its header" if rows == 0 else "has one row only"
        yield Fault(f"the run {there}; it needs at least {needed}", path)


def _is_foreign(recording: RawColumns) -> bool:
    """Whether no column has a unit, or none a known name or a similar one."""
    names = [name for name, _ in recording.header]
    known = any(column_dimension(name) or near_miss(name) for name in names)
    return not known or not any(unit for _, unit in recording.header)


def _is_poses(names: list[str]) -> bool:
    """Whether a row is a pose of a robot, which needs no time."""
    return any(name in POSE_DIMENSIONS or name.endswith(".motor_angle") for name in names)


def _missing(column: str, names: list[str], recording: RawColumns) -> Fault:
    known = f"; it has {', '.join(names)}" if names else ""
    message = f"there is no column '{column}'{known}" + suggest(column.split(maxsplit=1)[0], names)
    return Fault(message, recording.path, recording.header_line)


def _metadata_faults(recording: RawColumns) -> Iterator[Fault]:
    metadata = recording.metadata
    reasons = {}
    if "load_mass" in metadata:
        try:
            if parse(metadata["load_mass"], "mass") < 0:
                reasons["load_mass"] = f"'{metadata['load_mass']}' is below zero"
        except UsageError as error:
            reasons["load_mass"] = str(error)
    zeroed = metadata.get("length_zeroed", "false").strip().lower()
    if zeroed not in {"true", "false", "yes", "no", "1", "0"}:
        reasons["length_zeroed"] = f"'{zeroed}' is neither true nor false"
    for key, reason in reasons.items():
        yield Fault(reason, recording.path, recording.metadata_lines.get(key), key)


def _near_misses(names: list[str]) -> Iterator[str]:
    for name in names:
        if column_dimension(name) is None and (close := near_miss(name)):
            yield f"column '{name}' is kept and not used; did you mean '{close}'?"


def _channel(name: str, unit: str, values: Array, number: int) -> Channel:
    dimension = column_dimension(name)
    if dimension is None:
        return Channel(values, unit, number)
    unit = unit or "1"
    si, shift = factor(unit, dimension), convert(0.0, unit, dimension)
    if si != 1.0 or shift != 0.0:
        with np.errstate(over="ignore"):  # an infinite result is a fault, reported with its line
            values = values * si + shift
    return Channel(values, next(iter(UNITS[dimension])), number)


def _infinite(recording: RawColumns, name: str, values: Array) -> Iterator[Fault]:
    for row in np.flatnonzero(np.isinf(values)):
        message = f"column '{name}' is infinite; leave the cell empty where there is no value"
        yield Fault(message, recording.path, recording.line_of(int(row)))


def _time_faults(recording: RawColumns, time: Array) -> Iterator[Fault]:
    """Every sample has a time, later than the one before it."""
    for row in np.flatnonzero(np.isnan(time)):
        yield Fault("time is missing here", recording.path, recording.line_of(int(row)))
    for row in np.flatnonzero(np.isfinite(time) & (np.abs(time) > _LATEST)):
        message = (
            f"time {time[row]:.9g} s is beyond ±{_LATEST:g} s (290 years); the column 'time' is in "
            "seconds: write its unit, e.g. 'time [ms]'"
        )
        yield Fault(message, recording.path, recording.line_of(int(row)))
    yield from order_faults(recording.path, time, recording.line_of)


def order_faults(
    path: str, time: Array, line_of: Callable[[int], int | None], origin: float = 0.0
) -> Iterator[Fault]:
    """Times (n,), s after ``origin``, that are not later than the one before."""
    for row in np.flatnonzero(time[1:] <= time[:-1]) + 1:
        earlier, later = origin + time[row - 1], origin + time[row]
        word = "stands still at" if later == earlier else f"goes back from {earlier:.9g} s to"
        message = f"time {word} {later:.9g} s; rows must come in order of time, each once"
        yield Fault(message, path, line_of(int(row)))

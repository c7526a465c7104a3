"""Runs from files of other programs: one by one, by a mapping, or joined."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError
from winchkit.runs.assemble import RawColumns, assemble, order_faults, refuse
from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.assignment import Guess
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.mapping import guess_by, mapping_id
from winchkit.runs.importing.pieces import jumps_of
from winchkit.runs.importing.streams import Stream, Streams, merged, streams_of
from winchkit.runs.linear_axis import is_linear
from winchkit.runs.run import ANGLE_INTEGRATED, Run
from winchkit.schema.linear_axis import rotary_name
from winchkit.schema.mapping import ImportMapping
from winchkit.schema.read import read_mapping
from winchkit.units import UNITS

_INTEGRAL = (
    "no column has the motor angle: it is the integral of motor_velocity from 0, so that its "
    "absolute value is unknown and an offset of the velocity is a drift of the angle"
)

_OWN = ("load_mass", "length_zeroed", "programme")
"""Metadata that winchkit uses, in a file that has its names."""
_MOST, _LONGEST = 40, 200
"""Lines above the header that are kept, and their characters."""
_DIGITS = 12
"""Decimals of a time in seconds: differences of stamps have no more."""


def read_mapped(path: str | Path, mapping: str | Path | ImportMapping) -> Run:
    """Read a file of another program by a mapping; raises RunError, FileError for the mapping."""
    read = mapping if isinstance(mapping, ImportMapping) else read_mapping(mapping)
    guess = guess_by(read_table(path), read)
    streams = streams_of(guess)
    streams = streams if has_angle(streams) else with_angle(streams)
    return whole_run(streams, metadata_of(guess, {"imported_mapping": mapping_id(read)}))


def whole_run(streams: Streams, metadata: Mapping[str, str]) -> Run:
    """Run of one file as :func:`run_of`; raises RunError where its angle jumps."""
    if jumps := jumps_of(streams):
        advice = "; winchkit import writes the pieces before and after it as runs of their own"
        raise RunError([Fault(f"{jump.text}{advice}", streams.path) for jump in jumps])
    return run_of(streams, metadata)


def metadata_of(guess: Guess, more: Mapping[str, str]) -> dict[str, str]:
    """Metadata of an imported run; keys of the file have the prefix ``source``."""
    table = guess.table
    own = {
        key if key in _OWN else f"source {_one_line(key.replace(':', ' '))}": _one_line(value)
        for key, value in islice(table.metadata.items(), _MOST)
        if value
    }
    return {
        "imported_from": Path(table.path).name,
        "imported_format": table.layout,
        **more,
        **own,
    }


def _one_line(text: str) -> str:
    return " ".join(text.split())[:_LONGEST]


def has_angle(streams: Streams) -> bool:
    """Whether a file has a motor angle or a position, without which there is no run."""
    return any(rotary_name(name.rpartition(".")[2]) == "motor_angle" for name in streams.channels)


def has_cell(streams: Streams) -> bool:
    """Whether a file has a load cell, of which a recording without motion is a run too."""
    return any(name.rpartition(".")[2] in ("tension", "load") for name in streams.channels)


def with_angle(streams: Streams) -> Streams:
    """Add the motor angle of a recording that has the motor velocity only.

    Trapezoidal rule between the samples that have a velocity; the angle is NaN where it is NaN.
    """
    if not streams.has_time:
        return streams
    parts, is_found = [], False
    for part in streams.streams:
        own = dict(part.channels)
        for name, values in part.channels.items():
            winch, dot, base = name.rpartition(".")
            if rotary_name(base) == "motor_velocity":
                angle = "position" if base == "velocity" else "motor_angle"
                own[f"{winch}{dot}{angle}"] = _integral(part.time, values)
                is_found = True
        parts.append(Stream(part.time, own, part.rows))
    if not is_found:
        return streams
    return replace(streams, streams=tuple(parts), notes=(*streams.notes, _INTEGRAL))


def _integral(time: Array, velocity: Array) -> Array:
    known = np.isfinite(time) & np.isfinite(velocity)
    t, v = time[known], velocity[known]
    angle = np.full(len(velocity), np.nan)
    angle[known] = np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))))[: len(t)]
    return angle


def run_of(streams: Streams, metadata: Mapping[str, str]) -> Run:
    """Run of one file.

    ``streams``: channels in SI. Returns: time from the first row; ``start_time`` in the metadata
    where the clock has a date. Raises RunError with every fault of the file.
    """
    faults = list(streams.faults)
    if len(streams.streams) > 1:
        found = (fault for item in streams.streams for fault in _time_faults(streams, item))
        # A row that has channels of several rates is one fault.
        faults += {fault.line: fault for fault in found}.values()
    if streams.streams and not has_angle(streams) and not has_cell(streams):
        message = (
            f"has no motor angle and no position (it has {', '.join(streams.channels)}); import it "
            "together with the file that has it, which joins the two, or name its column by "
            "--column"
        )
        faults.append(Fault(message, streams.path))
    if not streams.streams:
        faults.append(Fault("has no channel of a run", streams.path))
    refuse(sorted(faults, key=lambda fault: fault.line or 0))
    time, channels, rows = merged(streams.streams)
    known = time[np.isfinite(time)]
    first = float(known[0]) if len(known) else 0.0
    texts = dict(metadata)
    if _INTEGRAL in streams.notes:
        texts["position" if is_linear(channels) else "motor_angle"] = ANGLE_INTEGRATED
    if streams.is_absolute:
        moment = datetime.fromtimestamp(streams.origin + first, UTC)
        texts["start_time"] = moment.isoformat(timespec="microseconds")
    elif streams.has_time and streams.origin + first:
        texts["source time of 0"] = f"{streams.origin + first:.9g} s"
    header = [(name, next(iter(UNITS[column_dimension(name) or "ratio"]))) for name in channels]
    columns = list(channels.values())
    if streams.has_time:
        header, columns = [("time", "s"), *header], [np.round(time - first, _DIGITS), *columns]

    def line_of(row: int) -> int | None:
        return streams.line_of(int(rows[row])) if rows is not None else None

    recording = RawColumns(streams.path, header, columns, line_of, texts, notes=streams.notes)
    try:
        return assemble(recording)
    except RunError:
        if streams.has_time and (advice := _coarse_clock(time)):
            raise RunError(Fault(advice, streams.path)) from None
        raise


def _coarse_clock(time: Array) -> str:
    """Advice for stamps that repeat because their resolution is coarser than the sampling."""
    steps = np.diff(time[np.isfinite(time)])
    repeated = int(np.count_nonzero(steps == 0))
    if np.count_nonzero(steps) < 2 or repeated < 0.05 * len(steps) or np.any(steps < 0):
        return ""
    # From the first change on: the rows before it are fewer than those of a whole step.
    first, *_, last = np.flatnonzero(steps)
    rate = (last - first) / float(np.sum(steps[first + 1 : last + 1]))
    return (
        f"{repeated} of {len(steps) + 1} time stamps repeat the one before: the clock is coarser "
        f'than the sampling. --sample-rate "{rate:.4g} Hz" gives equal steps in place of them'
    )


def _time_faults(streams: Streams, stream: Stream) -> Iterator[Fault]:
    """Stamps that are missing or do not increase, as the file has them."""

    def line_of(row: int) -> int | None:
        return streams.line_of(int(stream.rows[row]))

    for row in np.flatnonzero(~np.isfinite(stream.time)):
        yield Fault("time is missing here", streams.path, line_of(int(row)))
    origin = 0.0 if streams.is_absolute else streams.origin
    yield from order_faults(streams.path, stream.time, line_of, origin)

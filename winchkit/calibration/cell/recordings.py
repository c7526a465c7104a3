"""Recordings of load cells alone, without any motion, and their health."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from winchkit.arguments import path_of
from winchkit.arrays import Array
from winchkit.calibration.cell.health import (
    CellSamples,
    Health,
    examine,
    line_fit,
    lost_readings,
    step_at,
)
from winchkit.drivers.reading import Quality
from winchkit.errors import Fault, RunError
from winchkit.quantity_text import with_std
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.log import Log
from winchkit.runs.read import read_log
from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.inspection import inspect_run
from winchkit.runs.sanity.outliers import outlier_mask, spike_size
from winchkit.runs.sanity.quantisation import resolution
from winchkit.runs.sanity.saturation import at_limit
from winchkit.schema.mapping import DATE

_FORCES = ("tension_gross", "tension", "load_gross", "load")
"""Channels of a cell; that before any tare first."""
_BESIDE = "temperature"
_TOPICS = ("cell", "load")
_FULL_SCALE = 0.005
"""Distance from the end of a converter's range at which a spike is a word of bits that are all
equal, as a share of the range."""
_BITS = (16, 24, 32)
_SIGNIFICANT = 4.0
"""Standard errors."""
_SATURATED = Quality.OVERLOAD | Quality.UNDERLOAD


@dataclass(frozen=True)
class CellRecording:
    """Readings of one cell in the unit of the file."""

    name: str
    """Column of the file, or ``A.cell`` of a log."""
    unit: str
    """Empty where the file gives none."""
    samples: CellSamples
    temperature: Array | None = None
    """Shape (n,), in the unit of the file."""


@dataclass(frozen=True)
class CellFindings:
    """Health of a recorded cell.

    Attributes
    ----------
    name : str
        As of the recording.
    unit : str
        As of the recording.
    health : Health
        Counts of all readings; noise, drift, hum and mean of the longest stretch without a change
        of load and without spikes, creep after the largest change.
    spikes : int
        Single readings far from both neighbours.
    largest_spike : float
        Their largest distance from the neighbours; 0 without spikes.
    temperature_slope : float
        Change of the reading with the temperature; NaN without a temperature.
    temperature_slope_std : float
        Its standard error.
    remarks : tuple of str
        What is wrong, or limits what can be concluded.
    """

    name: str
    unit: str
    health: Health
    spikes: int
    largest_spike: float
    temperature_slope: float
    temperature_slope_std: float
    remarks: tuple[str, ...]


def recorded_cell_health(
    path: str | Path, column: str | None = None, sample_rate: float | None = None
) -> tuple[CellFindings, ...]:
    """Examine recordings of load cells, which need no motion and no calibration.

    Parameters
    ----------
    path : str or Path
        A run, a log, or a file of another program in any format of ``winchkit import``.
    column : str, optional
        Name or number of the cell's column; by default all columns that are a cell's.
    sample_rate : float, optional
        Rate of the rows of a file without times, Hz.

    Returns
    -------
    tuple of CellFindings
        One for each cell, in the unit of the file.

    Raises
    ------
    RunError
        For a file without times or cells, or with fewer than 20 usable readings.
    """
    found = read_cell_recordings(path, column, sample_rate)
    return tuple(examine_recording(item) for item in found)


def read_cell_recordings(
    path: str | Path, column: str | None = None, sample_rate: float | None = None
) -> tuple[CellRecording, ...]:
    """Read the cells of a file; as :func:`recorded_cell_health`."""
    file = path_of(path)
    if file.suffix.lower() == ".mcap" and (log := _own_log(file)) is not None:
        return tuple(_of_log(log, column))
    return _of_table(read_table(file), column, sample_rate)


def _own_log(path: Path) -> Log | None:
    """A log of winchkit; None for MCAP files of other programs."""
    try:
        return read_log(path)
    except RunError:
        return None


def _of_log(log: Log, wanted: str | None) -> Iterator[CellRecording]:
    names = {source.topic.strip("/").replace("/", "."): source for source in log.layout.sources}
    cells = [name for name in names if name.rpartition(".")[2] in _TOPICS]
    chosen = [name for name in cells if wanted in (None, name, name.rpartition(".")[0])]
    if not chosen:
        listed = ", ".join(cells) or "none"
        raise RunError(Fault(f"has no cell '{wanted or ''}'; its cells are {listed}", log.path))
    for name in chosen:
        source, samples = names[name], log.samples[names[name].topic]
        place = {signal.name: number for number, signal in enumerate(source.signals)}
        flags = [Quality(int(flag)) for flag in samples.values[:, place["quality"]]]
        usable = np.array([flag.usable for flag in flags], dtype=bool)
        saturated = np.array([bool(flag & _SATURATED) for flag in flags], dtype=bool)
        value, raw = samples.values[:, place["gross"]], samples.values[:, place["raw"]]
        found = CellSamples(samples.times, raw, value, usable & np.isfinite(value), saturated)
        yield CellRecording(name, "N", found)


def _of_table(
    table: ColumnTable, wanted: str | None, rate: float | None
) -> tuple[CellRecording, ...]:
    guess = guess_columns(table, Answers(sample_rate=rate))
    channel = {item.source: item.channel for item in guess.used}
    if wanted is not None:
        column = table.column(wanted)
        if column is None:
            known = ", ".join(repr(item.source) for item in table.columns)
            raise RunError(Fault(f"there is no column '{wanted}'; there are {known}", table.path))
        cells = [column]
    else:
        cells = list(_cells(table, channel))
    clocks = [item for item in table.columns if channel.get(item.source) in ("time", DATE)]
    if not cells:
        known = ", ".join(repr(item.source) for item in table.columns)
        message = f"no column is a load cell for certain; name it by --column, one of {known}"
        raise RunError(Fault(message, table.path))
    beside = [item for item in table.columns if channel.get(item.source, "").endswith(_BESIDE)]
    return tuple(_of_columns(table, clocks, cell, beside, rate) for cell in cells)


def _cells(table: ColumnTable, channel: dict[str, str]) -> Iterator[FileColumn]:
    """Columns of cells, before any tare; the only column of numbers of a file with a clock."""
    found = {channel.get(item.source, ""): item for item in table.columns}
    for name, column in found.items():
        base = name.rpartition(".")[2]
        if base in _FORCES and f"{name}_gross" not in found:
            yield column
    if not any(name.rpartition(".")[2] in _FORCES for name in found):
        others = [
            item
            for item in table.columns
            if item.texts is None and channel.get(item.source) not in ("time", DATE)
        ]
        yield from others if len(others) == 1 else ()


def _of_columns(
    table: ColumnTable,
    clocks: Sequence[FileColumn],
    cell: FileColumn,
    beside: Sequence[FileColumn],
    rate: float | None,
) -> CellRecording:
    """Times and readings of one column in its own unit."""
    alone = replace(table, columns=(*clocks, cell))
    own = Answers(columns=(read_column(f"tension={cell.number}*1"),), sample_rate=rate)
    streams = streams_of(guess_columns(alone, own))
    if not streams.has_time:
        text = "has no times, which the rate of a cell needs: give the rate by --sample-rate"
        raise RunError(Fault(text, table.path))
    stream = streams.streams[0]
    if faults := streams.faults:
        raise RunError(list(faults))
    steps = np.flatnonzero(np.diff(stream.time) <= 0)
    if len(steps):
        line = table.line_of(int(stream.rows[steps[0] + 1]))
        raise RunError(Fault("the time does not increase here", table.path, line))
    value = stream.channels["tension"]
    temperature = next((c.values for c in beside if len(c) == len(cell)), None)
    usable = np.isfinite(value)
    none = np.zeros(len(value), dtype=bool)
    step = resolution(value)
    raw = value / step if step else np.full(len(value), math.nan)
    return CellRecording(
        cell.source,
        cell.unit,
        CellSamples(stream.time, raw, value, usable, none),
        None if temperature is None else temperature[stream.rows],
    )


def examine_recording(recording: CellRecording) -> CellFindings:
    """Health and findings of a recording; raises RunError for fewer than 20 usable readings."""
    samples = recording.samples
    value = np.where(samples.usable, samples.value, math.nan)
    limited = at_limit(value, resolution(value))
    usable, cut_off = samples.usable & ~limited, samples.saturated | limited
    samples = replace(samples, usable=usable, saturated=cut_off)
    channels = {"tension": Channel(value, recording.unit)}
    inspection = inspect_run(Run(recording.name, samples.time, channels))
    spikes = inspection.outliers.get("tension", np.zeros(len(value), dtype=bool))
    known = np.flatnonzero(samples.usable & ~spikes & np.isfinite(value))
    longest = max(_steady(value[known]), key=len, default=range(0))
    steady = known[longest.start : longest.stop]
    alone = outlier_mask(value[steady])
    spikes[steady] |= alone
    whole = examine(_at(samples, known))
    found = examine(_at(samples, steady[~alone]))
    health = replace(
        found,
        readings=len(value),
        rate=(len(value) - 1) / float(np.ptp(samples.time)),
        usable=int(np.count_nonzero(samples.usable)),
        saturated=int(np.count_nonzero(samples.saturated)),
        longest_gap=float(np.diff(samples.time).max()),
        creep=whole.creep,
    )
    remarks = [*_of_spikes(value, spikes, recording.unit), *found.remarks]
    remarks += [text for text in whole.remarks if "creep" in text]
    remarks += lost_readings(health)
    remarks += [
        item.text.partition(_CODES[item.code])[0]
        for item in inspection.findings
        if item.code in _CODES
    ]
    slope, std = _temperature(recording, usable & ~spikes)
    if abs(slope) > _SIGNIFICANT * std:
        remarks.append(
            f"the reading follows the temperature: {with_std(slope, std, '1')} {recording.unit} "
            "per degree of its column; a drift in time is part of it"
        )
    return CellFindings(
        recording.name,
        recording.unit,
        health,
        int(spikes.sum()),
        spike_size(value, spikes),
        slope,
        std,
        tuple(remarks),
    )


def _steady(value: Array, start: int = 0) -> list[range]:
    """Stretches of readings without a change of load."""
    at = step_at(value)
    if at is None:
        return [range(start, start + len(value))]
    return [*_steady(value[: at + 1], start), *_steady(value[at + 1 :], start + at + 1)]


def _at(samples: CellSamples, rows: NDArray[np.intp]) -> CellSamples:
    return CellSamples(
        samples.time[rows],
        samples.raw[rows],
        samples.value[rows],
        samples.usable[rows],
        samples.saturated[rows],
    )


_CODES = {
    **dict.fromkeys(("repeated-values", "gap", "quantised", "low-pass"), "\n"),
    **{"saturated": "; larger errors", "clock-jitter": ":"},
}
"""Findings of a run's inspection that concern a cell, and where their rest begins, which is on
derivatives or a winch."""


def _of_spikes(value: Array, spikes: NDArray[np.bool_], unit: str) -> Iterator[str]:
    inner = spikes.copy()
    for end, words in ((0, "first"), (-1, "last")):
        if spikes[end]:
            inner[end] = False
            yield f"the {words} reading, {value[end]:.6g} {unit}, is none of the signal beside it"
    count = int(inner.sum())
    if not count:
        return
    text = (
        f"{count} of {len(value)} readings are single spikes of up to "
        f"{spike_size(value, inner):.3g} {unit}; they are left out of all figures"
    )
    for bits in _BITS:
        half = 2.0 ** (bits - 1)
        ends = np.minimum(np.abs(value[inner] + half), np.abs(value[inner] - half + 1))
        if np.all(ends < _FULL_SCALE * half):
            text += (
                f". They lie at the end of a converter of {bits} bits (∓2^{bits - 1}): its words "
                "are read while it converts, or an input is open for a moment"
            )
            break
    yield text


def _temperature(recording: CellRecording, good: NDArray[np.bool_]) -> tuple[float, float]:
    """Slope over the temperature and its standard error; NaN without a temperature that varies."""
    if recording.temperature is None:
        return math.nan, math.nan
    known = good & np.isfinite(recording.temperature)
    x, y = recording.temperature[known], recording.samples.value[known]
    if len(x) < 3 or np.ptp(x) == 0:
        return math.nan, math.nan
    slope, std, _ = line_fit(x, y)
    return slope, std

"""Readers of ASAM MDF files (extra ``mf4``) and of NI TDMS files (extra ``tdms``)."""

from __future__ import annotations

import gc
import html
import io
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError, WinchkitError
from winchkit.extras import library
from winchkit.runs.importing.formats.variables import column_of
from winchkit.runs.importing.table import (
    ColumnTable,
    FileColumn,
    named_apart,
    readable,
    refuse_size,
)

_NUMBERS = "fiub"
"""Kinds of arrays (NumPy) that hold numbers or truth values."""
_TIMES = "mM"


def read_mdf(path: str, data: bytes) -> ColumnTable:
    """Read an MDF file of version 3 or 4, in physical units; invalid samples are NaN.

    Lines ``key: value`` of its comment are metadata. Raises UsageError without asammdf; RunError.
    """
    asammdf = library("asammdf", f"{path}: MDF")
    notes: list[str] = []
    columns: list[FileColumn] = []
    version = comment = failure = ""
    with _failing_destructors():
        try:
            with asammdf.MDF(io.BytesIO(data)) as file:
                count = sum(g.channel_group.cycles_nr * len(g.channels) for g in file.groups)
                refuse_size(path, 8 * count, "channels")
                columns += _channels(file, notes)
                version, comment = str(file.version), str(file.header.comment or "")
        except WinchkitError:
            raise
        except Exception as error:  # noqa: BLE001 - the library raises many kinds
            failure = str(error)
        if failure:
            gc.collect()  # the reader that failed refers to itself
    if failure or not version:
        raise RunError(Fault(f"is not a readable MDF file: {failure}", path))
    return _table(path, f"MDF {version}", columns, _metadata(comment), notes)


def _metadata(comment: str) -> dict[str, str]:
    """Lines ``key: value`` of the comment of an MDF file, which may be the text of an XML block."""
    block = re.search(r"<TX\b[^>]*>(.*?)</TX>", comment, re.DOTALL)
    text = html.unescape(block[1]) if block else comment
    pairs = (line.partition(": ") for line in text.splitlines())
    return {key.strip(): value.strip() for key, mark, value in pairs if mark}


@contextmanager
def _failing_destructors() -> Iterator[None]:
    """asammdf's destructor raises for a file that it could not open, which Python would print."""
    hook, sys.unraisablehook = sys.unraisablehook, lambda _raised: None
    try:
        yield
    finally:
        sys.unraisablehook = hook


def _channels(file: Any, notes: list[str]) -> Iterator[FileColumn]:
    """The channels of numbers of an MDF file, each group's time before its first one."""
    timed: set[int] = set()
    for signal in file.iter_channels(skip_master=True):
        group = int(signal.group_index)
        named = file.groups[group].channel_group.acq_name or f"channel group {group + 1}"
        values = np.asarray(signal.samples)
        if values.ndim != 1 or values.dtype.kind not in _NUMBERS:
            notes.append(f"channel '{signal.name}' has no numbers and is left out")
            continue
        if not len(values):
            continue
        if group not in timed:
            timed.add(group)
            stamps = np.asarray(signal.timestamps, dtype=np.float64)
            yield FileColumn("time", stamps, "s", (named,), group=named)
        numbers = values.astype(np.float64)
        if signal.invalidation_bits is not None:
            numbers[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
        yield FileColumn(signal.name, numbers, signal.unit or "", (named,), group=named)


def read_tdms(path: str, data: bytes) -> ColumnTable:
    """Read a TDMS file of LabVIEW, with scaled values.

    Channels that are waveforms have the time of their increment; those of one group with one time
    are sampled together. Raises UsageError without npTDMS; RunError.
    """
    nptdms = library("nptdms", f"{path}: TDMS")
    notes: list[str] = []
    with readable(path, "TDMS file"):
        file = nptdms.TdmsFile.read(io.BytesIO(data))
        refuse_size(path, 8 * sum(len(c) for g in file.groups() for c in g.channels()), "channels")
        columns = [column for group in file.groups() for column in _of_group(group, notes)]
        metadata = {str(key): str(value) for key, value in file.properties.items()}
    return _table(path, "TDMS", columns, metadata, notes)


def _of_group(group: Any, notes: list[str]) -> Iterator[FileColumn]:
    """The channels of a group; channels of another length or increment are a group of their own."""
    several = len({_timing(channel) for channel in group.channels() if len(channel)}) > 1
    timed: set[tuple[int, float, float]] = set()
    for channel in group.channels():
        values = np.asarray(channel[:]) if len(channel) else np.zeros(0)
        if values.dtype.kind not in _NUMBERS + _TIMES:
            notes.append(f"channel '{channel.name}' has no numbers and is left out")
            continue
        if not len(values):
            continue
        timing = count, increment, _ = _timing(channel)
        own = f"{group.name} ({count} samples, {increment:g} s)" if several else group.name
        if increment > 0 and timing not in timed:
            timed.add(timing)
            yield FileColumn("time", _waveform(timing), "s", (own,), group=own)
        properties = channel.properties
        unit = properties.get("unit_string") or properties.get("NI_UnitDescription") or ""
        found = column_of(channel.name, values, str(unit))
        yield FileColumn(found.name, found.values, found.unit, (own,), group=own)


def _timing(channel: Any) -> tuple[int, float, float]:
    """Samples, increment (s; 0 for no waveform) and offset (s) of a channel."""
    properties = channel.properties
    return (
        len(channel),
        float(properties.get("wf_increment", 0.0)),
        float(properties.get("wf_start_offset", 0.0)),
    )


def _waveform(timing: tuple[int, float, float]) -> Array:
    count, increment, offset = timing
    return np.asarray(offset + increment * np.arange(count))


def _table(
    path: str, layout: str, columns: list[FileColumn], metadata: dict[str, str], notes: list[str]
) -> ColumnTable:
    if not columns:
        raise RunError(Fault("; ".join(["has no channels with numbers", *notes]), path))
    return ColumnTable(path, layout, named_apart(columns), metadata=metadata, notes=tuple(notes))

"""Readers of binary tables by the library of each: MDF, TDMS, NPY, NPZ, Parquet and XLSX."""

from __future__ import annotations

import gc
import html
import io
import re
import sys
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError, WinchkitError
from winchkit.extras import library
from winchkit.runs.importing.formats.dialect import Dialect, has_cell_units
from winchkit.runs.importing.formats.header import Row
from winchkit.runs.importing.formats.text import table_of_rows
from winchkit.runs.importing.formats.variables import column_of, table_of_arrays
from winchkit.runs.importing.table import (
    ColumnTable,
    FileColumn,
    named_apart,
    readable,
    refuse_size,
)

_OBJECTS = (
    "has Python objects, which may hold code; load it in Python where you trust it, and write its "
    "arrays by numpy.savez"
)


def read_numpy(path: str, data: bytes) -> ColumnTable:
    """Read NPY or NPZ; raises RunError, also for arrays of Python objects, which may hold code."""
    try:
        if data.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(data)) as packed:
                refuse_size(path, sum(item.file_size for item in packed.infolist()), "arrays")
        loaded = np.load(io.BytesIO(data), allow_pickle=False)
        arrays = dict(loaded) if hasattr(loaded, "files") else None
    except RunError:
        raise
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, KeyError, MemoryError) as error:
        reason = _OBJECTS if "pickle" in str(error) else error
        raise RunError(Fault(f"is not a readable NumPy file: {reason}", path)) from None
    if arrays is None:
        names = loaded.dtype.names
        arrays = {name: loaded[name] for name in names} if names else {"array": loaded}
    return table_of_arrays(path, "NPZ" if data.startswith(b"PK") else "NPY", arrays)


def read_parquet(path: str, data: bytes) -> ColumnTable:
    """Read Parquet; raises UsageError without pyarrow, RunError for an invalid file."""
    pa = library("pyarrow", f"{path}: Parquet")
    from pyarrow import parquet

    with readable(path, "Parquet file"):
        source = parquet.ParquetFile(io.BytesIO(data))
        shape = source.metadata.num_rows * source.metadata.num_columns
        refuse_size(path, 8 * shape, "columns")
        table = source.read()
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    for field, column in zip(table.schema, table.columns, strict=True):
        own = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        is_number = pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
        is_truth = pa.types.is_boolean(field.type)
        is_text = pa.types.is_temporal(field.type) or pa.types.is_string(field.type)
        if is_number or is_truth or is_text:
            arrays[field.name] = (column.cast(pa.int8()) if is_truth else column).to_numpy()
            units[field.name] = own
    plain_metadata = {
        key.decode("utf-8", "replace"): value.decode("utf-8", "replace")
        for key, value in (table.schema.metadata or {}).items()
        if key not in (b"pandas", b"ARROW:schema")
    }
    return table_of_arrays(path, "Parquet", arrays, units=units, metadata=plain_metadata)


def read_workbook(path: str, data: bytes) -> ColumnTable:
    """Read a workbook; raises UsageError without openpyxl, RunError without rows of numbers."""
    openpyxl = library("openpyxl", f"{path}: XLSX")
    with readable(path, "workbook"):
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            refuse_size(path, sum(item.file_size for item in packed.infolist()), "a workbook")
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {
            sheet.title: _rows(sheet.iter_rows(values_only=True)) for sheet in book.worksheets
        }
    tables = {}
    for title, rows in sheets.items():
        width = max((len(cells) for _, cells in rows), default=0)
        if not width:
            continue
        try:
            spelled = has_cell_units([cells for _, cells in rows], ".")
            dialect = Dialect("\t", ".", _width(rows), spelled)
            tables[title] = table_of_rows(path, _cut(rows, dialect.width), dialect, is_ended=True)
        except RunError:
            continue
    if not tables:
        raise RunError(Fault("has no sheet with rows of numbers", path))
    first = next(iter(tables.values()))
    columns = named_apart(
        [
            replace(item, group=title if len(tables) > 1 else "")
            for title, table in tables.items()
            for item in table.columns
        ]
    )
    return ColumnTable(
        path,
        f"XLSX, sheet {', '.join(tables)}",
        columns,
        first.line_of,
        {key: value for table in tables.values() for key, value in table.metadata.items()},
        faults=tuple(fault for table in tables.values() for fault in table.faults),
        notes=tuple(note for table in tables.values() for note in table.notes),
        interval=first.interval,
    )


def _rows(rows: Iterable[Iterable[object]]) -> list[Row]:
    """Cells as text; without the rows below the last filled one, which have formats only."""
    found = [(n, [_text(cell) for cell in row]) for n, row in enumerate(rows, start=1)]
    while found and not any(found[-1][1]):
        found.pop()
    return found


def _text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "1" if cell else "0"
    if isinstance(cell, datetime | date | time):
        return cell.isoformat()
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    return repr(cell) if isinstance(cell, float) else str(cell).strip()


def _width(rows: list[Row]) -> int:
    """Number of cells up to the last column that is filled in most of the lower rows."""
    lower = [cells for _, cells in rows[len(rows) // 2 :]]
    width = max((len(cells) for cells in lower), default=0)
    while width and not any(len(c) >= width and c[width - 1] for c in lower):
        width -= 1
    return width


def _cut(rows: list[Row], width: int) -> list[Row]:
    """Rows of one width; cells to the right of the table belong to notes and charts."""
    return [(n, [*cells, *[""] * (width - len(cells))][:width]) for n, cells in rows]


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

"""Segments of a LabVIEW file: each has a header with a start and steps of its own.

References
----------
National Instruments (2019). Specification for the LabVIEW Measurement File (.lvm).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from winchkit.errors import Fault, RunError
from winchkit.runs.importing.formats.cells import number
from winchkit.runs.importing.formats.stamps import read_stamps
from winchkit.runs.importing.table import ColumnTable, FileColumn

_TITLE = "LabVIEW Measurement"
_FIRST = "Channels"
"""Title of the first row of a segment's header."""
_SEGMENT = re.compile(rf"{_FIRST}[\t,;]")
_TIMES = ("Date", "Time", "X0")
"""Rows of a segment's header that say when it starts, for each channel."""


def starts_of_segments(lines: Sequence[str]) -> list[int]:
    """Lines at which the headers of segments start; empty in another file and for one segment."""
    if not lines or not lines[0].startswith(_TITLE):
        return []
    found = [n for n, line in enumerate(lines) if _SEGMENT.match(line)]
    return found if len(found) > 1 else []


def start_of(header: Sequence[str], decimal: str) -> tuple[float, float]:
    """When a segment starts, s since 1970, and its first time from there, s; NaN where unknown."""
    delimiter = header[0][len(_FIRST)]
    cells = {row[0]: row[1] for line in header if len(row := line.split(delimiter)) > 1}
    date, time, first = (cells.get(key, "").strip() for key in _TIMES)
    stamp = read_stamps([f"{date} {time}"]).values[0]
    return float(stamp), number(first, decimal) or 0.0


def joined(
    tables: Sequence[ColumnTable], starts: Sequence[tuple[float, float]], lines: Sequence[int]
) -> ColumnTable:
    """One table of all segments, by the times at which they start.

    ``lines``: line of each segment's header. Raises RunError for segments of other channels, or
    without a start.
    """
    base = tables[0]
    names = [(column.source, column.unit) for column in base.columns]
    columns: list[list[FileColumn]] = [[] for _ in names]
    for table, (start, first), line in zip(tables, starts, lines, strict=True):
        if [(column.source, column.unit) for column in table.columns] != names:
            what = "this segment has other channels or units than the first: split the file there"
            raise RunError(Fault(what, base.path, line))
        if not np.isfinite(start):
            what = "this segment of several has no Date and Time: split the file there"
            raise RunError(Fault(what, base.path, line))
        for found, column in zip(columns, table.columns, strict=True):
            if column.name == "time" and column.unit == "s":
                own = column.values
                if not np.isfinite(own).any() and table.interval is not None:
                    own = np.asarray(first + table.interval * np.arange(len(own)), dtype=float)
                shifted = own + (start - starts[0][0])
                found.append(replace(column, values=shifted, texts=None, wrong=()))
            else:
                found.append(column)
    counts = [len(table.columns[0]) if table.columns else 0 for table in tables]
    before = np.cumsum([0, *counts], dtype=np.intp)

    def line_of(row: int) -> int | None:
        at = int(np.searchsorted(before, row, side="right")) - 1
        return tables[at].line_of(row - int(before[at])) if 0 <= at < len(tables) else None

    count = f"{len(tables)} segments are joined by the times at which they start"
    return replace(
        base,
        columns=tuple(_concatenated(found, before) for found in columns),
        line_of=line_of,
        faults=tuple(fault for table in tables for fault in table.faults),
        notes=(count, *dict.fromkeys(note for table in tables for note in table.notes)),
        interval=None,
    )


def _concatenated(pieces: Sequence[FileColumn], before: NDArray[np.intp]) -> FileColumn:
    texts: list[str] | None = None
    if any(piece.texts is not None for piece in pieces):
        texts = [text for p in pieces for text in (p.texts or [""] * len(p))]
    return replace(
        pieces[0],
        values=np.concatenate([piece.values for piece in pieces]),
        texts=texts,
        wrong=tuple(
            (int(start) + row, text)
            for piece, start in zip(pieces, before, strict=False)
            for row, text in piece.wrong
        ),
    )

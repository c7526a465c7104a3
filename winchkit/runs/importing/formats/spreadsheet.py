"""Reader of XLSX workbooks (extra ``xlsx``): every sheet with rows of numbers is a group."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterable
from dataclasses import replace
from datetime import date, datetime, time, timedelta

from winchkit.errors import Fault, RunError
from winchkit.extras import library
from winchkit.runs.importing.formats.dialect import Dialect, has_cell_units
from winchkit.runs.importing.formats.header import Row
from winchkit.runs.importing.formats.text import table_of_rows
from winchkit.runs.importing.table import ColumnTable, named_apart, readable, refuse_size


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

"""Reader of text files: title lines, header, rows of numbers, with every fault collected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from winchkit.errors import Fault, RunError
from winchkit.runs.importing.formats.cells import is_missing, number, numbers
from winchkit.runs.importing.formats.dialect import (
    BLANKS,
    Dialect,
    decode,
    find_dialect,
    split_line,
)
from winchkit.runs.importing.formats.header import Header, Row, read_header
from winchkit.runs.importing.formats.stamps import is_stamp
from winchkit.runs.importing.table import Column, Table, named_apart

__all__ = ["read_text_table", "table_of_rows"]

_AHEAD = 3
_TEXT_SHARE = 0.2
"""Share of texts above which a column is one of text, and not one of numbers with faults."""


def read_text_table(path: str, data: bytes) -> Table:
    """Read a text file.

    Parameters
    ----------
    path : str
        File, for messages.
    data : bytes
        Its content.

    Returns
    -------
    Table
        With the faults of rows; those of cells are in the columns.

    Raises
    ------
    RunError
        For a binary file, and for one without rows of numbers.
    """
    lines, encoding = decode(data, path)
    dialect = find_dialect(lines)
    if dialect is None:
        shown = next((line for line in lines if line.strip()), "")[:60]
        message = f"has no rows of numbers; its first line is {shown!r}"
        raise RunError(Fault(message, path))
    rows = [(n, split_line(line, dialect.delimiter)) for n, line in enumerate(lines, start=1)]
    is_ended = data[-1:] in b"\r\n" or data[-2:] in (b"\n\0", b"\0\n")
    table = table_of_rows(path, rows, dialect, is_ended=is_ended)
    layout = f"text in {encoding}, {dialect.text}" if encoding else f"text, {dialect.text}"
    return Table(
        table.path,
        layout,
        table.columns,
        table.line_of,
        table.metadata,
        faults=table.faults,
        notes=table.notes,
        interval=table.interval,
    )


@dataclass
class _Rows:
    """Rows of numbers, and what was left out or is wrong."""

    cells: list[list[str]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def table_of_rows(path: str, rows: Sequence[Row], dialect: Dialect, *, is_ended: bool) -> Table:
    """Table of split lines.

    Parameters
    ----------
    path : str
        File, for messages.
    rows : sequence of (int, list of str)
        Line numbers and cells.
    dialect : Dialect
        Decimal sign and width.
    is_ended : bool
        Whether the last line has a line end.

    Returns
    -------
    Table
        Columns without a name and without values are left out.
    """
    first = _first_of_numbers(rows, dialect)
    if first is None:
        raise RunError(Fault("has no rows of numbers", path))
    header = read_header(
        rows[:first], dialect.width, dialect.decimal, is_blank=dialect.delimiter == BLANKS
    )
    found = _kept(path, rows[first:], header, dialect, is_ended=is_ended)
    columns = _columns(header, found, dialect)
    lines = np.array(found.lines, dtype=np.intp)
    return Table(
        path,
        dialect.text,
        columns,
        lambda row: int(lines[row]) if -len(lines) <= row < len(lines) else None,
        header.metadata,
        faults=tuple(found.faults),
        notes=tuple(found.notes),
        interval=header.interval,
    )


def _is_numeric(cells: Sequence[str], dialect: Dialect) -> bool:
    """Whether a row has the width of the rows of numbers, and mostly values."""
    if len(cells) != dialect.width:
        return False
    given = [cell for cell in cells if cell]
    values = [c for c in given if number(c, dialect.decimal) is not None or is_stamp(c)]
    certain = [c for c in values if not is_missing(c)]
    return bool(certain) and 2 * len(values) > len(given)


def _first_of_numbers(rows: Sequence[Row], dialect: Dialect) -> int | None:
    """Index of the first row of numbers that further ones follow."""
    for index, (_, cells) in enumerate(rows):
        if not _is_numeric(cells, dialect):
            continue
        after = [c for _, c in rows[index + 1 : index + 1 + 3 * _AHEAD] if any(c)][:_AHEAD]
        if sum(_is_numeric(c, dialect) for c in after) * 2 >= len(after):
            return index
    return None


def _kept(
    path: str, rows: Sequence[Row], header: Header, dialect: Dialect, *, is_ended: bool
) -> _Rows:
    """Rows of numbers without blank lines, comments and repeated headers."""
    found, repeated, comments = _Rows(), 0, 0
    last = next((n for n, cells in reversed(rows) if any(cells)), 0)
    width = dialect.width
    for line, given in rows:
        if not any(given):
            continue
        cells = given[:-1] if len(given) == width + 1 and not given[-1] else given
        if len(cells) == width and not _is_title(cells, header):
            found.cells.append(cells)
            found.lines.append(line)
        elif _is_title(cells, header):
            repeated += 1
        elif cells[0].startswith(("#", "%")) or cells[0].upper() in {"EOF", "END"}:
            comments += 1
        elif line == last and len(cells) < width and not is_ended:
            found.notes.append(
                f"the last line has {len(cells)} cells of {width} and no line end; it is left out: "
                "is the file cut off?"
            )
        else:
            message = f"{len(cells)} cells in this row, {width} in the others"
            cut = "; is the file cut off?" if line == last and len(cells) < width else ""
            found.faults.append(Fault(message + cut, path, line))
    if repeated:
        found.notes.append(f"{repeated} repeated lines of the header are left out")
    if comments:
        found.notes.append(f"{comments} comments between the rows are left out")
    return found


def _is_title(cells: Sequence[str], header: Header) -> bool:
    """Whether a row repeats one of the header."""
    return any(tuple(cells) == row for row in header.rows)


def _columns(header: Header, found: _Rows, dialect: Dialect) -> tuple[Column, ...]:
    columns = []
    for index, cells in enumerate(zip(*found.cells, strict=True)):
        empty = Column("", np.empty(0))
        has_any = header.names[index] or any(cells)
        columns.append(_column(header, index, cells, dialect) if has_any else empty)
    return tuple(item for item in named_apart(columns) if item.name)


def _column(header: Header, index: int, cells: Sequence[str], dialect: Dialect) -> Column:
    values, wrong = numbers(cells, dialect.decimal)
    name, unit, labels = header.names[index], header.units[index], header.labels[index]
    name = name or str(index + 1)
    given = sum(1 for cell in cells if cell)
    stamps = wrong and sum(is_stamp(cells[row]) for row in wrong) > 0.5 * len(wrong)
    if stamps or len(wrong) > _TEXT_SHARE * given:
        return Column(name, values, unit, labels, texts=cells)
    return Column(name, values, unit, labels, wrong=tuple((row, cells[row]) for row in wrong))

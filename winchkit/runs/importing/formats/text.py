"""Reader of text files: title lines, header, rows of numbers, with every fault collected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from typing import overload

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError
from winchkit.runs.importing.formats.cells import has_unit, is_missing, number, numbers
from winchkit.runs.importing.formats.dialect import (
    BLANKS,
    FEWEST,
    Dialect,
    decode,
    doubt_of_commas,
    find_dialect,
    split_line,
    whole_lines,
)
from winchkit.runs.importing.formats.header import (
    END_OF_HEADER,
    Header,
    Row,
    keyed_width,
    read_header,
)
from winchkit.runs.importing.formats.segments import joined, start_of, starts_of_segments
from winchkit.runs.importing.formats.stamps import is_stamp
from winchkit.runs.importing.table import ColumnTable, FileColumn, named_apart

_AHEAD = 3
"""Rows of numbers after a header that confirm it."""
_BLOCK = 4096
"""Rows converted at a time: their texts are released before the next ones are split."""
_COUNTED = 4
"""Columns from which a row that counts them is no chance."""
_HEAD = 60
"""Lines in which a header ends."""
_COMPARED = 20
"""Rows whose last numbers are compared with that of a row without a line end."""
_SUMMARY = 12
"""Most rows of a summary: mean, extremes, deviation and their units."""
_LEFT_OUT = "The row is left out"
_FEWEST_SAMPLES = 64
"""Numbers in a line from which it may be a signal; a table has seldom as many columns, and a
recording never fewer samples than signals."""
_TEXT_SHARE = 0.2
"""Share of texts above which a column is one of text, and not one of numbers with faults."""


def read_text_table(path: str, data: bytes) -> ColumnTable:
    """Read a text file; raises RunError for a binary file, and for one without rows of numbers."""
    lines, encoding = decode(data, path)
    lines, numbers = whole_lines(lines)
    is_ended = data[-1:] in b"\r\n" or data[-2:] in (b"\n\0", b"\0\n")
    if not (cuts := starts_of_segments(lines)):
        return _table_of_lines(path, lines, numbers, encoding, is_ended=is_ended)
    numbers = numbers or list(range(1, len(lines) + 1))
    tables, starts = [], []
    for start, end in pairwise([*cuts, len(lines)]):
        own = [*lines[: cuts[0]], *lines[start:end]]
        lines_of = [*numbers[: cuts[0]], *numbers[start:end]]
        last = is_ended or end < len(lines)
        tables.append(_table_of_lines(path, own, lines_of, encoding, is_ended=last))
        header = lines[start : start + _end_of_header(lines[start:end])]
        decimal = "," if "decimal comma" in tables[-1].layout else "."
        starts.append(start_of(header, decimal))
    return joined(tables, starts, [numbers[cut] for cut in cuts])


def _table_of_lines(
    path: str, lines: list[str], numbers: list[int] | None, encoding: str, *, is_ended: bool
) -> ColumnTable:
    dialect = find_dialect(lines[_end_of_header(lines) :])
    if dialect is None:
        shown = next((line for line in lines if line.strip()), "")[:60]
        message = f"has no rows of numbers; its first line is {shown!r}"
        raise RunError(Fault(message, path))
    if doubt := doubt_of_commas(lines, dialect):
        raise RunError(Fault(doubt, path))
    if signals := _line_per_signal(lines, dialect):
        turned = [dialect.delimiter.join(cells) for cells in zip(*signals, strict=True)]
        table = _table_of_lines(path, turned, None, encoding, is_ended=is_ended)
        return replace(table, layout=f"{table.layout}, a line per signal")
    end = _end_of_header(lines)
    names = next((n for n in range(end, len(lines)) if lines[n].strip()), end)
    # LabVIEW has a column of comments, of which rows without one have no cell.
    width = len(split_line(lines[names], dialect.delimiter)) if end and names < len(lines) else 0
    dialect = replace(dialect, width=max(width, dialect.width))
    rows = _SplitLines(lines, dialect.delimiter, numbers, (names, width))
    layout = f"text in {encoding}, {dialect.text}" if encoding else f"text, {dialect.text}"
    return replace(table_of_rows(path, rows, dialect, is_ended=is_ended), layout=layout)


def _line_per_signal(lines: Sequence[str], dialect: Dialect) -> list[list[str]]:
    """Cells of lines of which each has the samples of a signal, its name before them or none."""
    given = [line for line in lines if line.strip() and not line.startswith("#")]
    if not _FEWEST_SAMPLES <= dialect.width > 2 * len(given):
        return []
    split = [split_line(line, dialect.delimiter) for line in given]
    is_whole = all(
        len(cells) == dialect.width
        and all(number(cell, dialect.decimal) is not None for cell in cells[1:])
        for cells in split
    )
    return split if is_whole else []


def _end_of_header(lines: Sequence[str]) -> int:
    """Line after the mark by which LabVIEW ends its headers, which have numbers as well; else 0."""
    marks = [n for n, line in enumerate(lines[:_HEAD]) if line.startswith(END_OF_HEADER)]
    return marks[-1] + 1 if marks else 0


class _SplitLines(Sequence[Row]):
    """Lines with their number, split when they are read: the cells of a long file are not kept."""

    def __init__(
        self,
        lines: Sequence[str],
        delimiter: str,
        numbers: Sequence[int] | None = None,
        least: tuple[int, int] = (0, 0),
    ) -> None:
        self._lines, self._delimiter, self._numbers = lines, delimiter, numbers
        self._start, self._width = least

    def __len__(self) -> int:
        return len(self._lines)

    @overload
    def __getitem__(self, index: int) -> Row: ...

    @overload
    def __getitem__(self, index: slice) -> list[Row]: ...

    def __getitem__(self, index: int | slice) -> Row | list[Row]:
        if isinstance(index, slice):
            return [self[n] for n in range(*index.indices(len(self)))]
        number = index if index >= 0 else len(self) + index
        line = number + 1 if self._numbers is None else self._numbers[number]
        cells = split_line(self._lines[number], self._delimiter)
        if number > self._start and any(cells):
            cells += [""] * (self._width - len(cells))
        return line, cells


@dataclass
class _Cells:
    """Values of one column, block by block; the text is kept where it has no numbers."""

    decimal: str
    pieces: list[Array] = field(default_factory=list)
    wrong: list[tuple[int, str]] = field(default_factory=list)
    texts: list[str] | None = None
    given: int = 0
    count: int = 0

    def add(self, cells: Sequence[str]) -> None:
        """Take the next cells."""
        values, wrong = numbers(cells, self.decimal)
        given = len(cells) - cells.count("")
        # Text from the first block with any cell on: of stamps, or of words.
        if not self.given and len(wrong) > _TEXT_SHARE * given:
            self.texts = [""] * self.count
        if self.texts is not None:
            self.texts += cells
        else:
            self.wrong += [(self.count + row, cells[row]) for row in wrong]
        self.pieces.append(values)
        self.given += given
        self.count += len(cells)

    def column(self, header: Header, index: int) -> FileColumn:
        """The column of the header's names; without a name where nothing is in it."""
        name, unit = header.names[index], header.units[index]
        if not name and not self.given:
            return FileColumn("", np.empty(0))
        values = np.concatenate([np.empty(0), *self.pieces])
        name, labels = name or str(index + 1), header.labels[index]
        if self.texts is None and len(self.wrong) > _TEXT_SHARE * self.given:
            texts = [""] * self.count
            for row, text in self.wrong:
                texts[row] = text
            return FileColumn(name, values, unit, labels, texts=texts)
        wrong = tuple(self.wrong)
        return FileColumn(name, values, unit, labels, texts=self.texts, wrong=wrong)


@dataclass
class _Rows:
    """Columns of the rows of numbers, and what was left out or is wrong."""

    columns: list[_Cells]
    lines: list[int] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    block: list[list[str]] = field(default_factory=list)

    def add(self, line: int, cells: list[str]) -> None:
        """Take a row."""
        self.lines.append(line)
        self.block.append(cells)
        if len(self.block) == _BLOCK:
            self.finish()

    def finish(self) -> None:
        """Convert the rows of the present block."""
        for column, cells in zip(self.columns, zip(*self.block, strict=True), strict=False):
            column.add(cells)
        self.block.clear()


def table_of_rows(
    path: str, rows: Sequence[Row], dialect: Dialect, *, is_ended: bool
) -> ColumnTable:
    """Table of split lines."""
    head = [rows[n] for n in range(min(len(rows), _HEAD))]
    is_padded = bool(keyed := keyed_width(head))
    if is_padded:
        dialect = replace(dialect, width=keyed)
    first = _first_of_numbers(rows, dialect, is_keyed=is_padded)
    if first is None:
        raise RunError(Fault("has no rows of numbers", path))
    _check_records(path, rows, first, dialect)
    is_counted = _counts_columns(rows[first][1])
    header = read_header(
        rows[:first], dialect.width, dialect.decimal, is_blank=dialect.delimiter == BLANKS
    )
    first += is_counted
    found = _kept(path, rows, first, header, dialect, is_ended=is_ended, is_padded=is_padded)
    if is_counted:
        found.notes.append("the first row of numbers counts the columns and is left out")
    columns = named_apart([c.column(header, n) for n, c in enumerate(found.columns)])
    lines = np.array(found.lines, dtype=np.intp)
    return ColumnTable(
        path,
        dialect.text,
        tuple(item for item in columns if item.name),
        lambda row: int(lines[row]) if -len(lines) <= row < len(lines) else None,
        header.metadata,
        faults=tuple(found.faults),
        notes=tuple(found.notes),
        interval=header.interval,
    )


def _counts_columns(cells: Sequence[str]) -> bool:
    """Whether a row is ``0,1,2,3`` or ``1,2,3,4``: the header of a table without names."""
    numbers = list(cells if cells[0] else cells[1:])
    return len(numbers) >= _COUNTED and any(
        numbers == [str(n + start) for n in range(len(numbers))] for start in (0, 1)
    )


def _is_numeric(cells: Sequence[str], dialect: Dialect) -> bool:
    """Whether a row has the width of the rows of numbers, or a remark behind, and mostly values."""
    behind = len(cells) - dialect.width
    if behind and not (dialect.delimiter == BLANKS and 0 < behind <= _remark(cells, dialect)):
        return False
    cells = cells[: dialect.width]
    given = [cell for cell in cells if cell]
    values = [c for c in given if number(c, dialect.decimal) is not None or is_stamp(c)]
    if dialect.has_units:
        values += [c for c in given if c not in values and has_unit(c, dialect.decimal)]
    certain = [c for c in values if not is_missing(c)]
    if dialect.is_mixed:
        return len(certain) >= FEWEST
    return bool(certain) and 2 * len(values) > len(given)


def _first_of_numbers(rows: Sequence[Row], dialect: Dialect, *, is_keyed: bool) -> int | None:
    """Index of the first row of numbers that further ones follow."""
    head = [rows[n][1] for n in range(min(len(rows), _HEAD))]
    marks = [
        n
        for n, cells in enumerate(head)
        if cells[:1] == [END_OF_HEADER] or (is_keyed and _has_title(cells, dialect))
    ]
    for index in range(marks[-1] + 1 if marks else 0, len(rows)):
        cells = rows[index][1]
        if not _is_numeric(cells, dialect):
            continue
        after = [c for _, c in rows[index + 1 : index + 1 + 3 * _AHEAD] if any(c)][:_AHEAD]
        if _has_title(cells, dialect) and after and not any(c[0] for c in after):
            continue
        if sum(_is_numeric(c, dialect) for c in after) * 2 >= len(after):
            return index
    return None


def _has_title(cells: Sequence[str], dialect: Dialect) -> bool:
    """Whether a row has a title before its cells, and no number or stamp."""
    is_row = len(cells) > 1 and bool(cells[0])
    return is_row and number(cells[0], dialect.decimal) is None and not is_stamp(cells[0])


def _check_records(path: str, rows: Sequence[Row], first: int, dialect: Dialect) -> None:
    """Raise where most rows of numbers would be a part of the header: records of several kinds."""
    above = sum(_is_numeric(rows[n][1], dialect) for n in range(first))
    below = len(rows) - first
    if above > below:
        message = (
            f"{above} rows of {dialect.width} cells stand between lines of another kind, only the "
            f"last {below} follow each other: the file has records of several kinds; put those of "
            "one kind into a file of their own"
        )
        raise RunError(Fault(message, path, rows[first][0]))


def _remark(cells: Sequence[str], dialect: Dialect) -> int:
    """Number of words behind the last number of a row, such as the alarm of a process variable."""
    places = [
        n
        for n, cell in enumerate(cells)
        if number(cell, dialect.decimal) is not None or is_stamp(cell)
    ]
    return len(cells) - 1 - places[-1] if places else 0


def _start_of_summary(rows: Sequence[Row], first: int, dialect: Dialect) -> int:
    """Index behind the last row of numbers, before a few rows with a title: ``Mean;1,2;3,4``."""
    end = len(rows)
    if not rows[first][1][0] or _has_title(rows[first][1], dialect):
        return end
    for index in range(end - 1, max(first, end - _SUMMARY - 1), -1):
        cells = rows[index][1]
        if any(cells) and not _has_title(cells, dialect):
            return index + 1
    return end


def _not_data(
    cells: Sequence[str], dialect: Dialect, *, is_title: bool, is_last: bool, is_summary: bool
) -> str:
    """What a line between the rows of numbers is; empty for a row with a fault."""
    if is_title:
        return "repeated lines of the header"
    if is_summary and any(cells[1:]):
        return "rows of a summary at the end, with a title in place of the first number,"
    if cells[0].startswith(("#", "%")) or cells[0].upper() in {"EOF", "END"}:
        return "comments between the rows"
    # The last line may be cut off.
    is_words = not is_last and all(number(cell, dialect.decimal) is None for cell in cells)
    return "lines of words between the rows" if is_words else ""


def _cut_off(cells: Sequence[str], rows: Sequence[Row], dialect: Dialect) -> str:
    """Note on a last row without a line end whose last number may lack digits; empty for none.

    It lacks some for certain where the rows before it have more decimals, all as many.
    """
    before = [row[-1] for _, row in rows[-_COMPARED - 1 : -1] if len(row) == len(cells)]
    many = [len(text.partition(dialect.decimal)[2]) for text in (*before, cells[-1])]
    if not before or (many[0] and len(set(many)) == 1):
        return ""
    is_short = many[0] > many[-1] and len(set(many[:-1])) == 1
    return f"the last row has no line end, and its last number {cells[-1]!r} " + (
        f"has fewer decimals than the rows before: is the file cut off? {_LEFT_OUT}"
        if is_short
        else f"may lack digits if the file is cut off there (column {len(cells)})"
    )


def _kept(
    path: str,
    rows: Sequence[Row],
    first: int,
    header: Header,
    dialect: Dialect,
    *,
    is_ended: bool,
    is_padded: bool,
) -> _Rows:
    """Rows of numbers without blank lines, comments, messages and repeated headers."""
    width = dialect.width
    found = _Rows([_Cells(dialect.decimal) for _ in range(width)])
    left_out, remarks = Counter[str](), 0
    is_blank, least = dialect.delimiter == BLANKS, width - _remark(rows[first][1][:width], dialect)
    last = next((n for n, cells in reversed(rows) if any(cells)), 0)
    titles = {row[0] for row in header.rows}
    end = _start_of_summary(rows, first, dialect)
    for index, (line, given) in enumerate(islice(rows, first, None), start=first):
        if not any(given):
            continue
        cells = given[:-1] if len(given) == width + 1 and not given[-1] else given
        if is_padded and len(cells) < width and cells[0].upper() != "EOF":
            cells = [*cells, *[""] * (width - len(cells))]
        if is_blank and len(cells) != width and len(cells) - _remark(cells, dialect) == least:
            cells, remarks = [*cells, *[""] * width][:width], remarks + 1
        is_title = cells[0] in titles and tuple(cells) in header.rows
        is_summary = index >= end and number(cells[0], dialect.decimal) is None
        if len(cells) == width and not is_title and not is_summary:
            if line == last and not is_ended and (doubt := _cut_off(cells, rows, dialect)):
                found.notes.append(doubt)
                if doubt.endswith(_LEFT_OUT):
                    continue
            found.add(line, cells)
        elif kind := _not_data(
            cells, dialect, is_title=is_title, is_last=line == last, is_summary=is_summary
        ):
            left_out[kind] += 1
        elif line == last and len(cells) < width and not is_ended:
            found.notes.append(
                f"the last line has {len(cells)} cells of {width} and no line end; it is left out: "
                "is the file cut off?"
            )
        else:
            message = f"{len(cells)} cells in this row, {width} in the others"
            cut = "; is the file cut off?" if line == last and len(cells) < width else ""
            found.faults.append(Fault(message + cut, path, line))
    found.finish()
    found.notes += [f"{count} {kind} are left out" for kind, count in left_out.items()]
    if remarks:
        found.notes.append(f"{remarks} rows have more or fewer words behind their numbers")
    return found

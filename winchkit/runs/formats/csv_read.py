"""Reader of runs in CSV: metadata lines ``# key: value``, one header line, numbers."""

from __future__ import annotations

import codecs
import csv
import json
import math
import re
import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from io import StringIO
from itertools import chain, islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError
from winchkit.regular_file import read_whole, regular
from winchkit.runs.assemble import RawColumns, assemble, refuse
from winchkit.runs.columns import column_dimension, header_of
from winchkit.runs.log import Note, known_event
from winchkit.runs.recording.log_file import is_written
from winchkit.runs.run import Run
from winchkit.runs.run_writer import CSV_MARK, EVENT_MARK

_PIECE = 1 << 20
"""Bytes read at a time, so that a large file needs no memory of its size."""


def read_bytes(path: Path, *, may_be_empty: bool = False) -> bytes:
    """Content of a file; raises RunError where it cannot be read."""
    data = read_whole(path, "run", error=RunError)
    if not data and not may_be_empty:
        raise RunError(Fault("the file is empty", str(path)))
    return data


def cut_off(path: str, whole: str) -> str:
    """Note on a log without its end, of which the complete part was read."""
    if is_written(Path(path)):
        return f"the log is still being written; its {whole} so far are read"
    return (
        f"the file is cut off; its {whole} are read, the remainder is left out "
        f"(`winchkit log recover {path}` writes a complete file)"
    )


def read_lines(path: Path) -> Iterator[str]:
    """Lines of a text file in UTF-8, UTF-16 with byte order mark, or Windows-1252.

    Each has its line feed, except a last line without one. The file is read twice and never kept in
    memory: an hour of eight winches is gigabytes.
    """
    encoding = _encoding(path)
    with open(path, encoding=encoding, opener=regular) as file:
        yield from file


def _encoding(path: Path) -> str:
    """The first encoding in which a file is valid; raises RunError for a binary file."""
    marked = _beginning(path).startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        try:
            is_text = _holds_no_zero(path, encoding)
        except UnicodeDecodeError:
            continue
        if not is_text:
            raise RunError(Fault("is a binary file, not CSV text", str(path)))
        return encoding
    raise RunError(Fault("is not a text file; save it as CSV in UTF-8", str(path)))


def _holds_no_zero(path: Path, encoding: str) -> bool:
    with open(path, encoding=encoding, opener=regular) as file:
        return not any("\0" in piece for piece in iter(lambda: file.read(_PIECE), ""))


def _beginning(path: Path) -> bytes:
    """First bytes of a file; raises RunError where it cannot be read."""
    try:
        with open(path, "rb", opener=regular) as file:
            data = file.read(4)
    except (OSError, ValueError):
        return read_bytes(path)
    return data or read_bytes(path)


Rows = list[list[str]]
_BLOCK = 4096
"""Rows whose text is in memory at a time."""
_CSV_BEGIN = f"{CSV_MARK}\n"
_PLAIN = re.compile(r"[-+0-9.eE,\nnaif]+")
"""Text of lines of numbers alone, which numpy or Arrow read in a part of the time."""
_LARGE = 16 << 20
"""Bytes of a file from which the time to import Arrow (0.1 s) is worth it."""


def read_csv(path: str | Path, *, is_part: bool = False) -> Run:
    """Read a run in SI; raises RunError with every fault of the file.

    A last line without a line feed is ignored in files of winchkit, whose rows all have one. In a
    file of another program it is a row if it has all columns.
    """
    name, lines = str(path), read_lines(Path(path))
    above: list[str] = []
    first = next((line for line in lines if not _is_comment_kept(line, above)), None)
    metadata, metadata_lines, faults = _metadata(name, above)
    if first is None:
        faults.append(Fault("there is no header line; it names the columns, 'time [s],…'", name))
    is_own = above[:1] == [f"{CSV_MARK}\n"]
    if is_own and first is not None and not first.endswith("\n"):
        faults.append(Fault("was cut off within its header; there is no row to recover", name))
    refuse(faults)
    number = len(above) + 1
    header = _header(name, first or "", number)
    table, width, notes = _Table(name, header), len(header), list[str]()
    whole = _whole(name, lines, width, notes, is_own=is_own)
    numbers_of = _parser(Path(path))
    while block := list(islice(whole, _BLOCK)):
        if is_own:
            _refuse_joined(name, block, number + 1)
        if (columns := _plain(block, width, numbers_of)) is not None:
            table.add_numbers(columns, number + 1)
        else:
            # A quoted cell may go on in the next line, and so in the next block.
            others = chain(block, whole) if '"' in "".join(block) else iter(block)
            for rows, numbers in _blocks(name, others, number, width):
                table.add(rows, numbers)
        number += len(block)
    refuse(table.ragged())
    return assemble(
        RawColumns(
            name,
            header,
            table.columns(),
            table.line_of,
            metadata,
            metadata_lines,
            len(above) + 1,
            notes,
            faults + table.faults,
            is_part,
        )
    )


def _refuse_joined(path: str, block: list[str], number: int) -> None:
    """Raise RunError where another log of winchkit begins among the rows, from line ``number``."""
    for place, line in enumerate(block, number):
        if line.endswith(_CSV_BEGIN):
            message = "another log was joined to it here; `winchkit log recover` saves each"
            raise RunError(Fault(message, path, place))


def read_events(path: str | Path) -> tuple[Note, ...]:
    """Events of a log of winchkit, but those that were cut off or edited; raises RunError."""
    events = []
    for line in read_lines(Path(path)):
        if not line.startswith(EVENT_MARK):
            continue
        time, _, text = line.removeprefix(EVENT_MARK).partition(" s: ")
        with suppress(ValueError, RecursionError):
            value = json.loads(text)
            if isinstance(value, dict):
                events.append(Note(float(time), known_event(value)))
    return tuple(events)


def _whole(
    path: str, lines: Iterator[str], width: int, notes: list[str], *, is_own: bool
) -> Iterator[str]:
    """The complete lines; of a last one without a line feed a note is added."""
    for line in lines:
        if not line.endswith("\n") and line.strip():
            if is_own:
                notes.append(cut_off(path, "rows before its last line"))
                return
            if (cells := _width(line)) < width:
                notes.append(
                    f"the last line has {cells} cells of {width} and no line end; it is left out: "
                    "is the file cut off?"
                )
                return
            notes.append(
                "the last row has no line end; if the file was cut off there, its last number may "
                "lack digits"
            )
        yield line


def _width(line: str) -> int:
    """Number of cells in a line."""
    try:
        return len(next(csv.reader([line])))
    except csv.Error:
        return 0


class _Table:
    """Columns of numbers that grow block by block; the text of a block is not kept."""

    def __init__(self, path: str, header: Sequence[tuple[str, str]]) -> None:
        self.faults: list[Fault] = []
        self._path, self._names = path, [name for name, _ in header]
        self._pieces: list[list[Array] | None] = [[] for _ in header]
        self._numbers: list[NDArray[np.intp]] = []
        self._ragged: list[tuple[int, int]] = []
        """Line and cells of rows of another width than the header."""

    def add(self, rows: Rows, numbers: list[int]) -> None:
        """Take the next rows of text, with the line of each."""
        self._numbers.append(np.array(numbers, dtype=np.intp))
        width = len(self._names)
        self._ragged += [
            (number, len(row))
            for row, number in zip(rows, numbers, strict=True)
            if len(row) != width
        ]
        if self._ragged:
            return
        for index, (name, cells) in enumerate(
            zip(self._names, zip(*rows, strict=True), strict=True)
        ):
            self._extend(index, name, cells, numbers)

    def add_numbers(self, columns: Sequence[Array], line: int) -> None:
        """Take the next rows of numbers by columns, the first row in this line."""
        self._numbers.append(np.arange(line, line + len(columns[0])))
        for pieces, column in zip(self._pieces, columns, strict=True):
            if pieces is not None:
                pieces.append(column)

    def _extend(self, index: int, name: str, cells: Sequence[str], numbers: list[int]) -> None:
        pieces = self._pieces[index]
        if pieces is None:
            return
        values, wrong = _numbers(cells)
        if wrong and column_dimension(name) is None:
            self._pieces[index] = None
            return
        pieces.append(values)
        self.faults += [
            Fault(f"column '{name}' has {cells[row]!r}, not a number", self._path, numbers[row])
            for row in wrong
        ]

    def ragged(self) -> list[Fault]:
        """A fault for every row whose width differs from that of the header."""
        width = len(self._names)
        faults = [
            Fault(f"{cells} cells in this row, {width} columns in the header", self._path, line)
            for line, cells in self._ragged
        ]
        if faults and faults[-1].line == self.line_of(-1) and self._ragged[-1][1] < width:
            last = faults.pop()
            faults.append(Fault(last.message + "; is the file cut off?", self._path, last.line))
        return faults

    def columns(self) -> list[Array | None]:
        """All values so far; None for an unknown column with text."""
        out: list[Array | None] = []
        for index, pieces in enumerate(self._pieces):
            out.append(None if pieces is None else np.concatenate([np.empty(0), *pieces]))
            self._pieces[index] = []  # Each column once: a long run is as large as its numbers.
        return out

    def line_of(self, row: int) -> int:
        """Line of a row."""
        self._numbers = [np.concatenate(self._numbers)]
        return int(self._numbers[0][row])


def _is_comment_kept(line: str, above: list[str]) -> bool:
    """Whether a line is above the header; such lines are kept."""
    if line.strip() and not line.lstrip().startswith("#"):
        return False
    above.append(line)
    return True


def _metadata(
    path: str, lines: Sequence[str]
) -> tuple[dict[str, str], dict[str, int], list[Fault]]:
    """Metadata and the line of each key; a comment without a colon is ignored."""
    values: dict[str, str] = {}
    places: dict[str, int] = {}
    faults: list[Fault] = []
    for number, line in enumerate(lines, start=1):
        key, colon, value = line.strip().lstrip("#").partition(":")
        key = key.strip()
        if not colon or not key:
            continue
        if key in values:
            faults.append(
                Fault(f"given a second time, after line {places[key]}", path, number, key)
            )
        values[key], places[key] = value.strip(), number
    return values, places, faults


def _header(path: str, line: str, number: int) -> list[tuple[str, str]]:
    for mark, called in ((";", "semicolons"), ("\t", "tabs")):
        if line.count(mark) > line.count(","):
            message = (
                f"columns are separated by {called}: 'winchkit import {shlex.quote(path)} -o runs' "
                "reads it; or save it with commas between columns and points in numbers"
            )
            raise RunError(Fault(message, path, number))
    try:
        cells = next(csv.reader([line], strict=True))
    except csv.Error as error:
        raise RunError(Fault(f"the header cannot be read: {error}", path, number)) from None
    if not any(_numbers([cell])[1] for cell in cells):
        message = (
            "the first line has numbers; expected a header such as 'time [s],motor_angle [rad]'"
        )
        raise RunError(Fault(message, path, number))
    header = [(cell, header_of(cell)) for cell in cells]
    refuse(
        [
            Fault(f"column {n} is called '{cell}'; write it as 'name [unit]'", path, number)
            for n, (cell, read) in enumerate(header, start=1)
            if read is None
        ]
    )
    return [read for _, read in header if read is not None]


def _is_row(cells: Sequence[str], width: int) -> bool:
    """Whether a line has a row: it is neither blank nor a comment between the rows."""
    if not cells or (len(cells) == 1 and not cells[0].strip()):
        return False
    if cells[0].startswith(EVENT_MARK):
        return False
    # A full row may start with a text such as "#7".
    return not (cells[0].lstrip().startswith("#") and len(cells) != width)


Parser = Callable[[str, int], Sequence[Array] | None]
"""Columns of lines with a number of cells; None where a cell is not a number, or one is missing."""


def _plain(lines: Sequence[str], width: int, numbers_of: Parser) -> Sequence[Array] | None:
    """Columns (k,) of lines that hold numbers alone, each as many; else None."""
    text = "".join(lines)
    if _PLAIN.fullmatch(text) is None or "\n\n" in text or text.startswith("\n"):
        return None
    columns = numbers_of(text, width)
    return columns if columns is not None and len(columns[0]) == len(lines) else None


def _parser(path: Path) -> Parser:
    """The fastest parser for a file that is here: Arrow's for a large one, else numpy's."""
    if path.stat().st_size >= _LARGE:
        with suppress(ImportError):
            return _arrow_parser()
    return _numpy_columns


def _numpy_columns(text: str, width: int) -> Sequence[Array] | None:
    try:
        values = np.loadtxt(StringIO(text), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    return list(np.ascontiguousarray(values.T)) if values.shape[1] == width else None


def _arrow_parser() -> Parser:
    """Parser of Apache Arrow; raises ImportError where it is not installed."""
    import pyarrow as pa
    from pyarrow import csv as arrow

    def columns(text: str, width: int) -> Sequence[Array] | None:
        names = [str(number) for number in range(width)]
        try:
            table = arrow.read_csv(
                pa.py_buffer(text.encode("ascii")),
                arrow.ReadOptions(use_threads=False, column_names=names),
                arrow.ParseOptions(quote_char=False),
                arrow.ConvertOptions(
                    column_types=dict.fromkeys(names, pa.float64()), null_values=["", "nan", "-nan"]
                ),
            )
        except pa.ArrowInvalid:
            return None
        return [column.to_numpy() for column in table.itercolumns()]

    return columns


def _blocks(
    path: str, lines: Iterator[str], start: int, width: int
) -> Iterator[tuple[Rows, list[int]]]:
    """Cells and lines of all rows, in blocks; ``width`` is that of the header."""
    rows: Rows = []
    numbers: list[int] = []
    reader = csv.reader(lines)
    try:
        for row in reader:
            # A row of full width, the usual case, is one unless it is an event.
            if (len(row) == width > 1 and not row[0].startswith(EVENT_MARK)) or _is_row(row, width):
                rows.append(row)
                numbers.append(start + reader.line_num)
            if len(rows) == _BLOCK:
                yield rows, numbers
                rows, numbers = [], []
    except csv.Error as error:
        raise RunError(Fault(f"cannot be read: {error}", path, start + reader.line_num)) from None
    if rows:
        yield rows, numbers


def _numbers(cells: Sequence[str]) -> tuple[Array, list[int]]:
    """Values of a column, NaN for an empty cell, and the rows without a number."""
    try:
        values = np.array(list(map(float, cells)), dtype=np.float64)
    except ValueError:
        pass
    else:
        if "_" not in "".join(cells):
            return values, []
    read = [_number(cell) for cell in cells]
    wrong = [row for row, value in enumerate(read) if value is None]
    filled = [math.nan if value is None else value for value in read]
    return np.array(filled, dtype=np.float64), wrong


def _number(cell: str) -> float | None:
    """A cell's value; ``1_000``, which Python accepts, is not a number."""
    text = cell.strip()
    if not text:
        return math.nan
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None

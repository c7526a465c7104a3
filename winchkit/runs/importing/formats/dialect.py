"""Encoding, delimiter and decimal sign of a text file, from its content."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from winchkit.errors import Fault, RunError
from winchkit.runs.importing.formats.cells import has_unit, number
from winchkit.runs.importing.formats.stamps import is_stamp

BLANKS = " "
_DELIMITERS = ("\t", ";", "|", ",", BLANKS)
_CALLED = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", BLANKS: "blanks"}
_SAMPLED = 240
"""Lines by which the separator is found, a third each of the start, middle and end."""
FEWEST = 2
"""Numbers and stamps of a mixed row."""
_WHOLE = 0.9
"""Share of lines that a separator reads without a rest; the others are a header and remarks."""
_CELL_LINES = 8
"""Line ends that a quoted cell may have."""
_OPENED = re.compile(r'(?:^|[,;\t|])\s*"[^"]*$')
_CLOSED = re.compile(r'[^"]*"\s*(?:$|[,;\t|])')
_COMMAS, _GROUPED = re.compile(r"[+-]?\d*,\d*"), re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
"""Numbers with one comma, and those whose comma may separate thousands."""
_TEXT_LINES = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True)
class Dialect:
    """How a line becomes cells, and a cell a number."""

    delimiter: str
    decimal: str
    width: int
    """Most frequent number of cells in a row of numbers."""
    has_units: bool = False
    """Whether cells are numbers with their units."""
    is_mixed: bool = False
    """Whether rows of numbers have as many texts as numbers, or more."""

    @property
    def text(self) -> str:
        """Description."""
        sign = ", decimal comma" if self.decimal == "," else ""
        return f"{_CALLED[self.delimiter]}{sign}"


def decode(data: bytes, path: str) -> tuple[list[str], str]:
    """Lines of a text file and its encoding (empty for UTF-8); RunError for a binary file."""
    for encoding, called in _encodings(data):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            lines = _TEXT_LINES.split(text)
            return (lines[:-1] if lines and not lines[-1] else lines), called
    message = "is a binary file of an unknown format; export it as text, XLSX, MAT, HDF5 or Parquet"
    raise RunError(Fault(message, path))


def _encodings(data: bytes) -> list[tuple[str, str]]:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return [("utf-16", "UTF-16")]
    sample = data[:4000]
    # ASCII in UTF-16 without its mark has a zero in every other byte.
    if len(sample) > 8 and sample[1::2].count(0) > 0.8 * len(sample[1::2]):
        return [("utf-16-le", "UTF-16")]
    if len(sample) > 8 and sample[::2].count(0) > 0.8 * len(sample[::2]):
        return [("utf-16-be", "UTF-16")]
    return [("utf-8-sig", ""), ("cp1252", "Windows-1252"), ("latin-1", "Latin-1")]


def whole_lines(lines: list[str]) -> tuple[list[str], list[int] | None]:
    """Lines joined where a quoted cell has a line end, and their numbers; None without such."""
    odd = [n for n, line in enumerate(lines) if line.count('"') % 2]
    # A quotation mark within a cell is one of inches.
    pairs = [
        (start, end)
        for start, end in zip(odd[::2], odd[1::2], strict=False)
        if end - start <= _CELL_LINES and _OPENED.search(lines[start]) and _CLOSED.match(lines[end])
    ]
    if 2 * len(pairs) < len(odd):
        return lines, None
    ends, joined, numbers, start = dict(pairs), list[str](), list[int](), 0
    while start < len(lines):
        end = ends.get(start, start)
        joined.append(" ".join(lines[start : end + 1]))
        numbers.append(start + 1)
        start = end + 1
    return (joined, numbers) if pairs else (lines, None)


def split_line(line: str, delimiter: str) -> list[str]:
    """Cells of a line; quoted ones may have delimiters, a blank stands for any number of blanks."""
    if '"' not in line:
        return line.split() if delimiter == BLANKS else [c.strip() for c in line.split(delimiter)]
    if delimiter == BLANKS:
        line = " ".join(line.split())
    try:
        cells = next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:
        cells = line.split(delimiter)
    return [cell.strip() for cell in cells]


def find_dialect(lines: Sequence[str]) -> Dialect | None:
    """Delimiter and decimal sign that read the most rows of numbers; None without such rows.

    Rows with fewer numbers than texts count where no rows have more.
    """
    filled = [line for line in lines if line.strip() and not line.lstrip().startswith(("#", "%"))]
    sample = _blocks(filled)
    return _best(sample, is_mixed=False) or _best(sample, is_mixed=True)


def doubt_of_commas(lines: Sequence[str], dialect: Dialect) -> str:
    """Why quoted numbers of a file with commas between its cells have no certain size, or empty."""
    if dialect.delimiter != "," or dialect.decimal != ",":
        return ""
    sample = _blocks([line for line in lines if line.strip()])
    cells = [cell for line in sample for cell in split_line(line, ",") if _COMMAS.fullmatch(cell)]
    if not cells or not all(_GROUPED.fullmatch(cell) for cell in cells):
        return ""
    return (
        f'"{cells[0]}" may have a separator of thousands or three decimals: write the numbers '
        "without separators of thousands, or with a decimal point"
    )


def _best(sample: Sequence[str], *, is_mixed: bool) -> Dialect | None:
    best: tuple[float, Dialect] | None = None
    for delimiter in _DELIMITERS:
        # The blank in a stamp separates no cells of a line that another character separates.
        if delimiter == BLANKS and best is not None and _is_whole(sample, best[1]):
            continue
        split = [split_line(line, delimiter) for line in sample]
        for decimal in ".,":
            if decimal == delimiter and not any('"' in line for line in sample):
                continue
            candidate = _rated(split, delimiter, decimal, is_mixed=is_mixed)
            if candidate is not None and (best is None or candidate[0] > best[0]):
                best = candidate
    return None if best is None else best[1]


def _is_whole(sample: Sequence[str], dialect: Dialect) -> bool:
    """Whether nine of ten lines have its width, and a value in each cell with a text."""
    rows = [split_line(line, dialect.delimiter) for line in sample]
    whole = [
        cells
        for cells in rows
        if len(cells) == dialect.width and len(set(_values(cells, dialect.decimal))) == 1
    ]
    return dialect.width > 1 and len(whole) >= _WHOLE * len(rows)


def _blocks(lines: Sequence[str]) -> list[str]:
    """Blocks of neighbouring lines, but the header and the last line, which may be cut off."""
    if len(lines) <= _SAMPLED:
        return list(lines)
    size = _SAMPLED // 3
    starts = (len(lines) // 4, len(lines) // 2, len(lines) - size - 1)
    return [line for start in starts for line in lines[start : start + size]]


def _rated(
    split: Sequence[list[str]], delimiter: str, decimal: str, *, is_mixed: bool
) -> tuple[float, Dialect] | None:
    """Cells with a value less cells with a text, in rows of the most frequent width."""
    widths: dict[int, int] = {}
    for cells in split:
        values, given = _values(cells, decimal)
        gain = values if is_mixed else 2 * values - given
        if gain > 0 and (not is_mixed or values >= FEWEST):
            widths[len(cells)] = widths.get(len(cells), 0) + gain
    if not widths:
        return None
    width = max(widths, key=lambda item: (widths[item], item))
    rows = [cells for cells in split if len(cells) == width]
    if is_mixed and 2 * len(rows) < len(split):
        return None
    has_units = has_cell_units(rows, decimal)
    return widths[width], Dialect(delimiter, decimal, width, has_units, is_mixed)


def has_cell_units(rows: Sequence[Sequence[str]], decimal: str) -> bool:
    """Whether at least half of the rows have a cell that is a number with its unit."""
    return 2 * sum(any(has_unit(c, decimal) for c in cells) for cells in rows) >= max(len(rows), 1)


def _values(cells: Sequence[str], decimal: str) -> tuple[int, int]:
    """Number of cells with a number or a stamp, and with any text."""
    given = [cell for cell in cells if cell]
    return sum(
        number(c, decimal) is not None or is_stamp(c) or has_unit(c, decimal) for c in given
    ), len(given)

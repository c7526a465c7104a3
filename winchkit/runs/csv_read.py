"""Reads a run from CSV: metadata lines ``# key: value``, one header line, numbers."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from winchkit.errors import Fault, RunError
from winchkit.runs.assemble import Recording, assemble, refuse
from winchkit.runs.columns import column_dimension, header_of
from winchkit.runs.run import Run
from winchkit.runs.text import read_lines

__all__ = ["read_csv"]

Array = NDArray[np.float64]
Rows = list[list[str]]


def read_csv(path: str | Path) -> Run:
    """Read a run; raises RunError with every fault of the file, each with its line."""
    name, lines = str(path), read_lines(Path(path))
    start = next((n for n, line in enumerate(lines) if not _is_comment(line)), len(lines))
    metadata, metadata_lines, faults = _metadata(name, lines[:start])
    if start == len(lines):
        faults.append(Fault("there is no header line; it names the columns, 'time [s],…'", name))
    refuse(faults)
    header = _header(name, lines[start], start + 1)
    rows, numbers = _rows(name, lines, start + 1)
    refuse(_ragged(name, rows, numbers, len(header)))
    columns: list[Array | None] = []
    for index, (column, _) in enumerate(header):
        values, wrong = _numbers([row[index] for row in rows])
        if wrong and column_dimension(column) is None:
            columns.append(None)
            continue
        columns.append(values)
        faults += [
            Fault(f"column '{column}' holds {rows[row][index]!r}, not a number", name, numbers[row])
            for row in wrong
        ]
    return assemble(
        Recording(
            name,
            header,
            columns,
            numbers.__getitem__,
            metadata,
            metadata_lines,
            start + 1,
            faults=faults,
        )
    )


def _is_comment(line: str) -> bool:
    return not line.strip() or line.lstrip().startswith("#")


def _metadata(
    path: str, lines: Sequence[str]
) -> tuple[dict[str, str], dict[str, int], list[Fault]]:
    """Metadata and the line of each key; a comment without a colon is only a comment."""
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
                f"columns are separated by {called}; save the file with commas between columns "
                "and points in numbers"
            )
            raise RunError(Fault(message, path, number))
    try:
        cells = next(csv.reader([line], strict=True))
    except csv.Error as error:
        raise RunError(Fault(f"the header cannot be read: {error}", path, number)) from None
    if not any(_numbers([cell])[1] for cell in cells):
        message = (
            "the first line holds numbers; a header such as 'time [s],motor_angle [rad]' is due"
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


def _rows(path: str, lines: list[str], start: int) -> tuple[Rows, list[int]]:
    """Cells of every row that is not blank, and its line."""
    rows: Rows = []
    numbers: list[int] = []
    reader = csv.reader(lines[start:])
    try:
        for row in reader:
            if row and (len(row) > 1 or row[0].strip()):
                rows.append(row)
                numbers.append(start + reader.line_num)
    except csv.Error as error:
        raise RunError(Fault(f"cannot be read: {error}", path, start + reader.line_num)) from None
    return rows, numbers


def _ragged(path: str, rows: Rows, numbers: list[int], width: int) -> list[Fault]:
    faults = [
        Fault(f"{len(row)} cells in this row, {width} columns in the header", path, number)
        for row, number in zip(rows, numbers, strict=True)
        if len(row) != width
    ]
    if faults and faults[-1].line == numbers[-1] and len(rows[-1]) < width:
        last = faults.pop()
        faults.append(Fault(last.message + "; is the file cut off?", path, last.line))
    return faults


def _numbers(cells: Sequence[str]) -> tuple[Array, list[int]]:
    """Values of a column, NaN where a cell is empty, and the rows that hold no number."""
    try:
        values = np.array(list(map(float, cells)), dtype=np.float64)
    except ValueError:
        pass
    else:
        if not any("_" in cell for cell in cells):
            return values, []
    read = [_number(cell) for cell in cells]
    wrong = [row for row, value in enumerate(read) if value is None]
    filled = [math.nan if value is None else value for value in read]
    return np.array(filled, dtype=np.float64), wrong


def _number(cell: str) -> float | None:
    """A cell's value; Python would also read ``1_000``, which no instrument writes."""
    text = cell.strip()
    if not text:
        return math.nan
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None

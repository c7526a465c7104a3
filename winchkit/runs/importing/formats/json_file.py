"""Reader of JSON files: records, lists of rows, lists by name, and one record per line.

A table is a list of mappings (a row each), a list of lists of numbers (a row each), a list of
numbers (a column), or a list of channels with a list of records each. Single numbers beside it
are constants, single texts are metadata.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError
from winchkit.runs.importing.formats.fields import fields_of
from winchkit.runs.importing.formats.variables import table_of_arrays
from winchkit.runs.importing.names import name_and_unit
from winchkit.runs.importing.table import ColumnTable

_DEEPEST = 6
"""Nesting of objects that is read; recordings have two or three levels."""
_FEWEST = 2
"""Rows of a table; a list of one element is a field."""


def is_json(data: bytes) -> bool:
    """Whether a file is JSON by its first character that is no blank."""
    start = data[:4000].removeprefix(b"\xef\xbb\xbf").lstrip()
    return start.startswith(b"{") or (start[:1] == b"[" and start[1:].lstrip()[:1] in b"[{")


def read_json(path: str, data: bytes) -> ColumnTable | None:
    """Read JSON or JSON Lines; None for no JSON, RunError for a list that is missing or cut off."""
    value, notes = _loaded(path, data)
    if value is None:
        return None
    found = list(_tables("", value, 0))
    is_single = len({name for name, _ in found}) == 1
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, columns in found:
        for key, array in columns.items():
            full = key if is_single or not name else f"{name}.{key}"
            # An index at the end is no unit.
            plain, unit = (
                (full, "")
                if full.endswith("]") and full[-2:-1].isdecimal()
                else name_and_unit(full)
            )
            plain = full if plain in arrays else plain
            arrays[plain], units[plain] = array, unit
    if not arrays:
        raise RunError(Fault("is JSON without a list of records or of numbers", path))
    single = dict(fields_of(value)) if isinstance(value, Mapping) else {}
    for name, item in single.items():
        if "[" not in name and name not in arrays:
            arrays[name] = np.array(item)
    return table_of_arrays(path, "JSON", arrays, units=units, notes=notes)


def _loaded(path: str, data: bytes) -> tuple[Any, list[str]]:
    """The value of a file, or the list of the values of its lines; None where it is no JSON."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None, []
    try:
        return json.loads(text), []
    except (ValueError, RecursionError) as error:
        whole = error
    lines = [line for line in text.splitlines() if line.strip()]
    values: list[Any] = []
    for number, line in enumerate(lines):
        try:
            values.append(json.loads(line))
        except (ValueError, RecursionError):
            if number == len(lines) - 1 and len(values) >= _FEWEST:
                return values, [
                    "the last line is no whole record and left out: is the file cut off?"
                ]
            if len(values) >= _FEWEST:
                raise RunError(Fault("this line is no record of JSON", path, number + 1)) from None
            if isinstance(whole, json.JSONDecodeError) and whole.pos >= len(text.rstrip()):
                message = "ends within a value of JSON: is the file cut off?"
                raise RunError(Fault(message, path)) from None
            return None, []
    return values, []


def _tables(name: str, value: Any, depth: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """Columns of every table of a value, by the path of the table."""
    if depth > _DEEPEST:
        return
    if isinstance(value, Mapping) and (rows := _of_named_rows(value)):
        yield name, _of_records(rows)
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _tables(f"{name}.{key}" if name else str(key), item, depth + 1)
    elif isinstance(value, list):
        records = _of_channels(value)
        if records or (len(value) >= _FEWEST and all(isinstance(row, Mapping) for row in value)):
            yield name, _of_records(records or value)
        else:
            yield from _tables_of_list(name, value, depth)


def _tables_of_list(
    name: str, value: list[Any], depth: int
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Columns of a list of rows, of numbers, of texts, or of tables."""
    if len(value) < _FEWEST:
        for item in value:
            yield from _tables(name, item, depth + 1)
    elif all(isinstance(item, list) for item in value):
        width = min(map(len, value))
        if width and all(_is_number(cell) for row in value for cell in row[:width]):
            columns = np.array([[_float(cell) for cell in row[:width]] for row in value]).T
            yield name, {f"{name or 'column'}[{n}]": c for n, c in enumerate(columns)}
        else:
            for n, item in enumerate(value):
                yield from _tables(f"{name}[{n}]", item, depth + 1)
    elif all(_is_number(item) for item in value) or all(isinstance(item, str) for item in value):
        is_text = isinstance(value[0], str)
        parent, _, last = name.rpartition(".")
        yield parent, {last or "data": np.array(value if is_text else [*map(_float, value)])}


def _of_named_rows(value: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Records of rows beside a list of the names of their cells (InfluxDB, pandas' ``split``)."""
    names = value.get("columns")
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        return []
    lists = [item for key, item in value.items() if isinstance(item, list) and key != "columns"]
    for rows in lists:
        if rows and all(isinstance(row, list) and len(row) == len(names) for row in rows):
            return [dict(zip(names, row, strict=True)) for row in rows]
    return []


def _of_channels(items: list[Any]) -> list[dict[str, Any]]:
    """Records of channels that each have a list of them, with the channel's other fields.

    An archive has few channels with many records each (EPICS: ``meta`` and ``data``); a record
    with a list has fewer elements in it than there are records. Empty for other lists.
    """
    found: list[dict[str, Any]] = []
    for item in items:
        lists = {
            key: rows
            for key, rows in (item.items() if isinstance(item, Mapping) else ())
            if isinstance(rows, list) and len(rows) > max(len(items), _FEWEST)
        }
        rows = next(iter(lists.values()), [])
        if len(lists) != 1 or not all(isinstance(row, Mapping) for row in rows):
            return []
        shared = dict(fields_of({key: one for key, one in item.items() if key not in lists}))
        own = {name.rpartition(".")[2]: one for name, one in shared.items()}
        found += [own | row for row in rows]
    return found


def _of_records(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Columns of a list of mappings; a field that a record lacks is missing in its row."""
    rows = [dict(fields_of(record)) for record in records]
    columns: dict[str, Any] = {}
    for name in dict.fromkeys(key for row in rows for key in row):
        cells = [row.get(name) for row in rows]
        if any(isinstance(cell, str) for cell in cells):
            columns[name] = np.array([cell if isinstance(cell, str) else "" for cell in cells])
        else:
            columns[name] = np.array([math.nan if cell is None else cell for cell in cells])
    return columns


def _is_number(value: Any) -> bool:
    return value is None or isinstance(value, int | float)


def _float(value: Any) -> float:
    return math.nan if value is None else float(value)

"""Tables in which each row is one value of one channel, which a column names.

Databases of time series (InfluxDB, EPICS archives), monitors of process variables and statistics
programs write recordings so; each channel has stamps of its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.runs.importing.formats.stamps import is_stamp
from winchkit.runs.importing.names import meaning_of, name_and_unit
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.importing.units.spelling import split_unit

_VALUE = re.compile(
    r"[_ ]*(value|val|reading|data|double|float|wert|valeur|valor|valore)s?[_ ]*", re.I
)
"""Name of a column of values that says nothing of their quantity."""
_UNIT = re.compile(r"[_ ]*(units?|einheit|egu|unité|unidad|unità)[_ ]*", re.I)
"""Name of a column of units; EGU is the field of EPICS."""
_DEVICE = re.compile(r".*[:./|]")
"""Names of process variables and of topics: device before quantity."""
_MOST = 64
"""Channels of one table."""
_ROWS = 10
"""Rows of each channel on average below which a repetition of names may be chance."""


@dataclass(frozen=True)
class _Parts:
    """Columns of a table by their role."""

    key: FileColumn
    value: FileColumn
    clocks: tuple[FileColumn, ...]
    unit: FileColumn | None


def by_channel(table: ColumnTable) -> ColumnTable:
    """A table with a group of columns per channel, where each row is one value of one channel."""
    parts = _parts(table)
    if parts is None:
        return table
    names = np.array([text.strip() for text in parts.key.texts or ()], dtype=np.str_)
    found = list(dict.fromkeys(names.tolist()))
    start = _common_start(found)
    columns = [
        item
        for name in found
        for item in _columns(parts, name, np.flatnonzero(names == name), start)
    ]
    names_found = ", ".join(found)
    note = f"each row is one value of one channel, by column '{parts.key.source}': {names_found}"
    return table.rearranged(columns, note)


def _common_start(names: Sequence[str]) -> int:
    """Characters of the device, up to a separator, that all names begin with."""
    first, last = min(names), max(names)
    same = next((n for n, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), 0)
    device = _DEVICE.match(first[:same])
    return device.end() if device else 0


def _parts(table: ColumnTable) -> _Parts | None:
    """Roles of the columns; None for a table of another form."""
    if len({item.group for item in table.columns}) > 1:
        return None
    stamps = [item for item in table.columns if _is_stamped(item)]
    texts = [item for item in table.columns if item.texts is not None and item not in stamps]
    unit = next((item for item in texts if _UNIT.fullmatch(item.name)), None)
    for key in texts:
        names = np.array([text.strip() for text in key.texts or ()], dtype=np.str_)
        found, codes = np.unique(names, return_inverse=True)
        if len(found) > _MOST or len(names) < _ROWS * len(found) or key is unit:
            continue
        if not all(re.search("[A-Za-z]", name) for name in found):
            continue
        if len(found) == 1 and meaning_of(split_unit(str(found[0]))[0]) is None:
            continue
        numbers = [item for item in table.columns if item.texts is None]
        changing = [item for item in numbers if not _is_constant(item, codes)]
        clocks = [
            item
            for item in changing
            if _is_increasing(item, codes) and not _VALUE.fullmatch(item.name)
        ]
        values = [item for item in changing if item not in clocks]
        # Beside a quality that varies the column of the values has the name of one.
        values = [item for item in values if _VALUE.fullmatch(item.name)] or values
        clocks += _without_limits(stamps)
        if clocks and len(values) == 1 and _is_of_any_quantity(values[0], found.tolist()):
            return _Parts(key, values[0], tuple(clocks), unit)
    return None


def _is_stamped(column: FileColumn) -> bool:
    return is_stamp(next((text for text in column.texts or () if text.strip()), ""))


def _without_limits(stamps: Sequence[FileColumn]) -> list[FileColumn]:
    """Columns of stamps without those of a moment that all rows have, as a query's start."""
    found = [set(item.texts or ()) for item in stamps]
    kept = [
        item
        for item, moments in zip(stamps, found, strict=True)
        if len(moments) > 1 or not any(":" in moment for moment in moments)
    ]
    return kept or list(stamps)


def _is_increasing(column: FileColumn, codes: NDArray[np.intp]) -> bool:
    """Whether numbers never decrease within any channel, as only times do."""
    channels = [column.values[codes == code] for code in np.unique(codes)]
    return all(bool(np.all(np.diff(values) >= 0)) for values in channels)


def _is_constant(column: FileColumn, codes: NDArray[np.intp]) -> bool:
    """Whether numbers do not change within any channel: a table's number, a quality code."""
    for code in np.unique(codes):
        known = column.values[codes == code]
        known = known[np.isfinite(known)]
        if len(known) and np.any(known != known[0]):
            return False
    return True


def _is_of_any_quantity(value: FileColumn, names: Sequence[str]) -> bool:
    """Whether the channels, and not the column of the values, have the names of quantities."""
    if _VALUE.fullmatch(value.name):
        return True
    is_unnamed = value.name == str(value.number)
    return is_unnamed and any(meaning_of(split_unit(name)[0]) is not None for name in names)


def _columns(
    parts: _Parts, channel: str, rows: NDArray[np.intp], start: int
) -> Iterator[FileColumn]:
    """Stamps and values of one channel, whose name begins with what all have in common."""
    given = set[str]()
    if parts.unit is not None and parts.unit.texts is not None:
        given = {parts.unit.texts[int(row)].strip() for row in rows}
    name, unit = name_and_unit(channel[start:], given.pop() if len(given) == 1 else "")
    for clock in parts.clocks:
        yield replace(clock.at(rows), labels=(name,), group=channel)
    value = parts.value.at(rows)
    yield replace(value, name=name, unit=unit or parts.value.unit, group=channel)

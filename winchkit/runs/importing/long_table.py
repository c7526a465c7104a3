"""Tables in long form: each row is of one axis, or of one kind, which a column names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError
from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import ColumnTable, FileColumn, are_whole

_MARKERS = frozenset(("marker id", "marker", "tag id", "tag", "aruco id", "fiducial id"))
"""Titles of a column that names the marker whose pose a row has."""
_MOST = 64
"""Axes of one table."""
_ROWS = 10
"""Rows of each axis below which a repetition of values may be chance."""
_CLOSER = 0.25
"""Change between the rows of one axis over that between neighbouring rows, at most.

Rows of one signal change more over several rows than over one: above 1 for a flag that toggles."""


def axes_of(table: ColumnTable, by: str) -> dict[str, ColumnTable]:
    """Tables by axis of a table whose column ``by`` (name or number) names the axis of each row.

    Rows without an axis are left out. Raises RunError for a column that is not there, or with too
    few or too many values.
    """
    key, rows = _rows_of(table, by, "axis")
    return {name: _of_rows(table, key, own) for name, own in rows.items()}


def by_kind(table: ColumnTable, by: str) -> ColumnTable:
    """A table with columns and times for each kind of row, which column ``by`` names.

    A column that several kinds have gets the name of its kind before its own. Raises RunError as
    :func:`axes_of`.
    """
    key, rows = _rows_of(table, by, "kind")
    columns = [
        replace(own, labels=(name, *own.labels), group=name)
        for name, kept in rows.items()
        for item in table.columns
        if item is not key and len(item) == len(key)
        for own in [item.at(kept)]
        if own.texts is not None or np.any(np.isfinite(own.values))
    ]
    note = f"each row is of one kind, by column '{key.source}': {', '.join(rows)}"
    return table.rearranged(columns, note)


def has_kinds(table: ColumnTable, key: FileColumn) -> bool:
    """Whether the rows of some value of a column lack a column that those of another have."""
    names = _names(key)
    if names is None:
        return False
    found = [names == name for name in np.unique(names)]
    known = [np.isfinite(item.values) for item in table.columns if len(item) == len(key)]
    return any(
        any(one[own].any() for own in found) > all(one[own].any() for own in found) for one in known
    )


def _rows_of(
    table: ColumnTable, by: str, what: str
) -> tuple[FileColumn, dict[str, NDArray[np.intp]]]:
    """The column that names the axis or kind of each row, and the rows of each."""
    key = table.column(by)
    if key is None:
        has = ", ".join(repr(column.source) for column in table.columns)
        message = f"there is no column '{by}' that names the {what}; it has {has}"
        raise RunError(Fault(message, table.path))
    names = _names(key)
    found = [] if names is None else [name for name in dict.fromkeys(names.tolist()) if name]
    if not 1 < len(found) <= _MOST:
        message = (
            f"column '{by}' has {len(found)} values; one that names the {what} of each row has 2 "
            f"to {_MOST}"
        )
        raise RunError(Fault(message, table.path))
    return key, {name: np.flatnonzero(names == name) for name in found}


def marker_column(table: ColumnTable) -> FileColumn | None:
    """The column that names the marker of each row, of several markers of a camera."""
    for column in table.columns:
        names = _names(column) if words_of(column.name) in _MARKERS else None
        if names is not None and 1 < len(set(names.tolist()) - {""}) <= _MOST:
            return column
    return None


def likely_axis(table: ColumnTable) -> FileColumn | None:
    """The column that names the axis of each row, where there seems to be one.

    Its few values alternate, and another column changes far less from row to row of one axis than
    between neighbouring rows.
    """
    for column in table.columns:
        # Most columns of text are stamps, which need not be sorted.
        if column.texts is not None and len(set(column.texts)) > _MOST:
            continue
        if (names := _names(column)) is None:
            continue
        found, codes, counts = np.unique(names, return_inverse=True, return_counts=True)
        if not 1 < len(found) <= _MOST or "" in found or counts.min() < _ROWS:
            continue
        if np.mean(codes[1:] != codes[:-1]) < 0.5:
            continue
        others = [one for one in table.columns if one is not column and len(one) == len(column)]
        if any(_is_closer(one.values, codes) for one in others if one.texts is None):
            return column
    return None


def _names(column: FileColumn) -> NDArray[np.str_] | None:
    """Axis of each row, empty where it has none; None for numbers that name nothing."""
    if column.texts is not None:
        return np.array([text.strip() for text in column.texts], dtype=np.str_)
    known = column.known
    if np.any(known < 0) or not are_whole(known):
        return None
    found = np.unique(known)
    if len(found) > _MOST:
        return None
    names = np.full(len(column), "", dtype="<U20")
    for value in found:
        names[column.values == value] = f"{value:.0f}"
    return names


def _is_closer(values: Array, codes: NDArray[np.intp]) -> bool:
    """Whether a column changes less within the rows of each axis than between neighbours."""
    between = np.abs(np.diff(values))
    axes = [values[codes == code] for code in np.unique(codes)]
    within = np.concatenate([np.abs(np.diff(axis)) for axis in axes])
    if not np.any(np.isfinite(between)) or not np.any(np.isfinite(within)):
        return False
    return float(np.nanmean(within)) < _CLOSER * float(np.nanmean(between))


def _of_rows(table: ColumnTable, key: FileColumn, rows: NDArray[np.intp]) -> ColumnTable:
    def line_of(row: int) -> int | None:
        return table.line_of(int(rows[row]))

    others = [item for item in table.columns if item is not key and len(item) == len(key)]
    return replace(
        table, columns=tuple(item.at(rows) for item in others), line_of=line_of, interval=None
    )

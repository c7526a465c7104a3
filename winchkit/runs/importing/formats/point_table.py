"""Tables of points: their names, and those without a header, as laser trackers export them.

    P001;903.3055;2062.6540;582.5511
    A Poses P001 903.3055 2062.6540 582.5511

The names are those of the point, of its group and of its collection (SpatialAnalyzer, *Exporting
ASCII Formatted Points*); behind the coordinates stand texts, or what SpatialAnalyzer adds (offsets
of the reflector, uncertainties, time stamps). The unit of the coordinates is asked where the lines
above do not declare it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import takewhile

from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import ColumnTable, FileColumn, named_apart

_NAMES = ("Collection", "Group", "Point")
"""Names before the coordinates; fewer are the last of them."""
_COORDINATES = ("X", "Y", "Z")
_PROGRAM = "spatialanalyzer"
_TITLES = frozenset(
    (
        *("point", "point name", "point id", "point no", "pt", "pt id", "name", "target"),
        *("pose", "pose no", "pose name", "punkt", "punktname", "punktnummer"),
    )
)
"""Titles of a column with the names of points, which may be numbers."""
_DISTINCT = 0.9
"""Share of the rows with a name of their own, at least: other texts are remarks or states."""


def with_coordinates(table: ColumnTable) -> ColumnTable:
    """Names for the columns of a table of points that has none."""
    columns = table.columns
    if any(column.name != str(column.number) for column in columns):
        return table
    names = len(list(takewhile(_is_text, columns)))
    behind = columns[names + len(_COORDINATES) :]
    by_program = any(
        _PROGRAM in text.casefold() for pair in table.metadata.items() for text in pair
    )
    if not 1 <= names <= len(_NAMES) or len(columns) < names + len(_COORDINATES):
        return table
    coordinates = columns[names : names + len(_COORDINATES)]
    if any(map(_is_text, coordinates)) or not (by_program or all(map(_is_text, behind))):
        return table
    titles = (*_NAMES[-names:], *_COORDINATES)
    titled = [replace(c, name=t) for c, t in zip(columns, titles, strict=False)]
    return replace(table, columns=named_apart([*titled, *behind]))


def _is_text(column: FileColumn) -> bool:
    return column.texts is not None


def names_of_points(table: ColumnTable, used: Collection[str]) -> tuple[Sequence[str], ...]:
    """Unused columns that may be the names of points: texts, or numbers below such a title."""
    found = []
    for column in table.columns:
        titled = words_of(column.name) in _TITLES
        names = column.texts
        if names is None and titled:
            names = [f"{value:.12g}" for value in column.values.tolist()]
        if names is None or column.source in used or not names:
            continue
        names = [name.strip() for name in names]
        if len(set(names)) >= _DISTINCT * len(names):
            found.append(names)
    return tuple(found)

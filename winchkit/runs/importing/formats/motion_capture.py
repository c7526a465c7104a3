"""Text exports of motion capture: Qualisys TSV (markers, rigid bodies) and TRC (markers).

A marker is a point and has no orientation. A Qualisys body has angles of R = Rx Ry Rz and the
matrix by columns; the matrix is used, since runs have R = Rz Ry Rx. Qualisys writes zeros for what
is not tracked.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from winchkit.runs.importing.formats.cells import number
from winchkit.runs.importing.formats.dialect import Dialect, decode, split_line
from winchkit.runs.importing.formats.header import Row
from winchkit.runs.importing.formats.text import table_of_rows
from winchkit.runs.importing.table import ColumnTable

_QUALISYS, _TRC = b"NO_OF_FRAMES", b"PathFileType"
_NAMES = {"MARKER_NAMES", "BODY_NAMES"}
_LEADING = {"frame": "Frame", "frame#": "Frame", "time": "Time [s]"}
_AXES = ("X", "Y", "Z")
_BODY = ("X [mm]", "Y [mm]", "Z [mm]", "Roll [deg]", "Pitch [deg]", "Yaw [deg]", "Residual")
_MATRIX = tuple(f"Rot{row}{column}" for column in "123" for row in "123")
_HEAD = 40
"""Lines in which the header ends."""
_POINTS = (
    "markers are points without an orientation: --body takes the position of one as that of the "
    "platform; for its pose export a rigid body (6D) of at least three markers"
)


@dataclass(frozen=True)
class _CaptureColumns:
    """Names of the columns, and where the rows begin."""

    text: str
    above: int
    """Lines of keys and values."""
    first: int
    """Line of the first row, from 0."""
    leading: tuple[str, ...]
    bodies: tuple[str, ...]
    names: tuple[str, ...]
    """Columns of each body or marker."""

    @property
    def width(self) -> int:
        """Cells of a row."""
        return len(self.leading) + len(self.bodies) * len(self.names)


def read_capture(path: str, data: bytes) -> ColumnTable | None:
    """Read a text export of motion capture; None for another file."""
    if not data.lstrip(b"\xef\xbb\xbf").startswith((_QUALISYS, _TRC)):
        return None
    lines, _ = decode(data, path)
    rows = [(n, split_line(line, "\t")) for n, line in enumerate(lines, start=1)]
    layout = _qualisys(rows) if _QUALISYS in data[:20] else _trc(rows)
    if layout is None:
        return None
    names = [*layout.leading, *layout.names * len(layout.bodies)]
    labels = [""] * len(layout.leading)
    labels += [body for body in layout.bodies for _ in layout.names]
    head: list[Row] = [*rows[: layout.above], (layout.first, labels), (layout.first, names)]
    found = table_of_rows(
        path,
        [*head, *_tracked(rows[layout.first :], layout)],
        Dialect("\t", ".", layout.width),
        is_ended=data.endswith((b"\n", b"\r")),
    )
    notes = (*found.notes, _POINTS) if len(layout.names) == len(_AXES) else found.notes
    return replace(found, layout=layout.text, notes=notes)


def _qualisys(rows: Sequence[Row]) -> _CaptureColumns | None:
    head = rows[:_HEAD]
    keyed = next((n for n, (_, cells) in enumerate(head) if cells[0] in _NAMES), None)
    if keyed is None:
        return None
    bodies = tuple(cell for cell in head[keyed][1][1:] if cell)
    first = next((n for n in range(keyed + 1, len(head)) if _is_row(head[n][1])), None)
    if first is None or not bodies:
        return None
    above = head[first - 1][1]
    leading = tuple(found for cell in above if (found := _LEADING.get(cell.casefold())))
    width = len(_filled(head[first][1]))
    is_marker = head[keyed][1][0] == "MARKER_NAMES"
    names = tuple(f"{axis} [mm]" for axis in _AXES) if is_marker else (*_BODY, *_MATRIX)
    if not leading and width == 2 + len(bodies) * len(names):
        leading = ("Frame", "Time [s]")
    found_layout = _CaptureColumns("Qualisys TSV", keyed, first, leading, bodies, names)
    return found_layout if found_layout.width == width else None


def _trc(rows: Sequence[Row]) -> _CaptureColumns | None:
    """The third line has the values of the keys of the second, the fourth the markers."""
    if len(rows) < 6:
        return None
    keys, values, titles = rows[1][1], rows[2][1], rows[3][1]
    given = dict(zip(keys, values, strict=False))
    bodies = tuple(cell for cell in titles[2:] if cell)
    first = next((n for n, (_, cells) in enumerate(rows[:_HEAD]) if n > 3 and _is_row(cells)), None)
    if first is None or not bodies:
        return None
    unit = given.get("Units", "mm")
    names = tuple(f"{axis} [{unit}]" for axis in _AXES)
    return _CaptureColumns("TRC", 0, first, ("Frame", "Time [s]"), bodies, names)


def _is_row(cells: Sequence[str]) -> bool:
    given = [cell for cell in cells if cell]
    return len(given) > 1 and all(number(cell, ".") is not None for cell in given)


def _filled(cells: list[str]) -> list[str]:
    """Cells without the empty one behind the last tab."""
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _tracked(rows: Iterable[Row], layout: _CaptureColumns) -> Iterable[Row]:
    """Rows of one width; the positions of what is not tracked are NaN."""
    size, start = len(layout.names), len(layout.leading)
    for line, cells in rows:
        if not any(cells):
            continue
        own = [*cells, *[""] * (layout.width - len(cells))]
        if len(own) > layout.width and not any(own[layout.width :]):
            own = own[: layout.width]
        for place in range(start, min(len(own), layout.width), size):
            if all(number(cell, ".") == 0.0 for cell in own[place : place + 3]):
                own[place : place + size] = ["nan"] * size
        yield line, own

"""Names and units of columns from the rows above the numbers, and the metadata above these rows.

Known shapes: one row ``name [unit]``; a row of names and one of units; several rows of labels above
the names (trackers: body, quantity, axis); pairs of key and value per column (TwinCAT Scope);
``X, Y`` below the title of each channel (amplifiers).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from winchkit.runs.importing.formats.cells import number
from winchkit.runs.importing.formats.stamps import is_stamp
from winchkit.runs.importing.names import meaning_of, name_and_unit
from winchkit.runs.importing.units.spelling import is_unit_row, read_unit, split_unit

Row = tuple[int, list[str]]
"""Line number and cells."""
_COMMENT = re.compile(r"^\s*[#%!;*/]+\s*")
END_OF_HEADER = "***End_of_Header***"
"""Mark by which LabVIEW ends the header of a file and that of a segment."""
_NAME = "Name"
KEYS = frozenset(
    (
        *(_NAME, "SymbolComment", "Data-Type", "SampleTime", "SampleTime[ms]", "VariableSize"),
        *("SymbolBased", "IndexGroup", "IndexOffset", "SymbolName", "NetID", "NetId", "Port"),
        *("Offset", "ScaleFactor", "BitMask", "Unit", "Unit ScaleFactor", "Unit Offset"),
    )
)
"""Keys of a TwinCAT Scope export."""
_X_VALUE = "X_Value"
_RULE = re.compile(r":?[-=_+]{2,}:?")
_NAME_ROW = {"channelname", "signalname", "tracename", "kanalname"}
_UNIT_ROW = {"unit", "units", "unitsymbol", "vunit", "einheit"}
"""First cells of the rows of a header that has the title of each row above the times."""
_ROW_LABELS = {"type", "name", "id", "parent", "unit", "units", "description", "channel"}
_IDENTIFIER = re.compile(r"[0-9A-Fa-f]{8,}(-[0-9A-Fa-f]{4,})*|\d+")
VICON = frozenset(("Trajectories", "Model Outputs", "Devices", "Segments", "Objects", "Joints"))
"""Titles of the sections of Vicon's exports."""
_INCREMENT = re.compile(r"t ?inc\w*\s*=\s*(\S+)", re.IGNORECASE)
_RATEKEYS = re.compile(
    r"(export frame rate|capture frame rate|frame rate|sample ?rate|sampling ?rate|"
    r"sample frequency|sampling frequency|abtastrate|messrate|frequenz|frequency|rate|fs)\W*"
    r"(?P<unit>k?hz)?\W*",
    re.IGNORECASE,
)
_STEPKEYS = re.compile(
    r"(delta_x|interval|sampl(?:e|ing) ?time ?interval|"
    r"sample ?time|sampling ?time|sample ?interval|sampling ?interval|sample ?period|"
    r"sampling ?period|h ?resolution|abtastzeit|abtastintervall|zykluszeit|cycle ?time|dt)"
    r"\W*(?P<unit>[mun]?s)?\W*",
    re.IGNORECASE,
)


@dataclass
class Header:
    """Header of a text file."""

    names: list[str]
    units: list[str]
    labels: list[tuple[str, ...]]
    metadata: dict[str, str] = field(default_factory=dict)
    interval: float | None = None
    """Declared sampling interval, s."""
    rows: tuple[tuple[str, ...], ...] = ()
    """Cells of the rows of the header, which some programs repeat."""


def read_header(rows: Sequence[Row], width: int, decimal: str, *, is_blank: bool) -> Header:
    """Read what is above the numbers; names are empty where the file has none."""
    header = _of_labview(rows, width, decimal) or _of_oscilloscope(rows, width, decimal)
    if header is not None:
        return header
    remarks = []
    while rows and _is_remark(rows[-1][1]) and _has_names(rows[:-1], width, decimal):
        *rows, (_, remark) = rows
        remarks.append(remark)
    cut = _start_of_block(rows, width, decimal, is_blank=is_blank)
    if is_blank:
        cut = _start_of_names(rows, cut)
    above = [*(cells for _, cells in rows[:cut]), *remarks]
    block = [
        _uncommented(cells, width) for _, cells in rows[cut:] if any(cells) and not _is_rule(cells)
    ]
    if is_blank:
        block = [_with_brackets(cells, width) for cells in block]
    header = (
        _keyed(block, width)
        or _titled([cells for _, cells in rows if any(cells)], width)
        or _paired(block, width)
        or _stacked(block, width)
    )
    header.metadata.update(_metadata([[" ".join(c)] if is_blank else c for c in above]))
    header.rows = tuple(tuple(cells) for _, cells in rows[cut:] if any(cells))
    header.interval = header.interval or _interval(header.metadata, decimal)
    return header


def _of_labview(rows: Sequence[Row], width: int, decimal: str) -> Header | None:
    """Names below the last mark, and titled rows of units and steps above it (LVM).

    References
    ----------
    National Instruments (2019). Specification for the LabVIEW Measurement File (.lvm).
    """
    filled = [cells for _, cells in rows if any(cells)]
    marks = [n for n, cells in enumerate(filled) if cells[0].startswith(END_OF_HEADER)]
    if not marks or marks[-1] + 1 >= len(filled):
        return None
    segment = {cells[0]: cells for cells in filled[(marks[-2] if marks[1:] else 0) : marks[-1]]}
    cells = _padded(filled[marks[-1] + 1], width)
    names = list(map(name_and_unit, cells, _padded(segment.get("Y_Unit_Label", []), width)))
    is_clock = "Time" in segment.get("X_Dimension", [])
    times = [is_clock and name == _X_VALUE for name, _ in names]
    steps = {cell for cell in segment.get("Delta_X", [])[1:] if cell}
    step = number(steps.pop(), decimal) if len(steps) == 1 else None
    return Header(
        ["time" if is_one else name for (name, _), is_one in zip(names, times, strict=True)],
        ["s" if is_one else unit for (_, unit), is_one in zip(names, times, strict=True)],
        [()] * width,
        _metadata(filled[: marks[0]]),
        step,
        (tuple(filled[marks[-1] + 1]),),
    )


def _of_oscilloscope(rows: Sequence[Row], width: int, decimal: str) -> Header | None:
    """Names with the time of the first sample and the interval behind them, in place of times.

    ``X,CH1,Start,Increment`` above ``Sequence,Volt,-6e-6,1e-8``, or
    ``Time(s),CH1(V),t0 = -6e-6, tInc = 1e-8``.
    """
    filled = [cells for _, cells in rows if any(cells)]
    for cells, below in pairwise([*filled, []]):
        keys = [cell.casefold() for cell in cells]
        step = None
        if "increment" in keys and len(below) > keys.index("increment") >= width:
            step = number(below[keys.index("increment")], decimal)
            units = _padded(below, width)
        elif given := [found for cell in cells if (found := _INCREMENT.fullmatch(cell))]:
            step, units = number(given[0][1], decimal), [""] * width
        if step is not None and step > 0:
            named = list(map(name_and_unit, _padded(cells, width), units))
            names, known = [name for name, _ in named], [unit for _, unit in named]
            return Header(names, known, [()] * width, interval=step)
    return None


def _start_of_block(rows: Sequence[Row], width: int, decimal: str, *, is_blank: bool) -> int:
    """Index of the first row that belongs to the columns."""
    cut = len(rows)
    while cut and not any(rows[cut - 1][1]):
        cut -= 1
    end = cut
    keys = KEYS if keyed_width(rows) else frozenset()
    while cut:
        own = rows[cut - 1][1]
        cells = _uncommented(own, width)
        given = [cell for cell in cells if cell]
        is_comment = bool(own and _COMMENT.match(own[0]))
        # Labels that stand once for several columns, above others.
        is_spread = bool(given) and not cells[0] and (end > cut or is_unit_row(cells))
        bare = [cell for cell in cells if cell[:1] not in "(["] if is_blank else cells
        is_wide = width in {len(cells), len(bare)} or (len(cells) <= width + 1 and not is_comment)
        is_number = all(number(cell, decimal) is not None for cell in given)
        # Whether a row belongs to the columns: the first case that holds.
        cases = (
            (_is_rule(own), True),
            (bool(given) and not is_comment and cells[0] in keys, True),
            (not given or not is_wide, False),
            (is_spread, True),
            (len(given) == 1 < width, False),
            (2 * len(given) < width or is_number, False),
            (end > cut and len(given) == 2 and width > 3 and bool(cells[1]), False),
        )
        if not next((belongs for holds, belongs in cases if holds), True):
            break
        cut -= 1
    return cut


def _is_remark(cells: Sequence[str]) -> bool:
    """Whether a line has at most one cell."""
    return sum(map(bool, cells)) <= 1


def _has_names(rows: Sequence[Row], width: int, decimal: str) -> bool:
    """Whether the last lines of more than one cell have a text in each column."""
    lowest = next((cells for _, cells in reversed(rows) if not _is_remark(cells)), [])
    return len(lowest) == width and all(
        cell and number(cell, decimal) is None and not is_stamp(cell) for cell in lowest
    )


def _is_rule(cells: Sequence[str]) -> bool:
    """Whether a row is a line of dashes below the names."""
    given = [cell for cell in cells if cell]
    return bool(given) and all(_RULE.fullmatch(cell) for cell in given)


def _start_of_names(rows: Sequence[Row], cut: int) -> int:
    """Index of the row of names, where nothing but a row of units is below it."""
    start = len(rows)
    while start > cut:
        start -= 1
        cells = rows[start][1]
        if any(cells) and not is_unit_row(cells):
            return start
    return start


def _uncommented(cells: list[str], width: int) -> list[str]:
    """A header behind a comment sign: ``# time pos``, ``%time,pos``."""
    if not cells or not _COMMENT.match(cells[0]):
        return cells
    first = _COMMENT.sub("", cells[0])
    # A sign that stands alone before the names is a cell too many.
    return cells[1:] if not first and len(cells) > width else [first, *cells[1:]]


def _with_brackets(cells: list[str], width: int) -> list[str]:
    """Names and units in brackets that a blank separates: ``Angle (deg)`` is one cell."""
    found: list[str] = []
    for cell in cells:
        if found and cell[:1] in {"(", "["} and len(cells) > width:
            found[-1] += f" {cell}"
        else:
            found.append(cell)
    return found


def _padded(cells: Sequence[str], width: int) -> list[str]:
    return [*cells, *[""] * (width - len(cells))][:width]


def keyed_width(rows: Sequence[Row]) -> int:
    """Cells of the row of names of a TwinCAT Scope export; 0 in another file."""
    for (_, cells), (_, below) in pairwise([row for row in rows if any(row[1])]):
        starts = [n for n, cell in enumerate(cells) if cell == _NAME]
        if starts[:1] == [0] and len(cells) > len(starts) and below[0] in KEYS - {_NAME}:
            same = [n for n in starts if n < len(below) and below[n] == below[0]]
            if same == starts:
                return len(cells)
    return 0


def _keyed(block: list[list[str]], width: int) -> Header | None:
    """Rows ``Name, x, y, Name, z`` and ``Unit, mm, N, Unit, V``: a time before its channels."""
    names = next((cells for cells in block if cells[:1] == [_NAME]), None)
    if names is None or not keyed_width([(0, cells) for cells in block]):
        return None
    names = _padded(names, width)
    keyed = {cells[0]: _padded(cells, width) for cells in block if cells}
    units = keyed.get("Unit", [""] * width)
    has_steps = any(key.lower().startswith("sampletime") for key in keyed)
    found = Header([], [], [])
    for index, name in enumerate(names):
        plain, unit = name_and_unit(name, units[index])
        is_time = name == _NAME
        following = names[index + 1] if is_time and index + 1 < width else ""
        found.names.append("time" if is_time else plain or str(index + 1))
        found.units.append(("ms" if has_steps else "") if is_time else unit)
        found.labels.append((following,) if is_time else ())
    return found


def _titled(block: list[list[str]], width: int) -> Header | None:
    """Rows whose first cell is their title, above the times: LabVIEW SignalExpress, DIAdem."""
    titles = [re.sub(r"[ _]", "", cells[0]).casefold() if cells else "" for cells in block]
    row = next((n for n, title in enumerate(titles) if title in _NAME_ROW), None)
    if row is None:
        return None
    below = next((n for n, own in enumerate(titles) if own in _UNIT_ROW), None)
    units = [] if below is None else block[below]
    named = list(map(name_and_unit, _padded(block[row], width), _padded(units, width)))[1:]
    known = [meaning_of(name) for name, _ in named]
    has_times = any(meaning is not None and meaning.channel == "time" for meaning in known)
    named.insert(0, ("" if has_times else "time", ""))
    others = [cells[:2] for n, cells in enumerate(block) if n not in {row, below}]
    return Header(
        [name for name, _ in named],
        [unit for _, unit in named],
        [()] * width,
        {cells[0]: cells[1] for cells in others if len(cells) == 2},
    )


def _paired(block: list[list[str]], width: int) -> Header | None:
    """``X, Y, X, Y`` below the title of each pair: the times of a channel and its values."""
    rows = [_padded(cells, width) for cells in block]
    pairs = width // 2
    if len(rows) < 2 or pairs < 2 or [cell.casefold() for cell in rows[-1]] != ["x", "y"] * pairs:
        return None
    titles = [rows[-2][2 * k] or rows[-2][2 * k + 1] for k in range(pairs)]
    if not all(titles):
        return None
    found = Header([], [], [])
    for title in titles:
        name, unit = split_unit(title)
        is_unit = read_unit(unit) is not None
        found.names += ["time", name if is_unit else title]
        found.units += ["", unit if is_unit else ""]
        found.labels += [(title,), ()]
    return found


def _stacked(block: list[list[str]], width: int) -> Header:
    """Rows of labels, the lowest of which has the names, and perhaps a row of units."""
    rows = [_padded(cells, width) for cells in block]
    unit_row = next((row for row in reversed(rows) if is_unit_row(row)), None)
    if unit_row is not None and len(rows) > 1:
        rows.remove(unit_row)
    else:
        unit_row = None
    names, units, labels = [], [], []
    given = _padded(unit_row or [], width)
    split = list(map(name_and_unit, rows[-1], given)) if rows else [("", "")] * width
    uppers = [_filled(row) for row in rows[:-1]]
    for index, (own_name, own_unit) in enumerate(split):
        name, unit = own_name, own_unit
        texts = tuple(row[index] for row in uppers if row[index])
        above = tuple(dict.fromkeys(t for t in texts if not _IDENTIFIER.fullmatch(t)))
        if unit_row is not None and not unit:
            unit = unit_row[index].strip()
        found = next((text for text in reversed(above) if text), "")
        if found and (not name or _is_unit_of(own_name, found)):
            unit = unit or own_name
            name, above = found, above[:-1]
        names.append(name)
        units.append(unit if unit.lower().strip("[](){}") not in {"", "-", "none"} else "")
        labels.append(above)
    return Header(names, units, labels)


def _is_unit_of(cell: str, label: str) -> bool:
    """Whether a cell in the row of names is the unit of a time, whose name is above it."""
    unit, meaning = read_unit(cell), meaning_of(label)
    is_time = meaning is not None and meaning.channel == "time"
    return is_time and unit is not None and unit.dimension == "time"


def _filled(row: list[str]) -> list[str]:
    """Labels that stand once for several columns are repeated; titles of rows are left out."""
    cells = ["" if cell.lower() in _ROW_LABELS else cell for cell in row]
    if not any(cells):
        return cells
    start = next(index for index, cell in enumerate(cells) if cell)
    is_sparse = start > 0 and sum(bool(cell) for cell in cells[start:]) < len(cells) - start
    if not is_sparse:
        return cells
    for index in range(start + 1, len(cells)):
        cells[index] = cells[index] or cells[index - 1]
    return cells


def _metadata(rows: Sequence[Sequence[str]]) -> dict[str, str]:
    """Keys and values: ``Key: value``, ``Key = value``, and rows with a key in every other cell."""
    found: dict[str, str] = {}
    for cells in rows:
        given = [cell for cell in cells if cell]
        if not given:
            continue
        given[0] = _COMMENT.sub("", given[0])
        joined = " ".join(given)
        match = re.match(r"([^:=]{1,60}?)\s*[:=]\s*(.+)", joined)
        if len(cells) > 1 and len(given) > 1:
            for key, value in zip(cells[0::2], cells[1::2], strict=False):
                if key:
                    found.setdefault(_COMMENT.sub("", key).rstrip(":= "), value)
        elif match:
            found.setdefault(match[1].strip(), match[2].strip())
        elif len(given) == 1:
            found.setdefault(f"line {len(found) + 1}", given[0])
    return found


def _interval(metadata: dict[str, str], decimal: str) -> float | None:
    """Sampling interval that the metadata declare, s."""
    for key, value in metadata.items():
        text = key.strip()
        for pattern, is_rate in ((_RATEKEYS, True), (_STEPKEYS, False)):
            match = pattern.fullmatch(text)
            if match is None:
                continue
            figure = re.match(r"\s*([-+0-9.,eE]+)\s*([a-zA-Zµ]*)", value)
            if not figure:
                continue
            size = number(figure[1], decimal) or number(figure[1], ".")
            if not size or size <= 0:
                continue
            unit = (figure[2] or match["unit"] or "").lower().replace("µ", "u")
            scale = {"khz": 1e3, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}.get(unit, 1.0)
            return 1 / (size * scale) if is_rate else size * scale
    rate = _rate_alone(metadata)
    return 1 / rate if rate else None


def _rate_alone(metadata: dict[str, str]) -> float | None:
    """Rate in a line of its own under the title of a section, as Vicon writes it, Hz."""
    for title, value in pairwise(metadata.values()):
        rate = number(value, ".") if title in VICON else None
        if rate and rate > 0:
            return rate
    return None

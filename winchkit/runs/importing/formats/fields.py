"""Fields of a structured message or record by their paths, and lines that label each value.

Elements of an array are named by their index, joints of a JointState by their name.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from winchkit.runs.importing.formats.dialect import decode
from winchkit.runs.importing.formats.stamps import epoch_unit
from winchkit.runs.importing.formats.variables import table_of_arrays
from winchkit.runs.importing.names import name_and_unit
from winchkit.runs.importing.table import ColumnTable
from winchkit.runs.importing.units.spelling import read_unit

_LONGEST = 64
"""Most elements of an array in a message; longer ones are images and point clouds."""
_HEADER = re.compile(r"(\w+\.)?header\.")
_LABELLED = re.compile(
    r"([A-Za-z_][\w ./()\[\]%°‰-]{0,60}?)\s*[:=]\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
    r"(?![\d.:])[ ]?([^\W\d][\w/]*|[°%‰][\w/]*)?(?![:=\w])[\s,;|]*"
)
"""``pos_deg:12.3``, ``F = 60.1 N``: a name, a number, and perhaps its unit."""
_SHARE = 0.8
"""Least share of the lines that label each value; others are messages of the program."""
_FEWEST = 10
"""Least number of such lines."""
_LOOKED = 4000
"""Bytes in the middle of a file that have a mark for each line."""
_SAMPLED = 200
"""Lines of a long file that are read first."""
_NANOSECONDS = {"s": 10**9, "ms": 10**6, "us": 1000, "ns": 1}
_DEEPEST = 6
"""Nesting of tables in tables that is read; recordings have two or three levels."""


def numbers_of(value: Any) -> Iterator[tuple[str, float]]:
    """Paths (``pose.x``, ``joint1.position``) and numbers of a message, without its header."""
    for name, item in fields_of(value):
        if not isinstance(item, str) and not _HEADER.match(name):
            yield name, item


def stamp_of(value: Any) -> int | None:
    """Stamp of the header of a message, or of the header of a part of it; None without one."""
    header = _field(value, "header")
    for part in () if header is not None else map(str, _keys(value)):
        header = header or _field(_field(value, part), "header")
    stamp = _field(header, "stamp") or _field(value, "timestamp") or _field(value, "stamp")
    if isinstance(stamp, int | float):
        epoch = epoch_unit(np.array([stamp], dtype=np.float64))
        return None if epoch is None else round(stamp * _NANOSECONDS.get(epoch, 0)) or None
    seconds = _field(stamp, "sec")
    parts = [_field(stamp, name) for name in ("nanosec", "nsec")]
    fraction = next((part for part in parts if part is not None), None)
    if not isinstance(seconds, int) or not isinstance(fraction, int):
        return None
    return seconds * 1_000_000_000 + fraction


def _keys(value: Any) -> Sequence[Any]:
    if isinstance(value, Mapping):
        return list(value)
    return [key.lstrip("_") for key in getattr(value, "__slots__", ())]


def _field(value: Any, name: str) -> Any:
    if isinstance(value, Mapping):
        return value.get(name)
    return getattr(value, name, None) if hasattr(value, "__slots__") else None


def fields_of(value: Any) -> Iterator[tuple[str, float | str]]:
    """Paths and values of the numbers and texts of a message or a record."""
    yield from _leaves("", value, 0)


def _leaves(name: str, value: Any, depth: int) -> Iterator[tuple[str, float | str]]:
    if isinstance(value, bool | int | float):
        yield name or "data", float(value)
    elif isinstance(value, str):
        yield name or "data", value
    elif depth > _DEEPEST:
        return
    elif isinstance(value, Mapping):
        yield from _of_mapping(name, value, depth)
    elif isinstance(value, Sequence) and not isinstance(value, bytes):
        if len(value) <= _LONGEST:
            for index, item in enumerate(value):
                yield from _leaves(f"{name}[{index}]", item, depth + 1)
    elif hasattr(value, "__slots__"):
        slots = {key.lstrip("_"): getattr(value, key) for key in value.__slots__}
        yield from _of_mapping(name, slots, depth)


def _of_mapping(
    name: str, fields: Mapping[Any, Any], depth: int
) -> Iterator[tuple[str, float | str]]:
    joints = fields.get("name")
    is_joints = isinstance(joints, Sequence) and not isinstance(joints, str) and bool(joints)
    for key, item in fields.items():
        if depth <= 1 and key == "name" and is_joints:
            continue
        path = f"{name}.{key}" if name else str(key)
        lists = isinstance(item, Sequence) and not isinstance(item, str | bytes)
        if is_joints and lists and joints is not None and len(item) == len(joints):
            for joint, one in zip(joints, item, strict=True):
                yield from _leaves(f"{joint}.{path}", one, depth + 1)
        else:
            yield from _leaves(path, item, depth + 1)


def read_labelled(path: str, data: bytes) -> ColumnTable | None:
    """Read lines ``t_ms:120,pos_deg:12.3`` or ``t=120 ms, F=60.1 N``; None for another text.

    A line that a message or a lost character interrupts is left out with a note. Raises RunError
    for a binary file.
    """
    middle = data[len(data) // 2 :][:_LOOKED]
    if middle.count(b":") + middle.count(b"=") < middle.count(b"\n"):
        return None
    lines, _ = decode(data, path)
    filled = [number for number, line in enumerate(lines) if line.strip()]
    sample = filled[:: 1 + len(filled) // _SAMPLED]
    if sum(bool(_labelled(lines[number])) for number in sample) < _SHARE * len(sample) / 2:
        return None
    read = {number: _labelled(lines[number]) for number in filled}
    # A line with other names than all others was interrupted.
    counts = Counter(tuple(found) for found in read.values())
    rows = {number: found for number, found in read.items() if found and counts[tuple(found)] > 1}
    if len(rows) < max(_FEWEST, _SHARE * len(filled)):
        return None
    notes = []
    is_ended = data[-1:] in b"\r\n" or data[-2:] in (b"\n\0", b"\0\n")
    if not is_ended and filled[-1] in rows:
        del rows[filled[-1]]
        notes = ["the last line has no line end and is left out: is the file cut off?"]
    names = dict.fromkeys(name for found in rows.values() for name in found)
    columns = {name: [found.get(name, (np.nan, "")) for found in rows.values()] for name in names}
    arrays, units = {}, {}
    for name, cells in columns.items():
        spelled = {unit for _, unit in cells} - {""}
        own = spelled.pop() if len(spelled) == 1 else ""
        plain, unit = (name, own) if own else name_and_unit(name)
        arrays[plain], units[plain] = np.array([value for value, _ in cells]), unit
    inner = [n for n in filled if n not in rows and min(rows) < n < max(rows)]
    notes += [f"{len(inner)} lines of words between the rows are left out"] if inner else []
    table = table_of_arrays(
        path, "text, a name before each value", arrays, units=units, notes=notes
    )
    places = list(rows)
    return replace(table, line_of=lambda row: places[row] + 1 if row < len(places) else None)


def _labelled(line: str) -> dict[str, tuple[float, str]]:
    """Values and units by their names; empty for a line that has anything else, or one value."""
    found: dict[str, tuple[float, str]] = {}
    place, text = 0, line.strip()
    while place < len(text):
        match = _LABELLED.match(text, place)
        if match is None or match[1] in found or (match[3] and read_unit(match[3]) is None):
            return {}
        found[match[1]] = (float(match[2]), match[3] or "")
        place = match.end()
    return found if len(found) > 1 else {}

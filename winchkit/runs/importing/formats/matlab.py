"""Readers of MAT files (version 5, and 7.3 by extra ``hdf5``) and of HDF5 files.

Structures are flattened with dots, arrays of them with indices, and signals of Simulink and dSPACE
have their names. Objects of MATLAB classes (table, timetable, timeseries, string)
are opaque in a MAT file: they are left out with a note.
"""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError
from winchkit.extras import library
from winchkit.runs.importing.formats.variables import table_of_arrays
from winchkit.runs.importing.table import ColumnTable, readable, refuse_size

_DEEPEST = 8
"""Nesting of structures that is read; those of Simulink have up to five levels."""
_MOST = 100_000
"""Elements of cells and structures of a file of version 7.3; recordings have a few for each signal.
"""
_HEADER, _COMPRESSED = 128, 15
"""Bytes before the first variable of a MAT file of version 5; type of a compressed variable."""
_NAMES, _VALUES = ("label", "name", "blockname"), ("values", "data")
"""Fields of a structure that is a signal."""
_CLASSES = "save its arrays, e.g. t = seconds(T.Time); x = T.x; save('file.mat', 't', 'x')"


def read_mat(path: str, data: bytes) -> ColumnTable:
    """Read a MAT file of version 4 to 7; raises RunError for an invalid file."""
    from scipy.io import loadmat, whosmat

    stream: Any = io.BytesIO(data)
    with readable(path, "MAT file"):
        try:
            size = 8 * sum(int(np.prod(shape)) for _, shape, _ in whosmat(stream))
        except TypeError:
            # An object of a class has no shape.
            size = sum(_sizes(data))
        refuse_size(path, size, "arrays")
        with warnings.catch_warnings():
            # All objects of classes have the same name.
            warnings.simplefilter("ignore")
            stream.seek(0)
            found = loadmat(stream, simplify_cells=True)
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    notes = []
    for name, value in found.items():
        if str(name).startswith("__"):
            continue
        if "MatlabOpaque" in str(type(value)):
            # scipy before 1.18 has the name in the object.
            own = "s0" in value.dtype.names
            kind = _first(value, "s2" if own else "_Class")
            notes.append(_object_note(_first(value, "s0") if own else str(name), kind))
            continue
        for path_of, array, unit in _flat(name, value, 0):
            arrays[path_of], units[path_of] = array, unit
    _refuse_objects(path, arrays, notes)
    return table_of_arrays(path, "MAT", arrays, units=units, notes=notes)


def _sizes(data: bytes) -> Iterator[int]:
    """Unpacked sizes of the variables of a MAT file of version 5, bytes."""
    order = ">" if data[126:128] == b"MI" else "<"
    start = _HEADER
    while start + 8 <= len(data):
        kind, length = struct.unpack_from(f"{order}II", data, start)
        inner = data[start : start + 8]
        if kind == _COMPRESSED:
            inner = zlib.decompressobj().decompress(data[start + 8 : start + 8 + length], 8)
        yield int(struct.unpack_from(f"{order}II", inner)[1]) if len(inner) == 8 else 0
        start += 8 + length


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _first(value: Any, key: str) -> str:
    """Name or class of an object."""
    return _text(np.ravel(value[key])[0])


def _object_note(name: str, kind: str) -> str:
    return f"'{name}' is an object of the MATLAB class {kind} and left out: {_CLASSES}"


def _refuse_objects(path: str, arrays: dict[str, Any], notes: list[str]) -> None:
    """Raise RunError for a file of objects alone, with what to do."""
    if notes and not arrays:
        raise RunError([Fault(note, path) for note in notes])


def _flat(name: str, value: Any, depth: int) -> Iterator[tuple[str, Any, str]]:
    """Arrays of a variable by their path, with the unit where a field beside them has it.

    A structure with the name and the values of a signal (Simulink's scopes, dSPACE) has that name.
    """
    if depth >= _DEEPEST:
        return
    if isinstance(value, dict):
        fields = {str(key).casefold(): item for key, item in value.items()}
        named = next((fields[key] for key in _NAMES if isinstance(fields.get(key), str)), "")
        is_signal = bool(named.strip()) and any(np.size(fields.get(key, ())) > 1 for key in _VALUES)
        for key, item in value.items():
            kind = str(key).casefold()
            if is_signal and kind in _VALUES:
                yield f"{name}.{named.strip()}", item, str(fields.get("unit") or "")
            elif not (is_signal and kind in (*_NAMES, "unit")):
                yield from _flat(f"{name}.{key}", item, depth + 1)
    elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        for index, item in enumerate(value if isinstance(value, list) else np.ravel(value)):
            yield from _flat(f"{name}[{index}]", item, depth + 1)
    elif value is not None:
        yield name, value, ""


def read_hdf5(path: str, data: bytes) -> ColumnTable:
    """Read the datasets of an HDF5 file, or a MAT file of version 7.3, not through links to others.

    Raises UsageError without h5py; RunError for an invalid file.
    """
    h5py = library("h5py", f"{path}: HDF5 or MAT 7.3")
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    notes: list[str] = []
    with readable(path, "HDF5 file"), h5py.File(io.BytesIO(data), "r") as source:
        sets: dict[str, Any] = {}

        def visit(name: str, item: Any) -> None:
            is_set = isinstance(item, h5py.Dataset)
            if is_set and not name.startswith("#") and not (item.external or item.is_virtual):
                sets[name.replace("/", ".")] = item

        source.visititems(visit)
        refuse_size(path, 8 * sum(int(item.size or 0) for item in sets.values()), "arrays")
        for name, item in sets.items():
            if "MATLAB_object_decode" in item.attrs:
                notes.append(_object_note(name, _text(item.attrs.get("MATLAB_class", b""))))
            elif item.dtype.kind in "fiub" or item.dtype.names:
                unit = _text(item.attrs.get("units", item.attrs.get("unit", "")))
                arrays[name], units[name] = item[()], unit
        if any("MATLAB_class" in item.attrs for item in _own(source).values()):
            left = [_MOST]
            values = {
                name: _of_matlab(item, left, 0)
                for name, item in _own(source).items()
                if not name.startswith("#") and "MATLAB_object_decode" not in item.attrs
            }
            flat = [one for name, value in values.items() for one in _flat(name, value, 0)]
            arrays = {name: value for name, value, _ in flat}
            units = {name: unit for name, _, unit in flat}
    _refuse_objects(path, arrays, notes)
    return table_of_arrays(path, "HDF5", arrays, units=units, notes=notes)


def _own(group: Any) -> dict[str, Any]:
    """Members of a group that are in the file itself."""
    h5py = library("h5py", "HDF5")
    names = [n for n in group if isinstance(group.get(n, getlink=True), h5py.HardLink)]
    members = {name: group[name] for name in names}
    return {
        name: item
        for name, item in members.items()
        if not (isinstance(item, h5py.Dataset) and (item.external or item.is_virtual))
    }


def _of_matlab(item: Any, left: list[int], depth: int) -> Any:
    """Value of a variable of MAT 7.3: structures as mappings, arrays of them and cells as lists.

    ``left``: elements that may still be read, since references may repeat each other without end.
    """
    left[0] -= 1
    if item.attrs.get("MATLAB_empty", 0) or depth > _DEEPEST or left[0] < 0:
        # The numbers of an empty array are its shape.
        return None
    if hasattr(item, "items"):
        members = _own(item)
        fields = {name: _of_matlab(part, left, depth + 1) for name, part in members.items()}
        is_array = fields and all(
            isinstance(fields[name], list) and "MATLAB_class" not in part.attrs
            for name, part in members.items()
        )
        rows = zip(*fields.values(), strict=False)
        return [dict(zip(fields, row, strict=True)) for row in rows] if is_array else fields
    if "ref" in (item.dtype.metadata or {}):
        references = np.ravel(item[()], order="F")
        return [_of_matlab(item.file[one], left, depth + 1) for one in references if one]
    if item.dtype.kind not in "fiub" and not item.dtype.names:
        return None
    if _text(item.attrs.get("MATLAB_class", b"")) == "char":
        return "".join(map(chr, np.ravel(item[()])))
    return item[()]

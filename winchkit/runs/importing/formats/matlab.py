"""Readers of MAT files (version 5, and 7.3 by extra ``hdf5``) and of HDF5 files.

Structures are flattened with dots. Objects of MATLAB classes (timetable, timeseries) are opaque in
a MAT file: save them as arrays, e.g. ``t = seconds(T.Time); x = T.x; save f.mat t x``.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError, UsageError
from winchkit.runs.importing.formats.variables import table_of_arrays
from winchkit.runs.importing.table import Table, refuse_size

__all__ = ["read_hdf5", "read_mat"]

_DEEPEST = 8


def read_mat(path: str, data: bytes) -> Table:
    """Read a MAT file of version 4 to 7.

    Parameters
    ----------
    path : str
        File, for messages.
    data : bytes
        Its content.

    Returns
    -------
    Table
        Vectors and columns of matrices; scalars are constants.

    Raises
    ------
    RunError
        For an invalid file.
    """
    from scipy.io import loadmat, whosmat

    try:
        stream: Any = io.BytesIO(data)
        sizes = [int(np.prod(shape)) for _, shape, _ in whosmat(stream)]
        refuse_size(path, 8 * sum(sizes), "arrays")
        found = loadmat(stream, simplify_cells=True)
    except RunError:
        raise
    except Exception as error:  # noqa: BLE001 - scipy raises many kinds for damaged files
        raise RunError(Fault(f"is not a readable MAT file: {error}", path)) from None
    arrays: dict[str, Any] = {}
    notes = []
    for name, value in found.items():
        if name.startswith("__"):
            continue
        if type(value).__name__ == "MatlabOpaque" or "MatlabOpaque" in str(type(value)):
            notes.append(f"'{name}' is an object of a MATLAB class and left out; save its arrays")
            continue
        arrays.update(_flat(name, value, 0))
    return table_of_arrays(path, "MAT", arrays, notes=notes)


def _flat(name: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and depth < _DEEPEST:
        for key, item in value.items():
            yield from _flat(f"{name}.{key}", item, depth + 1)
    elif not isinstance(value, dict | list):
        yield name, value


def read_hdf5(path: str, data: bytes) -> Table:
    """Read an HDF5 file, or a MAT file of version 7.3.

    Parameters
    ----------
    path : str
        File, for messages.
    data : bytes
        Its content.

    Returns
    -------
    Table
        Every dataset of numbers by its path; attributes ``unit`` or ``units`` are units. Links to
        other files are not followed.

    Raises
    ------
    UsageError
        Without h5py.
    RunError
        For an invalid file.
    """
    try:
        import h5py
    except ImportError:
        raise UsageError(
            f"{path}: HDF5 and MAT 7.3 need h5py; install it with pip install 'winchkit[hdf5]'"
        ) from None
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    try:
        with h5py.File(io.BytesIO(data), "r") as source:
            sets: dict[str, Any] = {}

            def visit(name: str, item: Any) -> None:
                is_internal = name.startswith("#")
                is_elsewhere = isinstance(item, h5py.Dataset) and (item.external or item.is_virtual)
                if isinstance(item, h5py.Dataset) and not is_internal and not is_elsewhere:
                    sets[name.replace("/", ".")] = item

            source.visititems(visit)
            refuse_size(path, 8 * sum(int(item.size or 0) for item in sets.values()), "arrays")
            for name, item in sets.items():
                kind = item.attrs.get("MATLAB_class", b"")
                if item.dtype.kind not in "fiub" and not item.dtype.names:
                    continue
                if kind in (b"char", b"cell", "char", "cell") or item.dtype.hasobject:
                    continue
                arrays[name] = item[()]
                unit = item.attrs.get("units", item.attrs.get("unit", ""))
                units[name] = unit.decode() if isinstance(unit, bytes) else str(unit)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, UnicodeDecodeError) as error:
        if isinstance(error, RunError):
            raise
        raise RunError(Fault(f"is not a readable HDF5 file: {error}", path)) from None
    return table_of_arrays(path, "HDF5", arrays, units=units)

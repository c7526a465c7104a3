"""Table of named arrays, as MAT, HDF5, NPZ and Parquet files have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError
from winchkit.runs.importing.names import name_and_unit
from winchkit.runs.importing.table import ColumnTable, FileColumn, named_apart
from winchkit.runs.importing.units.spelling import read_unit

_WIDEST = 200
"""Most columns of one matrix; a larger one is an image or a table of another kind."""


def table_of_arrays(
    path: str,
    layout: str,
    arrays: Mapping[str, Any],
    *,
    units: Mapping[str, str] | None = None,
    metadata: Mapping[str, str] | None = None,
    notes: Sequence[str] = (),
) -> ColumnTable:
    """Table of arrays: vectors and columns of matrices, scalars as constants, texts as metadata.

    The longer side of a matrix is time. Raises RunError without any array of numbers.
    """
    columns: list[FileColumn] = []
    constants: dict[str, float] = {}
    texts = dict(metadata or {})
    left = list(notes)
    for name, value in arrays.items():
        unit = (units or {}).get(name, "")
        array = np.squeeze(np.asarray(value))
        if array.dtype.names:
            columns += [column_of(f"{name}.{k}", array[k], unit) for k in array.dtype.names]
        elif array.dtype.kind in "USO":
            if array.ndim == 0:
                texts[name] = str(array)
            elif array.ndim == 1 and array.dtype.kind in "US" and len(array) > 1:
                cells = [str(item) for item in array]
                columns.append(FileColumn(name, np.full(len(cells), np.nan), unit, texts=cells))
        elif array.dtype.kind not in "fiubmM":
            left.append(f"variable '{name}' is of type {array.dtype} and left out")
        elif array.ndim == 0:
            constants[name] = float(array)
        elif array.ndim == 1 and len(array):
            columns.append(column_of(name, array, unit))
        elif array.ndim == 2 and min(array.shape) <= _WIDEST:
            long = array if array.shape[0] >= array.shape[1] else array.T
            # The unit is that of the matrix: behind an index it is none.
            plain, own = name_and_unit(name, unit)
            plain, own = (plain, own) if read_unit(own) else (name, unit)
            columns += [column_of(f"{plain}[{k}]", long[:, k], own) for k in range(long.shape[1])]
        elif array.size:
            left.append(f"variable '{name}' of shape {array.shape} is left out")
    lengths = sorted({len(item) for item in columns})
    if not lengths or lengths[-1] < 2:
        raise RunError(Fault("has no variables with more than one number", path))
    if len(lengths) > 1:
        columns = [replace(item, group=f"{len(item)} samples") for item in columns]
    return ColumnTable(
        path, layout, named_apart(columns), metadata=texts, constants=constants, notes=tuple(left)
    )


def column_of(name: str, array: Any, unit: str) -> FileColumn:
    """Column of a vector (n,) of numbers, or of dates and durations in ns."""
    if array.dtype.kind in "mM":
        missing = np.isnat(array)
        whole = array.astype(f"{array.dtype.kind}8[ns]").astype(np.int64).astype(np.float64)
        return FileColumn(name, np.where(missing, np.nan, whole), "ns")
    plain, own = name_and_unit(name, unit)
    if own and read_unit(own) is not None:
        name, unit = plain, own
    return FileColumn(name, array.astype(np.float64), unit)

"""Readers of NPY and NPZ files (without pickled objects) and of Parquet files."""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np

from winchkit.errors import Fault, RunError
from winchkit.extras import library
from winchkit.runs.importing.formats.variables import table_of_arrays
from winchkit.runs.importing.table import ColumnTable, readable, refuse_size

_OBJECTS = (
    "has Python objects, which may hold code; load it in Python where you trust it, and write its "
    "arrays by numpy.savez"
)


def read_numpy(path: str, data: bytes) -> ColumnTable:
    """Read NPY or NPZ; raises RunError, also for arrays of Python objects, which may hold code."""
    try:
        if data.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(data)) as packed:
                refuse_size(path, sum(item.file_size for item in packed.infolist()), "arrays")
        loaded = np.load(io.BytesIO(data), allow_pickle=False)
        arrays = dict(loaded) if hasattr(loaded, "files") else None
    except RunError:
        raise
    except (ValueError, OSError, EOFError, zipfile.BadZipFile, KeyError, MemoryError) as error:
        reason = _OBJECTS if "pickle" in str(error) else error
        raise RunError(Fault(f"is not a readable NumPy file: {reason}", path)) from None
    if arrays is None:
        names = loaded.dtype.names
        arrays = {name: loaded[name] for name in names} if names else {"array": loaded}
    return table_of_arrays(path, "NPZ" if data.startswith(b"PK") else "NPY", arrays)


def read_parquet(path: str, data: bytes) -> ColumnTable:
    """Read Parquet; raises UsageError without pyarrow, RunError for an invalid file."""
    pa = library("pyarrow", f"{path}: Parquet")
    from pyarrow import parquet

    with readable(path, "Parquet file"):
        source = parquet.ParquetFile(io.BytesIO(data))
        shape = source.metadata.num_rows * source.metadata.num_columns
        refuse_size(path, 8 * shape, "columns")
        table = source.read()
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    for field, column in zip(table.schema, table.columns, strict=True):
        own = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        is_number = pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
        is_truth = pa.types.is_boolean(field.type)
        is_text = pa.types.is_temporal(field.type) or pa.types.is_string(field.type)
        if is_number or is_truth or is_text:
            arrays[field.name] = (column.cast(pa.int8()) if is_truth else column).to_numpy()
            units[field.name] = own
    plain_metadata = {
        key.decode("utf-8", "replace"): value.decode("utf-8", "replace")
        for key, value in (table.schema.metadata or {}).items()
        if key not in (b"pandas", b"ARROW:schema")
    }
    return table_of_arrays(path, "Parquet", arrays, units=units, metadata=plain_metadata)

"""Writes a run as Parquet, for pandas, polars and DuckDB; needs the extra ``parquet``."""

from __future__ import annotations

from pathlib import Path

from winchkit.errors import Fault, FileError, UsageError
from winchkit.runs.run import Run

__all__ = ["write_parquet"]


def write_parquet(run: Run, path: str | Path) -> None:
    """One column per channel, null for a missing value, the unit in the column's metadata.

    Raises UsageError without pyarrow, FileError where the file cannot be written.
    """
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise UsageError(
            f"{path}: Parquet needs pyarrow; install it with pip install 'winchkit[parquet]'"
        ) from None
    units = {"time": "s", **{name: item.unit for name, item in run.channels.items()}}
    values = {"time": run.time, **{name: item.values for name, item in run.channels.items()}}
    schema = pa.schema(
        [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit in units.items()],
        metadata=dict(run.metadata),
    )
    # From pandas, where NaN is how a missing value is written.
    columns = [pa.array(item, from_pandas=True) for item in values.values()]
    try:
        with Path(path).open("wb") as stream:
            parquet.write_table(pa.table(columns, schema=schema), stream, compression="zstd")
    except OSError as error:
        raise FileError(Fault(f"cannot be written: {error.strerror}", str(path))) from None

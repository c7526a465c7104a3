"""Results as tables of other programs: pandas, and Arrow for Polars, DuckDB and others.

Numbers are in SI; units are the Arrow metadata ``unit`` of a column and ``attrs["units"]`` of a
pandas table. NaN is null in Arrow. Both packages are optional and imported where they are used.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from winchkit.errors import UsageError
from winchkit.extras import library

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


@dataclass(frozen=True)
class Columns:
    """Columns of equal length with their units and metadata."""

    values: Mapping[str, Any]
    """Arrays or lists of numbers in SI, or of texts, by name."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Unit of the columns that have one."""
    metadata: Mapping[str, Any] = field(default_factory=dict)
    """Of the whole table, plain JSON."""
    index: tuple[str, ...] = ()
    """Columns that identify a row: the index of a pandas table, the dimensions in xarray."""


class Tabular(ABC):
    """A result that is a table, for pandas and for every reader of Arrow."""

    @abstractmethod
    def _columns(self) -> Columns:
        """Columns of the table."""

    def to_pandas(self) -> pd.DataFrame:
        """Return a pandas table in SI; ``to_xarray()`` of it has named dimensions.

        Returns
        -------
        pandas.DataFrame
            Units are in ``attrs["units"]``, metadata in ``attrs["metadata"]``.

        Raises
        ------
        UsageError
            Without pandas (``pip install 'winchkit[pandas]'``).
        """
        columns = self._columns()
        frame: pd.DataFrame = library("pandas", "pandas").DataFrame(dict(columns.values))
        if columns.index:
            frame = frame.set_index(list(columns.index))
        frame.attrs = {"units": dict(columns.units), "metadata": dict(columns.metadata)}
        return frame

    def to_arrow(self) -> pa.Table:
        """Return an Arrow table in SI.

        Returns
        -------
        pyarrow.Table
            Units are the metadata ``unit`` of the columns; NaN is null.

        Raises
        ------
        UsageError
            Without pyarrow (``pip install 'winchkit[parquet]'``).
        """
        pa, columns = library("pyarrow", "Arrow"), self._columns()
        # As from pandas, where NaN is a missing value.
        arrays = {name: pa.array(item, from_pandas=True) for name, item in columns.values.items()}
        fields = [
            pa.field(name, array.type, metadata={"unit": columns.units[name]})
            if name in columns.units
            else pa.field(name, array.type)
            for name, array in arrays.items()
        ]
        texts = {
            key: value if isinstance(value, str) else json.dumps(value)
            for key, value in columns.metadata.items()
        }
        return pa.table(list(arrays.values()), schema=pa.schema(fields, metadata=texts))

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """Export through the Arrow C stream interface, which Polars, DuckDB and pandas read."""
        return self.to_arrow().__arrow_c_stream__(requested_schema)


def arrow_of(table: Any) -> pa.Table:
    """Arrow table of pandas, Polars, pyarrow or any Arrow C stream; UsageError for others."""
    pa = library("pyarrow", "Arrow")
    if hasattr(table, "reset_index") and hasattr(table, "attrs"):
        units = table.attrs.get("units", {})
        metadata = {str(k): str(v) for k, v in table.attrs.get("metadata", {}).items()}
        named = [name for name in table.index.names if name is not None]
        try:
            found = pa.Table.from_pandas(table.reset_index(named), preserve_index=False)
        except (pa.ArrowException, ValueError, TypeError, NotImplementedError) as error:
            reason = "; ".join(map(str, reversed(error.args)))
            raise UsageError(f"the table is not one of numbers: {reason}") from None
        fields = [
            f.with_metadata({"unit": units[f.name]}) if f.name in units else f for f in found.schema
        ]
        return found.cast(pa.schema(fields, metadata=metadata))
    if hasattr(table, "__arrow_c_stream__"):
        return pa.table(table)
    kind = type(table).__name__
    raise UsageError(
        f"{kind} is no table: pass one of pandas, Polars or pyarrow, or any object with "
        "__arrow_c_stream__; of xarray pass dataset.to_dataframe()"
    )

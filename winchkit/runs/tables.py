"""Runs from tables in memory: pandas, Polars, pyarrow, or any other Arrow stream."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError, suggest
from winchkit.runs.assemble import RawColumns, assemble
from winchkit.runs.columns import column_dimension, header_of
from winchkit.runs.run import Run
from winchkit.tabular import arrow_of

_NAME = "name"


def run_of(
    table: Any,
    *,
    units: Mapping[str, str] | None = None,
    metadata: Mapping[str, str] | None = None,
    name: str = "",
) -> Run:
    """Make a run from a table in memory.

    Parameters
    ----------
    table : table of pandas, Polars or pyarrow, or any object with an Arrow C stream
        A column per channel, named ``time``, ``motor_angle``, ``tension`` … as in a file; of
        xarray, ``dataset.to_dataframe()``. Null is a missing value.
    units : mapping of str to str, optional
        Unit by column, for columns that do not bring their own: as Arrow metadata ``unit``, in
        ``attrs["units"]`` of pandas, or in the name, ``tension [N]``. Polars and xarray keep
        neither: ``run_of(frame, units=run.units, metadata=run.metadata)``.
    metadata : mapping of str to str, optional
        Such as ``{"load_mass": "10 kg"}``, beside that of the table.
    name : str, optional
        Name of the run; by default that of the table, else ``table``.

    Returns
    -------
    Run
        In SI: a run that was a table before (``run.to_pandas()``, ``run.to_arrow()``) is the same.

    Raises
    ------
    RunError
        With every fault, as :func:`winchkit.read_run`: a missing column, an unknown unit, times
        that are out of order.
    UsageError
        For an object that is no table, a unit for a column that is not there, a channel that has no
        numbers, or without pyarrow.
    """
    import pyarrow as pa

    found = arrow_of(table)
    given = dict(units or {})
    header = []
    for field in found.schema:
        own, unit = header_of(field.name) or (field.name, "")
        unit = given.pop(own, given.pop(field.name, "")) or unit
        header.append((own, unit or _text((field.metadata or {}).get(b"unit", b""))))
    if given:
        known = [own for own, _ in header]
        wrong = next(iter(given))
        raise UsageError(
            f"units: the table has no column '{wrong}'; it has {', '.join(known)}"
            + suggest(wrong, known)
        )
    texts = {_text(key): _text(value) for key, value in (found.schema.metadata or {}).items()}
    texts = {key: value for key, value in texts.items() if key not in _OF_PROGRAMS}
    named = name or texts.pop(_NAME, "") or "table"
    texts.pop(_NAME, None)
    named_columns = zip(header, found.columns, strict=True)
    columns = [_numbers(own, column) for (own, _), column in named_columns]
    for index, (own, _) in enumerate(header):
        kind = found.schema.field(index).type
        if own == "time" and (pa.types.is_timestamp(kind) or pa.types.is_duration(kind)):
            header[index] = own, "s"
            if pa.types.is_timestamp(kind) and (start := _first_moment(found.columns[index])):
                texts.setdefault("start_time", start)
    recording = RawColumns(named, header, columns, metadata={**texts, **dict(metadata or {})})
    return replace(assemble(recording), name=named, path="")


_OF_PROGRAMS = frozenset({"pandas", "ARROW:schema"})
"""Metadata that other programs write for themselves."""


def _numbers(name: str, column: Any) -> Array | None:
    """Values of a column, moments in s from the first; None for text that is no channel."""
    import pyarrow as pa

    if pa.types.is_dictionary(column.type):
        column = column.cast(column.type.value_type)
    kind = column.type
    if pa.types.is_duration(kind) or (pa.types.is_timestamp(kind) and name == "time"):
        moments = column.to_numpy()
        known = moments[~np.isnat(moments)]
        origin = known[0] if pa.types.is_timestamp(kind) and len(known) else moments.dtype.type(0)
        return np.asarray((moments - origin) / np.timedelta64(1, "s"), dtype=np.float64)
    is_channel = name == "time" or column_dimension(name) is not None
    is_number = (
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_decimal(kind)
        or (pa.types.is_boolean(kind) and not is_channel)
    )
    if is_number:
        # Integers beyond 2^53 are rounded, to 16 digits.
        return np.array(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
    if is_channel:
        raise UsageError(
            f"column '{name}' is of {kind} and has no numbers; convert it, or leave it out"
        )
    return None


def _first_moment(column: Any) -> str:
    """First moment of a column, ISO 8601 in UTC; empty without one."""
    moments = column.to_numpy()
    known = moments[~np.isnat(moments)]
    return f"{known[0].astype('datetime64[us]')}+00:00" if len(known) else ""


def _text(value: bytes) -> str:
    return value.decode("utf-8", errors="replace")

"""Columns of a library's tables: runs, diagnoses and estimates, with types, units and meanings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from winchkit.errors import UsageError

if TYPE_CHECKING:
    import pyarrow as pa

Kind = Literal["text", "texts", "number", "numbers", "integer", "flag", "time"]


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    kind: Kind
    meaning: str
    unit: str = ""


RUNS: tuple[Column, ...] = (
    Column("path", "text", "file below the library, with `/`; of a log in parts its common name"),
    Column("winch", "text", "name of the winch in the library"),
    Column("prefix", "text", "prefix of its columns in the file; empty without"),
    Column("session", "text", "metadata `session`, else the UTC date of `time`"),
    Column("time", "time", "UTC of the first sample"),
    Column(
        "time_source", "text", "`metadata`, `clock` (of the log), `path` (a date), `file` (change)"
    ),
    Column("duration", "number", "from the first sample to the last", "s"),
    Column("samples", "integer", "rows of the run"),
    Column("programme", "text", "metadata `programme`; null without"),
    Column("load_mass", "number", "metadata `load_mass`; null without", "kg"),
    Column("temperature", "number", "mean of the channel; null without", "degC"),
    Column("profile", "text", "hash of the profile given to `library index`; null without"),
    Column("profile_name", "text", "its name, else metadata `profile`; null without"),
    Column("channels", "texts", "channels of the winch, without prefix"),
    Column("counters", "text", "last counters of the instruments of a log, JSON; null without"),
    Column("sanity", "texts", "codes of the findings on the run (diagnosis.md)"),
    Column("complete", "flag", "false for a log without its end"),
    Column("fault", "text", "why the file is no run; null for a run"),
    Column("imported_from", "text", "file of another program that the run was made of; null else"),
    Column(
        "mapping",
        "text",
        "mapping by which the file is read, below the library; null for a file of winchkit",
    ),
    Column("size", "integer", "of the file, or of all parts", "B"),
    Column("mtime", "integer", "date of change since 1970, of the newest part", "ns"),
    Column("hash", "text", "SHA-256 of the content and of the mapping; equal for copies"),
)
"""One row per winch of a run; a file that is no run has one row with its `fault`."""

DIAGNOSES: tuple[Column, ...] = (
    Column("key", "text", "hash of winch, session, runs, profile, effects, options and version"),
    Column("winch", "text", "name of the winch in the library"),
    Column("session", "text", "session of the runs"),
    Column("time", "time", "UTC of the first run"),
    Column("runs", "texts", "paths of the runs below the library"),
    Column(
        "verdict",
        "text",
        "`adequate`, `explained`, `partly`, `unknown`, `undecided`; null after a failure",
    ),
    Column("failure", "text", "why there is no diagnosis; null where there is one"),
    Column("effects", "texts", "effect of every certain step"),
    Column("places", "texts", "place of every other step, `PART: OUTPUTS over VARIABLE`"),
    Column("profile", "text", "hash of the profile"),
    Column("profile_name", "text", "its name"),
    Column("version", "text", "version of winchkit"),
    Column(
        "result",
        "text",
        "JSON of `winchkit diagnose --json`, shortened to 20 kB; null after a failure",
    ),
)
"""One row per diagnosis: runs of one winch and one session."""

ESTIMATES: tuple[Column, ...] = (
    Column("key", "text", "that of the diagnosis, or of another fit"),
    Column("winch", "text", "name of the winch in the library"),
    Column("session", "text", "session of the runs"),
    Column("time", "time", "UTC of the first run"),
    Column("runs", "texts", "paths of the runs below the library"),
    Column(
        "kind",
        "text",
        "`model` (the reported model), `alternative` (another member of the equivalence set), "
        "`combination` (what the data determine of it), `fixed` (fit of a given set of effects)",
    ),
    Column("effect", "text", "id of the effect; of a combination the first of its set"),
    Column("set", "texts", "effects that these runs cannot distinguish from it, itself included"),
    Column("certain", "flag", "whether the step is certain of it; null of a `fixed` fit"),
    Column("place", "text", "place of the step, `PART: OUTPUTS over VARIABLE`; null without"),
    Column("parameter", "text", "its parameter, or the name of the combination"),
    Column("value", "number", "estimate", "SI"),
    Column("std", "number", "its standard deviation; null where the data leave the value open"),
    Column("low", "number", "95 % confidence interval, lower end; null where not computed"),
    Column("high", "number", "95 % confidence interval, upper end"),
    Column("unit", "text", "SI unit"),
    Column("index", "integer", "number of the row among those of its `key` and `kind`, from 0"),
    Column(
        "covariance",
        "numbers",
        "with the rows of the same `key` and `kind` in the order of `index`; null of "
        "`alternative` and `combination`",
    ),
    Column("verdict", "text", "that of the diagnosis; null of a `fixed` fit"),
    Column("profile", "text", "hash of the profile beside which it was fitted"),
)
"""One row per estimated parameter."""

TABLES: Mapping[str, tuple[Column, ...]] = {
    "runs": RUNS,
    "diagnoses": DIAGNOSES,
    "estimates": ESTIMATES,
}


def arrow_schema(table: str) -> pa.Schema:
    """Arrow schema of a table of the library; units are the metadata ``unit`` of a column.

    Raises UsageError for an unknown table, or without pyarrow.
    """
    try:
        import pyarrow as pa
    except ImportError:
        raise UsageError(
            "a library needs pyarrow; install it with pip install 'winchkit[library]'"
        ) from None
    kinds = {
        "text": pa.string(),
        "texts": pa.list_(pa.string()),
        "number": pa.float64(),
        "numbers": pa.list_(pa.float64()),
        "integer": pa.int64(),
        "flag": pa.bool_(),
        "time": pa.timestamp("us", tz="UTC"),
    }
    return pa.schema(
        [
            pa.field(c.name, kinds[c.kind], metadata={"unit": c.unit} if c.unit else None)
            for c in columns_of(table)
        ]
    )


def columns_of(table: str) -> tuple[Column, ...]:
    """Columns of a table; raises UsageError for an unknown one."""
    if table not in TABLES:
        raise UsageError(f"no table '{table}' in a library; use one of {', '.join(TABLES)}")
    return TABLES[table]

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
class TableColumn:
    """One column of a table."""

    name: str
    kind: Kind
    meaning: str
    unit: str = ""


RUNS: tuple[TableColumn, ...] = (
    TableColumn(
        "path", "text", "file below the library, with `/`; of a log in parts its common name"
    ),
    TableColumn("winch", "text", "name of the winch in the library"),
    TableColumn("prefix", "text", "prefix of its columns in the file; empty without"),
    TableColumn("session", "text", "metadata `session`, else the UTC date of `time`"),
    TableColumn("time", "time", "UTC of the first sample"),
    TableColumn(
        "time_source", "text", "`metadata`, `clock` (of the log), `path` (a date), `file` (change)"
    ),
    TableColumn("duration", "number", "from the first sample to the last", "s"),
    TableColumn("samples", "integer", "rows of the run"),
    TableColumn("programme", "text", "metadata `programme`; null without"),
    TableColumn("load_mass", "number", "metadata `load_mass`; null without", "kg"),
    TableColumn("temperature", "number", "mean of the channel; null without", "degC"),
    TableColumn("profile", "text", "hash of the profile given to `library index`; null without"),
    TableColumn("profile_name", "text", "its name, else metadata `profile`; null without"),
    TableColumn("channels", "texts", "channels of the winch, without prefix"),
    TableColumn(
        "counters", "text", "last counters of the instruments of a log, JSON; null without"
    ),
    TableColumn("sanity", "texts", "codes of the findings on the run (diagnosis.md)"),
    TableColumn("complete", "flag", "false for a log without its end"),
    TableColumn("fault", "text", "why the file is no run; null for a run"),
    TableColumn(
        "imported_from", "text", "file of another program that the run was made of; null else"
    ),
    TableColumn(
        "mapping",
        "text",
        "mapping by which the file is read, below the library; null for a file of winchkit",
    ),
    TableColumn("size", "integer", "of the file, or of all parts", "B"),
    TableColumn("mtime", "integer", "date of change since 1970, of the newest part", "ns"),
    TableColumn("hash", "text", "SHA-256 of the content and of the mapping; equal for copies"),
)
"""One row per winch of a run; a file that is no run has one row with its `fault`."""

_SESSION = (
    TableColumn("winch", "text", "name of the winch in the library"),
    TableColumn("session", "text", "session of the runs"),
    TableColumn("time", "time", "UTC of the first run"),
    TableColumn("runs", "texts", "paths of the runs below the library"),
)

DIAGNOSES: tuple[TableColumn, ...] = (
    TableColumn(
        "key", "text", "hash of winch, session, runs, profile, effects, options and version"
    ),
    *_SESSION,
    TableColumn(
        "verdict",
        "text",
        "`adequate`, `explained`, `partly`, `unknown`, `undecided`; null after a failure",
    ),
    TableColumn("failure", "text", "why there is no diagnosis; null where there is one"),
    TableColumn("effects", "texts", "effect of every certain step"),
    TableColumn("places", "texts", "place of every other step, `PART: OUTPUTS over VARIABLE`"),
    TableColumn("profile", "text", "hash of the profile"),
    TableColumn("profile_name", "text", "its name"),
    TableColumn("version", "text", "version of winchkit"),
    TableColumn(
        "result",
        "text",
        "JSON of `winchkit diagnose --json`, shortened to 20 kB; null after a failure",
    ),
)
"""One row per diagnosis: runs of one winch and one session."""

ESTIMATES: tuple[TableColumn, ...] = (
    TableColumn("key", "text", "that of the diagnosis, or of another fit"),
    *_SESSION,
    TableColumn(
        "kind",
        "text",
        "`model` (the reported model), `alternative` (another member of the equivalence set), "
        "`combination` (what the data determine of it), `fixed` (fit of a given set of effects)",
    ),
    TableColumn("effect", "text", "id of the effect; of a combination the first of its set"),
    TableColumn(
        "set", "texts", "effects that these runs cannot distinguish from it, itself included"
    ),
    TableColumn("certain", "flag", "whether the step is certain of it; null of a `fixed` fit"),
    TableColumn("place", "text", "place of the step, `PART: OUTPUTS over VARIABLE`; null without"),
    TableColumn("parameter", "text", "its parameter, or the name of the combination"),
    TableColumn("value", "number", "estimate", "SI"),
    TableColumn(
        "std", "number", "its standard deviation; null where the data leave the value open"
    ),
    TableColumn("low", "number", "95 % confidence interval, lower end; null where not computed"),
    TableColumn("high", "number", "95 % confidence interval, upper end"),
    TableColumn("unit", "text", "SI unit"),
    TableColumn(
        "index", "integer", "number of the row among those of its `key` and `kind`, from 0"
    ),
    TableColumn(
        "covariance",
        "numbers",
        "with the rows of the same `key` and `kind` in the order of `index`; null of "
        "`alternative` and `combination`",
    ),
    TableColumn("verdict", "text", "that of the diagnosis; null of a `fixed` fit"),
    TableColumn("profile", "text", "hash of the profile beside which it was fitted"),
)
"""One row per estimated parameter."""

TABLES: Mapping[str, tuple[TableColumn, ...]] = {
    "runs": RUNS,
    "diagnoses": DIAGNOSES,
    "estimates": ESTIMATES,
}


def arrow_schema(table: str) -> pa.Schema:
    """Arrow schema of a table of the library; units are the metadata ``unit`` of a column. Raises
    UsageError for an unknown table, or without pyarrow."""
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


def columns_of(table: str) -> tuple[TableColumn, ...]:
    """Columns of a table; raises UsageError for an unknown one."""
    if table not in TABLES:
        raise UsageError(f"no table '{table}' in a library; use one of {', '.join(TABLES)}")
    return TABLES[table]

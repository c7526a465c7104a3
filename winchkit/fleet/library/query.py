"""Rows of a library by filters, and SQL over its tables (DuckDB)."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from winchkit.errors import UsageError
from winchkit.fleet.library.index import indexed
from winchkit.fleet.library.tables import TABLES, arrow_schema

if TYPE_CHECKING:
    import pyarrow as pa

_LOAD_TOLERANCE = 1e-3
"""Relative difference of loads that count as equal."""


def library_runs(
    folder: str | Path,
    *,
    winch: str | None = None,
    programme: str | None = None,
    load: float | None = None,
    since: date | None = None,
    until: date | None = None,
    verdict: str | None = None,
) -> pa.Table:
    """Runs of a library, in the order of winch, time and path.

    Parameters
    ----------
    folder : str or Path
        Folder of the runs, which was indexed.
    winch, programme : str, optional
        Name in the library, name of the motion programme.
    load : float, optional
        Known mass on the cable, kg.
    since, until : datetime.date, optional
        First and last UTC day of the start.
    verdict : str, optional
        Verdict of the diagnosis of the run's session.

    Returns
    -------
    pyarrow.Table
        Columns of the table ``runs``; docs/formats.md.

    Raises
    ------
    FileError
        For a folder without an index.
    """
    tables = indexed(folder)
    found = tables.read("runs")
    judged: set[str] = set()
    if verdict is not None:
        judged = {path for path, own in verdicts_of(folder).items() if verdict in own}

    def fits(row: dict[str, Any]) -> bool:
        moment: datetime = row["time"]
        return (
            (winch is None or row["winch"] == winch)
            and (programme is None or row["programme"] == programme)
            and (load is None or _is_load(row["load_mass"], load))
            and (since is None or moment.date() >= since)
            and (until is None or moment.date() <= until)
            and (verdict is None or row["path"] in judged)
        )

    kept = [row for row in found.to_pylist() if fits(row)]
    kept.sort(key=lambda row: (row["winch"], row["time"], row["path"]))
    return type(found).from_pylist(kept, schema=arrow_schema("runs"))


def verdicts_of(folder: str | Path) -> dict[str, tuple[str, ...]]:
    """Verdicts of the sessions that a run is of, by its path; runs of none are left out."""
    found: dict[str, tuple[str, ...]] = {}
    for row in indexed(folder).read("diagnoses", ("runs", "verdict")).to_pylist():
        for path in row["runs"] if row["verdict"] else ():
            found[path] = tuple(dict.fromkeys((*found.get(path, ()), row["verdict"])))
    return found


def library_estimates(folder: str | Path) -> pa.Table:
    """Estimates of a library.

    Parameters
    ----------
    folder : str or Path
        Folder of the runs, which was indexed.

    Returns
    -------
    pyarrow.Table
        Columns of the table ``estimates``; docs/formats.md.

    Raises
    ------
    FileError
        For a folder without an index.
    """
    return indexed(folder).read("estimates")


def query_library(folder: str | Path, sql: str) -> pa.Table:
    """Answer of one SELECT over the tables ``runs``, ``diagnoses`` and ``estimates``.

    Parameters
    ----------
    folder : str or Path
        Folder of the runs, which was indexed.
    sql : str
        One statement of DuckDB that reads.

    Returns
    -------
    pyarrow.Table
        The answer.

    Raises
    ------
    FileError
        For a folder without an index.
    UsageError
        For SQL that is wrong, that is more than one statement, or that does more than read; and
        without DuckDB.
    """
    tables = indexed(folder)
    try:
        import duckdb
    except ImportError:
        raise UsageError(
            "SQL needs duckdb; install it with pip install 'winchkit[library]'"
        ) from None
    try:
        statements = duckdb.extract_statements(sql)
    except duckdb.Error as error:
        raise UsageError(f"SQL: {error}") from None
    _require_reading(statements, duckdb.StatementType)
    with duckdb.connect() as database:
        for table in TABLES:
            files = tables.files(table)
            if files:
                quoted = str(files[0].parent.parent.resolve() / "*" / "*.parquet").replace(
                    "'", "''"
                )
                source = f"read_parquet('{quoted}', hive_partitioning = false)"
                database.execute(f"CREATE VIEW {table} AS SELECT * FROM {source}")
            else:
                database.register(table, arrow_schema(table).empty_table())
        place = str(tables.folder.resolve()).replace("'", "''")
        database.execute(
            f"SET allowed_directories = ['{place}']; SET enable_external_access = false; "
            "SET lock_configuration = true"
        )
        try:
            return database.sql(statements[0].query).to_arrow_table()
        except duckdb.Error as error:
            raise UsageError(f"SQL: {error}") from None


def _require_reading(statements: Sequence[Any], kinds: Any) -> None:
    if len(statements) != 1:
        raise UsageError(f"SQL: {len(statements)} statements; give one SELECT")
    if statements[0].type != kinds.SELECT:
        raise UsageError("SQL: a library is only read by it; give a SELECT")


def _is_load(found: float | None, asked: float) -> bool:
    return found is not None and abs(found - asked) <= _LOAD_TOLERANCE * abs(asked)

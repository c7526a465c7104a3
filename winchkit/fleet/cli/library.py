"""``winchkit library``: tables of the runs of a folder, renewed, listed by filters, and by SQL."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator, Mapping, Sequence
from datetime import date, datetime
from typing import Any

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.lazy import CommandPlace, LazyGroup
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import PROFILE, quantity_option
from winchkit.cli.core.output import echo_json, is_json, json_flag, tell
from winchkit.cli.core.terminal import progress_bar

_HERE = "winchkit.fleet.cli.library"
COMMANDS = {
    "index": CommandPlace(_HERE, "Bring the tables to the state of the files.", "index"),
    "list": CommandPlace(_HERE, "List runs by winch, programme, load, date, verdict.", "listed"),
    "query": CommandPlace(_HERE, "Answer a SELECT over the tables (DuckDB).", "query"),
}


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    examples=("winchkit library index .", "winchkit library list . --winch A"),
)
def command() -> None:
    """Tables of the runs of a folder, kept beside them and renewed from them."""


@click.command(
    "index",
    cls=ToolCommand,
    examples=("winchkit library index .", "winchkit library index . -p bench-spiral --json"),
)
@click.argument("folder", metavar="DIR")
@click.option("-p", "--profile", metavar="P", type=PROFILE, help="Profile of the winches.")
@json_flag("Print the answer as JSON.")
def index(folder: str, profile: str | None) -> None:
    """Read the runs below DIR that are new or changed, and remove those that are gone.

    The tables are in DIR/.winchkit-library and can be deleted. Ctrl-C keeps what was read. Files
    that cannot be read are named and read again next time.
    """
    from winchkit.fleet.library.index import index_library

    with progress_bar() as progress:
        report = index_library(folder, profile, progress)
    for path, fault in report.faults.items():
        note(fault if path in fault else f"{path}: {fault}")
    for path in report.removed:
        note(f"{path}: is no longer there; removed with its diagnosis")
    counts = f"{len(report.indexed)} read, {report.unchanged} unchanged, "
    counts += f"{len(report.removed)} removed, {len(report.faults)} with a fault"
    tell(report.to_json(), [counts])
    suggest_next("library", "list", folder)


@click.command(
    "list",
    cls=ToolCommand,
    examples=(
        "winchkit library list . --winch A --since 2026-03-01",
        "winchkit library list . --load '10 kg' --json",
    ),
)
@click.argument("folder", metavar="DIR")
@click.option("--winch", metavar="NAME", help="Winch, as the list names it.")
@click.option("--programme", metavar="NAME", help="Motion programme.")
@quantity_option(
    "--load", of="mass", example="10 kg", help="Known mass on the cable, such as '10 kg'."
)
@click.option("--since", metavar="DATE", help="First UTC day, YYYY-MM-DD.")
@click.option("--until", metavar="DATE", help="Last UTC day, YYYY-MM-DD.")
@click.option(
    "--verdict",
    type=click.Choice(["adequate", "explained", "partly", "unknown", "undecided"]),
    help="Verdict of the session's diagnosis.",
)
@json_flag("Print the answer as JSON.")
def listed(
    *,
    folder: str,
    winch: str | None,
    programme: str | None,
    load: str | None,
    since: str | None,
    until: str | None,
    verdict: str | None,
) -> None:
    """List the runs of an indexed folder, in the order of winch and time."""
    from winchkit.cli.core.quantities import quantity
    from winchkit.fleet.library.query import library_runs, verdicts_of

    rows = library_runs(
        folder,
        winch=winch,
        programme=programme,
        load=None if load is None else quantity(load, "mass"),
        since=_day("--since", since),
        until=_day("--until", until),
        verdict=verdict,
    ).to_pylist()
    judged = verdicts_of(folder)
    rows = [{**row, "verdict": " and ".join(judged.get(row["path"], ())) or None} for row in rows]
    tell({"runs": rows}, _lines(rows))


def _lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    width = max((len(row["winch"]) for row in rows), default=0)
    for row in rows:
        mass = "" if row["load_mass"] is None else f"{row['load_mass']:g} kg"
        facts = (
            row["programme"],
            mass,
            row["verdict"] or "",
            row["fault"],
            "" if row["complete"] else "no end",
        )
        known = "  ".join(fact for fact in facts if fact)
        moment: datetime = row["time"]
        yield f"{row['winch']:<{width}}  {moment:%Y-%m-%d %H:%M}  {row['path']}  {known}"


def _day(option: str, text: str | None) -> date | None:
    if text is None:
        return None
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise click.UsageError(f"{option} {text}: no date; write YYYY-MM-DD") from None


@click.command(
    "query",
    cls=ToolCommand,
    examples=(
        'winchkit library query . "SELECT winch, count(*) AS runs FROM runs GROUP BY winch"',
        'winchkit library query . "SELECT time, value, std FROM estimates" --json',
    ),
)
@click.argument("folder", metavar="DIR")
@click.argument("sql", metavar="SQL")
@json_flag("Print the answer as JSON.")
def query(folder: str, sql: str) -> None:
    """Answer one SELECT over the tables runs, diagnoses and estimates, as CSV or JSON.

    Needs DuckDB (extra library). Nothing is changed, and no other file is read.
    """
    from winchkit.fleet.library.query import query_library

    found = query_library(folder, sql)
    if is_json():
        echo_json({"schema": 1, "columns": found.column_names, "rows": found.to_pylist()})
        return
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(found.column_names)
    for row in found.to_pylist():
        writer.writerow(row.values())

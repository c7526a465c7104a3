"""``winchkit library query``: SQL over the tables of a library."""

from __future__ import annotations

import csv
import sys

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.output import echo_json, is_json, json_flag


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
def command(folder: str, sql: str) -> None:
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

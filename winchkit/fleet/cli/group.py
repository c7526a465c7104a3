"""``winchkit library``: tables of the runs of a folder."""

from __future__ import annotations

import click

from winchkit.cli.core.lazy import CommandPlace, LazyGroup

COMMANDS = {
    "index": CommandPlace(
        "winchkit.fleet.cli.index", "Bring the tables to the state of the files."
    ),
    "list": CommandPlace(
        "winchkit.fleet.cli.list", "List runs by winch, programme, load, date, verdict."
    ),
    "query": CommandPlace("winchkit.fleet.cli.query", "Answer a SELECT over the tables (DuckDB)."),
}


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    examples=(
        "winchkit library index .",
        "winchkit library list . --winch A",
    ),
)
def command() -> None:
    """Tables of the runs of a folder, kept beside them and renewed from them."""

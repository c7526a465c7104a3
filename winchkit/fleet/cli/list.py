"""``winchkit library list``: runs of a library by filters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import date, datetime
from typing import Any

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import quantity_option
from winchkit.cli.core.output import json_flag, tell


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
def command(
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

"""``winchkit log recover``: saves what is whole of a log that was cut off."""

from __future__ import annotations

import click

from winchkit.cli.core.output import echo_json

__all__ = ["command"]


@click.command()
@click.argument("file", metavar="FILE")
@click.option(
    "-o", "--output", metavar="OUT", help="Where to; without it FILE with .recovered in its name."
)
@click.option("--replace", is_flag=True, help="Write over a file of that name.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(*, file: str, output: str | None, replace: bool, as_json: bool) -> None:
    """Save everything whole of FILE (.mcap or .csv), which stays as it is."""
    from winchkit.runs.recover import recover

    found = recover(file, output, replace=replace)
    if as_json:
        echo_json({"schema": 1, "file": file, **vars(found)})
        return
    kind = "messages" if found.output.lower().endswith(".mcap") else "rows"
    click.echo(
        f"{found.output}: {found.kept} {kind} saved, {found.dropped_pieces} damaged pieces and "
        f"{found.dropped_bytes} bytes at the end left out"
        + ("; the file was whole" if found.was_whole else "")
    )

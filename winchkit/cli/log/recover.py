"""``winchkit log recover``: saves the complete samples of a log that was cut off."""

from __future__ import annotations

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import RUN, output_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.standard_input import is_standard_input
from winchkit.errors import UsageError


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit log recover cut.mcap",
        "winchkit log recover cut.mcap -o whole.mcap --json",
    ),
)
@click.argument("file", metavar="FILE", type=RUN)
@output_option("Where to; without it FILE with .recovered in its name.", "OUT")
@click.option("--replace", is_flag=True, help="Write over a file of that name.")
@json_flag("Print the result as JSON.")
def command(*, file: str, output: str | None, replace: bool) -> None:
    """Save everything whole of FILE (.mcap or .csv), which stays as it is.

    Several logs that were joined in FILE are saved to a file each.
    """
    from winchkit.runs.recover import recover

    if output is None and is_standard_input(file):
        raise UsageError("FILE -: the log from standard input is saved to a file with -o")
    found = recover(file, output, replace=replace)
    kind = "messages" if found.output.lower().endswith(".mcap") else "rows"
    logs = (found, *found.further)
    whole = "; the log was whole" if len(logs) > 1 else "; the file was whole"
    lines = (
        f"{one.output}: {one.kept} {kind} saved, {one.dropped_pieces} damaged pieces and "
        f"{one.dropped_bytes} bytes at the end left out" + (whole if one.was_whole else "")
        for one in logs
    )
    tell({"file": file, **vars(found)}, lines)
    suggest_next("log", "info", found.output)

"""``winchkit library index``: the table of runs is brought to the state of the files."""

from __future__ import annotations

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import PROFILE
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import progress_bar


@click.command(
    "index",
    cls=ToolCommand,
    examples=(
        "winchkit library index .",
        "winchkit library index . -p bench-spiral --json",
    ),
)
@click.argument("folder", metavar="DIR")
@click.option("-p", "--profile", metavar="P", type=PROFILE, help="Profile of the winches.")
@json_flag("Print the answer as JSON.")
def command(folder: str, profile: str | None) -> None:
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

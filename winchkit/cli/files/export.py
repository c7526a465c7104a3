"""``winchkit export``: a run from one format to another, or one winch of it."""

from __future__ import annotations

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import output_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import runs_argument


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit export demo-10kg-1.csv -o run.mcap",
        "winchkit export lift.mcap -o lift.csv",
    ),
)
@runs_argument
@output_option("Where to: a .csv, .mcap, .parquet or .mf4 file.", required=True)
@click.option("--winch", metavar="NAME", help="Only this winch, its columns without its name.")
@click.option("--replace", is_flag=True, help="Write over a file of that name.")
@json_flag("Print the summary as JSON.")
def command(runs: tuple[str, ...], output: str, winch: str | None, replace: bool) -> None:
    """Convert RUN to CSV, MCAP, Parquet or MF4, in SI units; several are the parts of one log.

    A line on stderr says how many rows there are, at what rate, and what is missing.
    """
    from winchkit.runs.export import export
    from winchkit.runs.info import summary_of

    with progress_bar() as progress:
        progress(f"converting to {output}", None)
        recording = export(runs, output, winch or "", replace=replace)
    for remark in recording.notes:
        click.echo(f"{recording.path}: {remark} (warning)", err=True)
    summary = summary_of(recording)
    note(f"{output}: {summary.text}")
    if is_json():
        run = runs[0] if len(runs) == 1 else list(runs)
        echo_json({"schema": 1, "run": run, "output": output, "summary": summary})

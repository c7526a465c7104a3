"""``winchkit export``: a run from one format to another, or one winch of it."""

from __future__ import annotations

import click

from winchkit.cli.output import echo_json

__all__ = ["command"]


@click.command()
@click.argument("run", metavar="RUN")
@click.option(
    "-o", "--output", required=True, metavar="FILE", help="Where to: a .csv or .mcap file."
)
@click.option("--winch", metavar="NAME", help="Only this winch, its columns without its name.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def command(run: str, output: str, winch: str | None, as_json: bool) -> None:
    """Convert RUN between CSV and MCAP, in SI units.

    A line on stderr says how many rows there are, at what rate, and what is missing.
    """
    from winchkit.runs import read_run, write_run
    from winchkit.runs.summary import summary_of

    recording = read_run(run).of_winch(winch or "")
    for note in recording.notes:
        click.echo(f"{run}: {note} (warning)", err=True)
    write_run(recording, output)
    summary = summary_of(recording)
    click.echo(f"{output}: {summary.text}", err=True)
    if as_json:
        echo_json({"schema": 1, "run": run, "output": output, "summary": summary})

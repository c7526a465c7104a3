"""``winchkit export``: a run from one format to another, or one winch of it."""

from __future__ import annotations

import click

from winchkit.cli.core.output import echo_json

__all__ = ["command"]


@click.command()
@click.argument("runs", metavar="RUN...", nargs=-1, required=True)
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="FILE",
    help="Where to: a .csv, .mcap, .parquet or .mf4 file.",
)
@click.option("--winch", metavar="NAME", help="Only this winch, its columns without its name.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def command(runs: tuple[str, ...], output: str, winch: str | None, as_json: bool) -> None:
    """Convert RUN to CSV, MCAP, Parquet or MF4, in SI units; several are the parts of one log.

    A line on stderr says how many rows there are, at what rate, and what is missing.
    """
    from winchkit.runs.export import export
    from winchkit.runs.info import summary_of

    recording = export(runs, output, winch or "")
    for note in recording.notes:
        click.echo(f"{recording.path}: {note} (warning)", err=True)
    summary = summary_of(recording)
    click.echo(f"{output}: {summary.text}", err=True)
    if as_json:
        run = runs[0] if len(runs) == 1 else list(runs)
        echo_json({"schema": 1, "run": run, "output": output, "summary": summary})

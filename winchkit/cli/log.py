"""``winchkit log``: records a bench to a file until told to end."""

from __future__ import annotations

import time
from pathlib import Path

import click

from winchkit.cli.output import echo_json

__all__ = ["command"]

_PERIOD = 0.1


@click.command()
@click.option("-b", "--bench", required=True, metavar="FILE", help="Wiring file of the bench.")
@click.option(
    "-o", "--output", required=True, metavar="FILE", help="Where to: a .csv or .mcap file."
)
@click.option("--for", "duration", metavar="TIME", help="End after this time, e.g. 10s or '2 min'.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def command(bench: str, output: str, duration: str | None, as_json: bool) -> None:
    """Log every winch of a bench until Ctrl-C, or for a time.

    A row stands for each reading of the load cell (else of the length instrument). Attaches to
    the process that owns the bench where there is one; logging never moves anything.
    """
    from winchkit.bench.session import at_station
    from winchkit.cli.duration import seconds

    limit = seconds(duration)
    with at_station(bench) as station:
        station.start_log(str(Path(output).absolute()))
        start = time.monotonic()
        try:
            while limit is None or time.monotonic() - start < limit:
                time.sleep(min(_PERIOD, limit or _PERIOD))
                station.log_rows()
        except KeyboardInterrupt:
            click.echo("ending the log", err=True)
        rows = station.end_log()
    if as_json:
        echo_json({"schema": 1, "output": output, "rows": rows})
    else:
        click.echo(f"{output}: {rows} rows")

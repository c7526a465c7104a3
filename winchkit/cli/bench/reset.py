"""``winchkit reset``: clears trips and drive faults; nothing is enabled."""

from __future__ import annotations

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.options import bench_option, dry_run_option
from winchkit.cli.core.output import echo_json


@click.command(
    cls=Command,
    examples=(
        "winchkit reset",
        "winchkit reset -b bench.toml --json",
    ),
)
@bench_option
@dry_run_option
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print the bench's state, and what was cleared, as JSON.",
)
def command(bench: str, *, dry_run: bool, as_json: bool) -> None:
    """Clear latched trips and drive faults of a bench; every winch stays disabled.

    Drives that restarted are set up again. Ends with 5, naming why, where something still
    forbids motion. Attaches to the process that owns the bench where there is one.
    """
    from winchkit.cli.core.dry_run import station_for

    with station_for(bench, client="reset", dry_run=dry_run, as_json=as_json) as station:
        cleared = station.reset()
        status = station.status()
    if dry_run:
        return
    if as_json:
        echo_json({**status, "cleared": cleared})
        return
    for item in cleared:
        click.echo(f"cleared: {item}")
    click.echo("reset: nothing is tripped" if cleared else "reset: there was nothing to clear")
    for trip in status["blocked"]:
        click.echo(f"still forbidden: {trip}")

"""``winchkit reset``: clears trips and drive faults; nothing is enabled."""

from __future__ import annotations

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import bench_option, dry_run_option
from winchkit.cli.core.output import json_flag, tell


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit reset",
        "winchkit reset -b bench.toml --json",
    ),
)
@bench_option
@dry_run_option
@json_flag("Print the bench's state, and what was cleared, as JSON.")
def command(bench: str, *, dry_run: bool) -> None:
    """Clear latched trips and drive faults of a bench; every winch stays disabled.

    Drives that restarted are set up again. Ends with 5, naming why, where something still
    forbids motion. Attaches to the process that owns the bench where there is one.
    """
    from winchkit.cli.core.dry_run import station_for

    with station_for(bench, client="reset", dry_run=dry_run) as station:
        cleared = station.reset()
        status = station.status()
    if dry_run:
        return
    lines = [f"cleared: {item}" for item in cleared]
    lines += ["reset: nothing is tripped" if cleared else "reset: there was nothing to clear"]
    lines += [f"still forbidden: {trip}" for trip in status["blocked"]]
    tell({**status, "cleared": cleared}, lines)

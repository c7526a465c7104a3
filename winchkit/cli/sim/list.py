"""``winchkit sim list``: the simulated benches, and the physics that can be hidden in one."""

from __future__ import annotations

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.output import echo_json


@click.command(
    "list",
    cls=Command,
    examples=(
        "winchkit sim list",
        "winchkit sim list --physics --json",
    ),
)
@click.option("--physics", is_flag=True, help="What can be hidden, with its numbers, instead.")
@click.option("--json", "as_json", is_flag=True, help="As JSON, with everything hidden.")
def command(physics: bool, as_json: bool) -> None:
    """List the simulated benches, or the physics that can be hidden in one."""
    from winchkit.sim.bench import listed_benches
    from winchkit.sim.physics.table import listed_physics

    rows = listed_physics() if physics else listed_benches()
    if as_json:
        echo_json({"schema": 1, "physics" if physics else "benches": rows})
        return
    width = max((len(str(row["name"])) for row in rows), default=0)
    for row in rows:
        click.echo(f"{row['name']:<{width}}  {row['description']}")

"""``winchkit sim list``: the simulated benches, and the physics that can be hidden in one."""

from __future__ import annotations

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.output import json_flag, tell


@click.command(
    "list",
    cls=Command,
    examples=(
        "winchkit sim list",
        "winchkit sim list --physics --json",
    ),
)
@click.option("--physics", is_flag=True, help="What can be hidden, with its numbers, instead.")
@json_flag("As JSON, with everything hidden.")
def command(physics: bool) -> None:
    """List the simulated benches, or the physics that can be hidden in one."""
    from winchkit.sim.bench import listed_benches
    from winchkit.sim.physics.table import listed_physics

    rows = listed_physics() if physics else listed_benches()
    width = max((len(str(row["name"])) for row in rows), default=0)
    lines = (f"{row['name']:<{width}}  {row['description']}" for row in rows)
    tell({"physics" if physics else "benches": rows}, lines)

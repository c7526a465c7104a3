"""``winchkit sim``: simulated benches, recorded faster than real time or served live."""

from __future__ import annotations

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.lazy import CommandPlace, LazyGroup
from winchkit.cli.core.output import json_flag, tell

COMMANDS = {
    "record": CommandPlace(
        "winchkit.cli.sim.record", "Run programmes without buses and write the runs."
    ),
    "serve": CommandPlace("winchkit.cli.sim.serve", "Run a simulated bench live, with its buses."),
    "list": CommandPlace(
        "winchkit.cli.sim.group", "List simulated benches, or what they can hide.", "benches"
    ),
}


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    examples=("winchkit sim list", "winchkit sim record demo-elastic-rope programme-demo"),
)
def command() -> None:
    """Simulated benches: what they hide is known, so a diagnosis can be scored."""


@click.command(
    "list",
    cls=ToolCommand,
    examples=(
        "winchkit sim list",
        "winchkit sim list --physics --json",
    ),
)
@click.option("--physics", is_flag=True, help="What can be hidden, with its numbers, instead.")
@json_flag("As JSON, with everything hidden.")
def benches(physics: bool) -> None:
    """List the simulated benches, or the physics that can be hidden in one."""
    from winchkit.sim.bench import listed_benches
    from winchkit.sim.physics.table import listed_physics

    rows = listed_physics() if physics else listed_benches()
    width = max((len(row.name) for row in rows), default=0)
    lines = (f"{row.name:<{width}}  {row.description}" for row in rows)
    tell({"physics" if physics else "benches": rows}, lines)

"""``winchkit sim``: simulated benches, recorded faster than real time or served live."""

from __future__ import annotations

import click

from winchkit.cli.core.lazy import At, LazyGroup

COMMANDS = {
    "record": At("winchkit.cli.sim.record", "Run programmes without buses and write the runs."),
    "serve": At("winchkit.cli.sim.serve", "Run a simulated bench live, with its buses."),
    "list": At("winchkit.cli.sim.list", "List simulated benches, or what they can hide."),
}


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    examples=(
        "winchkit sim list",
        "winchkit sim record demo-elastic-rope programme-demo",
    ),
)
def command() -> None:
    """Simulated benches: what they hide is known, so a diagnosis can be scored."""

"""``winchkit scan``: who is on the CAN buses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import BusChoice, bus_options
from winchkit.cli.core.output import json_flag, tell
from winchkit.errors import NoReply

if TYPE_CHECKING:
    from winchkit.drivers.can.tools.scan import ScannedNode


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit scan -b bench.toml",
        Example("winchkit scan --interface socketcan --channel can0", "needs a CAN adapter"),
    ),
)
@bus_options
@json_flag("Print the nodes as JSON.")
def command(**bus: Any) -> None:
    """List every node of a CAN bus: identity, heartbeat, the device file that fits.

    Asks each node number for its device type and listens for heartbeats; writes nothing. Every
    node is listed, also one that refuses, falls silent or shares its number with another. Ends
    with 4 when no node answers.
    """
    from winchkit.bench.drives.node_access import nodes_on

    choice = BusChoice(**bus)
    spec = choice.spec()
    bench = str(spec.path) if spec.path else None
    found = nodes_on(spec)
    tell({"nodes": found}, map(_line, found))
    if found and bench is not None:
        suggest_next("check", bench)
    elif found:
        suggest_next("info", str(found[0].node), *choice.words)
    if not found:
        raise NoReply(f"{spec.name}: no node answers; check power, wiring, termination, bit rate")


def _line(item: ScannedNode) -> str:
    problem = f"; {item.problem}" if item.problem else ""
    if item.device_type is None:
        return f"{item.bus} node {item.node}: {item.heartbeat}{problem}"
    fits = f"fits {item.device}" if item.device else "no device file fits"
    name = f"'{item.name}'" if item.name else "no name"
    winch = f", winch {item.winch}" if item.winch else ""
    return (
        f"{item.bus} node {item.node}: {name}, {item.identity}, {item.heartbeat}, {fits}{winch}"
        + problem
    )

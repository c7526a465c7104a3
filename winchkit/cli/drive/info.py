"""``winchkit scan`` and ``winchkit info``: who is on the CAN buses, and what a drive says."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.completion import complete_device, complete_winch
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import BusChoice, bus_options
from winchkit.cli.core.output import json_flag, tell
from winchkit.errors import NoReply

if TYPE_CHECKING:
    from winchkit.bench.drives.node_access import Node
    from winchkit.drivers.can.tools.info import DriveInfo, Noted
    from winchkit.drivers.can.tools.scan import ScannedNode


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit info A -b bench.toml",
        Example("winchkit info 5 --interface socketcan --channel can0", "needs a CAN adapter"),
    ),
)
@click.argument("who", required=False, metavar="WINCH|NODE", shell_complete=complete_winch)
@bus_options
@click.option(
    "--device",
    metavar="NAME",
    shell_complete=complete_device,
    help="Device file of a node that the bench does not name.  [default: the one that fits]",
)
@json_flag("Print all of it as JSON.")
def command(who: str | None, *, device: str | None, **bus: Any) -> None:
    """Show identity, state, modes, errors, limits, option codes and units of a drive.

    Reads by SDO, through the process that owns the bench where there is one; writes nothing.
    """
    from winchkit.bench.drives.node_access import drive_at
    from winchkit.catalog import find
    from winchkit.drivers.can.tools.info import read_info

    if device is not None:
        find("devices", device)
    with drive_at(BusChoice(**bus).spec(), who, device=device) as node:
        info = read_info(node.objects)
    tell(_tree(node, info), _lines(node, info))


def _lines(node: Node, info: DriveInfo) -> Iterator[str]:
    yield f"{node.name}: {' '.join(filter(None, (info.name, info.hardware, info.software)))}"
    yield f"  identity: {info.identity}"
    fits = info.device or "none of the shipped ones"
    yield f"  device file: {node.device.name} is used, {fits} fits the identity"
    yield f"  state: {info.state}, mode {info.mode}"
    yield f"  modes: {', '.join(info.modes) or 'not reported (6502h)'}"
    if node.wiring is not None:
        yield f"  brake: {'declared' if node.wiring.brake else 'none declared'}"
    register = "not reported" if info.error_register is None else f"{info.error_register:02X}h"
    yield f"  error register: {register}"
    for code, words in info.errors:
        yield f"  error history: {code:04X}h {words}"
    for group, entries in info.noted.items():
        yield f"  {group}:"
        for entry in entries:
            if entry.value is not None:
                yield f"    {_place(entry)} {entry.what}: {_shown(entry)}"


def _place(entry: Noted) -> str:
    return f"{entry.index:04X}h" + (f":{entry.sub}" if entry.sub else "")


def _shown(entry: Noted) -> str:
    return f"{entry.value}, {entry.meaning}" if entry.meaning else str(entry.value)


def _tree(node: Node, info: DriveInfo) -> dict[str, Any]:
    brake = node.wiring.brake if node.wiring is not None else None
    return {
        **vars(info),
        "drive": info.name,
        "name": node.name,
        "node": node.node,
        "used_device": node.device.name,
        "brake": brake,
        "errors": [{"code": code, "meaning": words} for code, words in info.errors],
    }


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit scan -b bench.toml",
        Example("winchkit scan --interface socketcan --channel can0", "needs a CAN adapter"),
    ),
)
@bus_options
@json_flag("Print the nodes as JSON.")
def scan(**bus: Any) -> None:
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
    tell({"nodes": found}, map(_node_line, found))
    if found and bench is not None:
        suggest_next("check", bench)
    elif found:
        suggest_next("info", str(found[0].node), *choice.words)
    if not found:
        raise NoReply(f"{spec.name}: no node answers; check power, wiring, termination, bit rate")


def _node_line(item: ScannedNode) -> str:
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

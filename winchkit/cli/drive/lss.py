"""``winchkit lss``: finds drives without a node number, and gives numbers and bit rates."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import Example, Group
from winchkit.cli.core.dry_run import PlannedFrame, show_frames
from winchkit.cli.core.options import BusChoice, all_of, bus_options, dry_run_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.drivers.can.canopen.identity import Identity
    from winchkit.drivers.can.canopen.lss import LssLine

_BUS = "can"
_SELECTED = {0x43: 0x44}
"""Answers whose first byte is not that of the question."""
_ANSWERED = (0x11, 0x13, 0x17, 0x43, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E)
"""Command specifiers of CiA 305 that have an answer of the node; the others have none to wait
for."""


@contextmanager
def rehearsed() -> Iterator[LssLine]:
    """An LSS line to nowhere; its frames are shown at the end."""
    from winchkit.drivers.can.canopen.lss import LssLine

    network = _LssBus()
    line = LssLine(network)
    yield line
    line.close()
    show_frames(network.frames, {})


class _LssBus:
    """Stands for a bus, its network and the device on it."""

    def __init__(self) -> None:
        self.name = _BUS
        self.network: Any = self
        self.frames: list[PlannedFrame] = []
        from canopen.lss import LssMaster

        master: Any = LssMaster()
        master.network = self
        self.lss = master

    def on(self, identifier: int, handler: object) -> None:
        """Nothing ever comes from outside."""

    def send_message(self, identifier: int, data: bytes) -> None:
        """Note a frame; say yes to what wants an answer."""
        self.frames.append(PlannedFrame(0.0, _BUS, identifier, bytes(data)))
        if data[0] in _ANSWERED:
            answer = bytes((_SELECTED.get(data[0], data[0]),)).ljust(8, b"\0")
            self.lss.on_message_received(0x7E4, answer, 0.0)


_json = json_flag("Print the result as JSON.")
_PARTS = ("vendor", "product", "revision", "serial")


class _Number(click.ParamType):  # type: ignore[type-arg]
    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Take 26, 0x1A or 1Ah."""
        text = str(value)
        try:
            if text[-1:] in "hH" and text[:-1]:
                return int(text[:-1], 16)
            return int(text, 0)
        except ValueError:
            self.fail(f"'{text}' is no number; write 26, 0x1A or 1Ah", param, ctx)


_identity_options = all_of(
    click.option("--only", is_flag=True, help="The only device on the bus, whichever it is."),
    *(
        click.option(f"--{part}", type=_Number(), help="Number of the identity object, 1018h.")
        for part in _PARTS
    ),
)


@click.group(
    cls=Group,
    examples=(
        "winchkit lss list",
        "winchkit lss set --only --node 5 --store --dry-run",
    ),
)
def command() -> None:
    """Layer setting services (CiA 305), for drives that have no node number yet.

    A device is named by its identity, object 1018h, as `scan` and `lss list` show it. No process
    may own the bench meanwhile, and no drive may move.
    """


@command.command(
    "list",
    examples=(
        "winchkit lss list",
        "winchkit lss list -b bench.toml --json",
    ),
)
@bus_options
@_json
def find(**bus: Any) -> None:
    """Find a device without a node number (fast scan); several are found one after another.

    Those with a number are shown by `winchkit scan`.
    """
    with _line(BusChoice(**bus)) as line:
        found = line.find_unconfigured()
    words = "no device without a node number" if found is None else str(found)
    tell({"unconfigured": [] if found is None else [found]}, [words])


@command.command(
    examples=(
        Example("winchkit lss identify --only", "needs a drive that is alone on its bus"),
        Example(
            "winchkit lss identify --vendor 1Ah --product 2 --revision 1 --serial 7",
            "needs a drive that is alone on its bus",
        ),
    )
)
@_identity_options
@bus_options
@_json
def identify(*, only: bool, **rest: Any) -> None:
    """Ask a device of a known identity for its node number."""
    from winchkit.drivers.can.canopen.lss import UNCONFIGURED

    parts = {part: rest.pop(part) for part in _PARTS}
    with _line(BusChoice(**rest)) as line:
        identity = _select(line, parts, only=only)
        node = line.node()
    number = None if node == UNCONFIGURED else node
    words = "no node number" if number is None else f"node {number}"
    tell({"identity": identity, "node": number}, [f"{identity}: {words}"])


@command.command(
    "set",
    examples=(
        "winchkit lss set --only --node 5 --store --dry-run",
        "winchkit lss set --only --new-bitrate 500000 --dry-run",
    ),
)
@_identity_options
@click.option("--node", type=int, help="Node number, 1 to 127.")
@click.option("--new-bitrate", type=int, help="Bit rate to set, bit/s.")
@click.option("--store", is_flag=True, help="Let the device keep it when switched off.")
@bus_options
@dry_run_option
@_json
def assign(
    *,
    only: bool,
    node: int | None,
    new_bitrate: int | None,
    store: bool,
    dry_run: bool,
    **rest: Any,
) -> None:
    """Set node number and bit rate of a device.

    The number counts from the next reset of communication, the bit rate from the next start, and
    only if stored.
    """
    if node is None and new_bitrate is None and not store:
        raise UsageError("nothing to set; give --node, --new-bitrate or --store")
    from winchkit.drivers.can.canopen.lss import check_bitrate, check_node

    check_node(node)
    check_bitrate(new_bitrate)
    parts = {part: rest.pop(part) for part in _PARTS}
    choice = BusChoice(**rest)
    if dry_run:
        with rehearsed() as line:
            _assign(line, parts, only, node, new_bitrate, store)
        return
    with _line(choice) as line:
        identity = _assign(line, parts, only, node, new_bitrate, store)
    settings = [f"node {node}"] if node is not None else []
    settings += [f"{new_bitrate} bit/s"] if new_bitrate is not None else []
    settings += ["stored"] if store else []
    tell(
        {"identity": identity, "node": node, "bitrate": new_bitrate, "stored": store},
        [f"{identity}: {', '.join(settings)}; switch it off and on"],
    )


def _assign(
    line: LssLine,
    parts: dict[str, int | None],
    only: bool,
    node: int | None,
    bitrate: int | None,
    store: bool,
) -> Identity:
    identity = _select(line, parts, only=only)
    line.configure(node, bitrate, store=store)
    return identity


def _select(line: LssLine, parts: dict[str, int | None], *, only: bool) -> Identity:
    from winchkit.drivers.can.canopen.identity import Identity

    given = {part: value for part, value in parts.items() if value is not None}
    if only and not given:
        return line.select_only()
    if only or len(given) < len(_PARTS):
        missing = ", ".join(f"--{part}" for part in _PARTS if part not in given)
        raise UsageError(
            f"no device is given: give all of its identity ({missing or 'without --only'}), or "
            "--only where there is one device on the bus"
        )
    identity = Identity(**given)
    line.select(identity)
    return identity


@contextmanager
def _line(choice: BusChoice) -> Iterator[LssLine]:
    from winchkit.bench.drives.node_access import free_bus
    from winchkit.drivers.can.canopen.lss import LssLine

    with free_bus(choice.spec()) as bus:
        line = LssLine(bus)
        try:
            yield line
        finally:
            line.close()

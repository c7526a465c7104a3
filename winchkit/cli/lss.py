"""``winchkit lss``: finds drives without a node number, and gives numbers and bit rates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.bench_option import BusChoice, bus_options, dry_run_option
from winchkit.cli.output import echo_json
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.drivers.can.fitting import Identity
    from winchkit.drivers.can.lss import LssLine

__all__ = ["command"]

_json = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
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


def _identity_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the four parts of an identity."""
    for part in reversed(_PARTS):
        function = click.option(f"--{part}", type=_Number(), help="Of object 1018h.")(function)
    only = click.option("--only", is_flag=True, help="The only device on the bus, whichever it is.")
    return only(function)


@click.group()
def command() -> None:
    """Layer setting services (CiA 305), for drives that have no node number yet.

    A device is named by its identity, object 1018h, as `scan` and `lss list` show it. Nobody may
    own the bench meanwhile, and no drive may move.
    """


@command.command("list")
@bus_options
@_json
def find(*, as_json: bool, **bus: Any) -> None:
    """Find a device without a node number (fast scan); several are found one after another.

    Those with a number are shown by `winchkit scan`.
    """
    with _line(BusChoice(**bus)) as line:
        found = line.find_unconfigured()
    if as_json:
        echo_json({"schema": 1, "unconfigured": [] if found is None else [found]})
    else:
        click.echo("no device without a node number" if found is None else str(found))


@command.command()
@_identity_options
@bus_options
@_json
def identify(*, only: bool, as_json: bool, **rest: Any) -> None:
    """Ask a device of a known identity for its node number."""
    from winchkit.drivers.can.lss import UNCONFIGURED

    parts = {part: rest.pop(part) for part in _PARTS}
    with _line(BusChoice(**rest)) as line:
        identity = _select(line, parts, only=only)
        node = line.node()
    number = None if node == UNCONFIGURED else node
    if as_json:
        echo_json({"schema": 1, "identity": identity, "node": number})
    else:
        click.echo(f"{identity}: {'no node number' if number is None else f'node {number}'}")


@command.command("set")
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
    as_json: bool,
    **rest: Any,
) -> None:
    """Set node number and bit rate of a device.

    The number counts from the next reset of communication, the bit rate from the next start, and
    only if stored.
    """
    if node is None and new_bitrate is None and not store:
        raise UsageError("nothing to set; give --node, --new-bitrate or --store")
    parts = {part: rest.pop(part) for part in _PARTS}
    choice = BusChoice(**rest)
    if dry_run:
        from winchkit.cli.lss_rehearsal import rehearsed

        with rehearsed(as_json=as_json) as line:
            _assign(line, parts, only, node, new_bitrate, store)
        return
    with _line(choice) as line:
        identity = _assign(line, parts, only, node, new_bitrate, store)
    if as_json:
        done = {"node": node, "bitrate": new_bitrate, "stored": store}
        echo_json({"schema": 1, "identity": identity, **done})
        return
    settings = [f"node {node}"] if node is not None else []
    settings += [f"{new_bitrate} bit/s"] if new_bitrate is not None else []
    settings += ["stored"] if store else []
    click.echo(f"{identity}: {', '.join(settings)}; switch it off and on")


def _assign(
    line: LssLine,
    parts: dict[str, int | None],
    only: bool,
    node: int | None,
    bitrate: int | None,
    store: bool,
) -> Identity:
    identity = _select(line, parts, only=only)
    if node is not None:
        line.set_node(node)
    if bitrate is not None:
        line.set_bitrate(bitrate)
    if store:
        line.store()
    return identity


def _select(line: LssLine, parts: dict[str, int | None], *, only: bool) -> Identity:
    from winchkit.drivers.can.fitting import Identity

    given = {part: value for part, value in parts.items() if value is not None}
    if only and not given:
        return line.select_only()
    if only or len(given) < len(_PARTS):
        missing = ", ".join(f"--{part}" for part in _PARTS if part not in given)
        raise UsageError(
            f"which device? give all of its identity ({missing or 'without --only'}), or --only "
            "where there is one device on the bus"
        )
    identity = Identity(**given)
    line.select(identity)
    return identity


@contextmanager
def _line(choice: BusChoice) -> Iterator[LssLine]:
    from winchkit.bench.node_access import free_bus
    from winchkit.drivers.can.lss import LssLine

    with free_bus(choice.spec()) as bus:
        line = LssLine(bus)
        try:
            yield line
        finally:
            line.close()

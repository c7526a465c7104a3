"""Options that say which bench, or which CAN bus, a command is about."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.completing import complete_bench, complete_winch
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec

__all__ = [
    "BusChoice",
    "bench_option",
    "bus_options",
    "dry_run_option",
    "effects_option",
    "take_over_option",
    "winch_argument",
]

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

bench_option: Decorator = click.option(
    "-b",
    "--bench",
    required=True,
    metavar="FILE",
    shell_complete=complete_bench,
    help="Wiring file of the bench.",
)
effects_option: Decorator = click.option(
    "--effects",
    "effects",
    multiple=True,
    metavar="FILE",
    help="Python file with effects of your own that a profile has; may be given several times.",
)
winch_argument: Decorator = click.argument("winch", required=False, shell_complete=complete_winch)
take_over_option: Decorator = click.option(
    "--take-over",
    is_flag=True,
    help="Command the winch even where another client does; its motion ends by a ramp.",
)
dry_run_option: Decorator = click.option(
    "--dry-run", is_flag=True, help="Print the frames that it would send; send nothing."
)


@dataclass(frozen=True)
class BusChoice:
    """A bench, or a CAN bus without one, as given on the command line."""

    bench: str | None
    interface: str | None
    channel: str | None
    bitrate: int
    port: int | None

    def spec(self) -> BenchSpec:
        """The wiring; raises UsageError where neither or both are given, FileError."""
        if self.bench is not None:
            if self.interface or self.channel:
                raise UsageError("--bench names the bus already; leave --interface, --channel out")
            from winchkit.schema.read import read_bench

            return read_bench(self.bench)
        if not self.interface or not self.channel:
            raise UsageError("which bus? give --bench FILE, or --interface and --channel")
        from winchkit.bench.node_access import bus_only

        return bus_only(self.interface, self.channel, self.bitrate, self.port)


def bus_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add --bench or, in its place, the options of a CAN bus."""
    options = [
        click.option(
            "-b",
            "--bench",
            metavar="FILE",
            shell_complete=complete_bench,
            help="Wiring file of the bench.",
        ),
        click.option("--interface", help="Without a bench: python-can's name, e.g. socketcan."),
        click.option("--channel", help="Without a bench: e.g. can0."),
        click.option("--bitrate", default=1_000_000, show_default=True, help="bit/s."),
        click.option("--port", type=int, help="Without a bench: UDP port of udp_multicast."),
    ]
    for option in reversed(options):
        function = option(function)
    return function

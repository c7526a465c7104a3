"""Options and arguments that several commands have: bench, bus, profile, runs, effects."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.completion import (
    complete_bench,
    complete_file,
    complete_profile,
    complete_programme,
    complete_run,
    complete_sim_bench,
    complete_winch,
    files_of_kind,
)
from winchkit.cli.core.early_checks import check_folder, check_new_file, check_new_profile
from winchkit.cli.core.messages import note
from winchkit.cli.core.quantity_type import QuantityType
from winchkit.cli.core.standard_input import Readable
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec

BENCH_VARIABLE = "WINCHKIT_BENCH"
_ARGUMENT = "winchkit.bench_argument"
_BITRATE = 1_000_000
"""bit/s: the highest of CiA 301, and the usual one of drives."""
RUN = Readable("run", complete_run)
PROFILE = Readable("profile", complete_profile)
PROGRAMME = Readable("programme", complete_programme)
BENCH = Readable("bench file", complete_bench)
SIM_BENCH = Readable("simulated bench", complete_sim_bench)
TABLE = Readable("file", complete_file)
Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def bench_by_default(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The bench that was given, else the one bench file of this folder; raises UsageError.

    A file that the command line does not name is reported on stderr, since a command may move what
    it describes.
    """
    if ctx.resilient_parsing:
        return value
    if value is not None:
        source = ctx.get_parameter_source(param.name or "")
        if source is click.core.ParameterSource.ENVIRONMENT:
            names = [param.envvar] if isinstance(param.envvar, str) else param.envvar or ()
            variable = next((name for name in names if os.environ.get(name)), "environment")
            note(f"bench: {value} ({variable})")
        return value
    if (only := _only_bench()) is not None:
        return only
    here = [str(path) for path in files_of_kind(Path(), ("bench",))]
    found = f"this folder has {', '.join(here)}" if here else "this folder has no bench file"
    raise UsageError(f"no bench is given: {found}; give --bench FILE, or set {BENCH_VARIABLE}")


def _only_bench() -> str | None:
    """The one bench file of this folder, reported; None for none and for several."""
    here = files_of_kind(Path(), ("bench",))
    if len(here) != 1:
        return None
    note(f"bench: {here[0]}")
    return str(here[0])


def bench_file_option(
    help: str = "Bench file.  [default: the only one of this folder]",
    callback: Callable[..., Any] | None = None,
) -> Decorator:
    """The option ``-b`` of a bench file."""
    return click.option(
        "-b",
        "--bench",
        metavar="FILE",
        shell_complete=complete_bench,
        callback=callback,
        help=help,
    )


bench_option = bench_file_option(callback=bench_by_default)


def own_effects_option(help: str = "Your own effects.", name: str = "effect_files") -> Decorator:
    """The option ``--effects``: Python files with effects; the command gets them by ``name``."""
    return click.option(
        "--effects", name, multiple=True, metavar="FILE", shell_complete=complete_file, help=help
    )


effects_option = own_effects_option(
    "Python file with effects of your own that a profile has; may be given several times.",
    "effects",
)


def _keep_argument(ctx: click.Context, param: click.Parameter, value: str | None) -> None:
    """Keep the bench that was given without the option, for the callback of the option."""
    ctx.meta[_ARGUMENT] = value


def _bench_of_either(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The bench that was given as argument or option; raises UsageError for two of them."""
    argument: str | None = ctx.meta.get(_ARGUMENT)
    if argument is None:
        return bench_by_default(ctx, param, value)
    is_typed = ctx.get_parameter_source("bench") is click.core.ParameterSource.COMMANDLINE
    if is_typed and value != argument:
        raise UsageError(f"two bench files, '{argument}' and --bench '{value}'; give one")
    return argument


def bench_argument(function: Callable[..., Any]) -> Callable[..., Any]:
    """The bench as an argument, and as the option ``-b`` that other commands have."""
    argument = click.argument(
        "bench_file",
        required=False,
        metavar="[BENCH]",
        shell_complete=complete_bench,
        is_eager=True,
        expose_value=False,
        callback=_keep_argument,
    )
    return argument(bench_file_option(callback=_bench_of_either)(function))


winch_argument: Decorator = click.argument("winch", required=False, shell_complete=complete_winch)
take_over_option: Decorator = click.option(
    "--take-over",
    is_flag=True,
    help="Command the winch even where another client does; its motion ends by a ramp.",
)
yes_option: Decorator = click.option("-y", "--yes", is_flag=True, help="Do not ask.")
dry_run_option: Decorator = click.option(
    "--dry-run", is_flag=True, help="Print the frames that it would send; send nothing."
)
device_option: Decorator = click.option(
    "--device",
    "devices",
    multiple=True,
    metavar="[NODE=]DEVICE",
    shell_complete=complete_file,
    help="EDS, DCF or device file of the nodes in a trace of CAN frames, or of one: "
    "'maxon-epos4', '5=cell.eds'. May be given several times.",
)


def quantity_option(
    *names: str, of: str, help: str, example: str = "", default: str | None = None
) -> Decorator:
    """An option that is a quantity; its default is the example of its messages, too."""
    kind = QuantityType(of, example=default or example)
    shown = default is not None
    return click.option(*names, type=kind, default=default, show_default=shown, help=help)


def duration_option(help: str, example: str = "10 s", default: str | None = None) -> Decorator:
    """The option ``--for``: how long something lasts."""
    names = ("--for", "duration")
    return quantity_option(*names, of="time", help=help, example=example, default=default)


_OUTPUT_CHECKS = {"DIR": check_folder, "NEW.toml": check_new_profile}


def output_option(help: str, metavar: str = "FILE", *names: str, **more: Any) -> Decorator:
    """The option ``-o``, or further names: where a command writes.

    With the metavar ``DIR`` a folder, which may be made, else a file in an existing folder, with
    ``NEW.toml`` a profile: a place that cannot be written is refused before the work, unless the
    command has a ``callback`` of its own.
    """
    more.setdefault("callback", checked(_OUTPUT_CHECKS.get(metavar, check_new_file)))
    return click.option("-o", "--output", *names, metavar=metavar, help=help, **more)


def checked(check: Callable[[str, str], None]) -> Callable[..., Any]:
    """A callback that lets a check refuse the value of an option before the command begins."""

    def callback(ctx: click.Context, param: click.Parameter, value: Any) -> Any:
        if value is not None and not ctx.resilient_parsing:
            check(value, param.opts[0])
        return value

    return callback


runs_folder_option = output_option(
    "Folder for the runs.",
    "DIR",
    "--out",
    default=".",
    show_default=True,
    type=click.Path(file_okay=False, path_type=Path),
)
replace_option: Decorator = click.option(
    "--replace", is_flag=True, help="Write over files of that name."
)
format_option: Decorator = click.option(
    "--format", "suffix", default="csv", show_default=True, type=click.Choice(["csv", "mcap"])
)


@dataclass(frozen=True)
class BusChoice:
    """A bench, or a CAN bus without one, as given on the command line."""

    bench: str | None
    interface: str | None
    channel: str | None
    bitrate: int
    port: int | None

    @property
    def words(self) -> tuple[str, ...]:
        """The options as they were given, to repeat them."""
        out: list[str] = []
        for name, value in vars(self).items():
            if value is not None and (name != "bitrate" or value != _BITRATE):
                out += [f"--{name}", str(value)]
        return tuple(out)

    def spec(self) -> BenchSpec:
        """The wiring; raises UsageError where neither or both are given, FileError."""
        if self.bench is not None:
            if self.interface or self.channel:
                raise UsageError("--bench names the bus already; leave --interface, --channel out")
            from winchkit.schema.read import read_bench

            return read_bench(self.bench)
        if not self.interface and not self.channel and (bench := _only_bench()):
            return replace(self, bench=bench).spec()
        if not self.interface or not self.channel:
            raise UsageError(
                f"no bus is given: give --bench FILE, set {BENCH_VARIABLE}, or give --interface "
                "and --channel"
            )
        from winchkit.bench.drives.node_access import bus_only

        return bus_only(self.interface, self.channel, self.bitrate, self.port)


def all_of(*options: Decorator) -> Decorator:
    """Several options as one, in the order of the help."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            function = option(function)
        return function

    return decorate


bus_options = all_of(
    bench_file_option(),
    click.option("--interface", help="Without a bench: python-can's name, e.g. socketcan."),
    click.option("--channel", help="Without a bench: channel of the interface, e.g. can0."),
    click.option(
        "--bitrate", default=_BITRATE, show_default=True, help="Without a bench: bit rate, bit/s."
    ),
    click.option("--port", type=int, help="Without a bench: UDP port of udp_multicast."),
)
"""--bench or, in its place, the options of a CAN bus."""

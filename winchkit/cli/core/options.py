"""Options that say which bench, or which CAN bus, a command is about."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from winchkit.errors import UsageError
from winchkit.regular_file import regular

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec

__all__ = [
    "BENCH_VARIABLE",
    "BusChoice",
    "bench_by_default",
    "bench_option",
    "bus_options",
    "complete_bench",
    "complete_device",
    "complete_programme",
    "complete_winch",
    "dry_run_option",
    "effects_option",
    "take_over_option",
    "winch_argument",
]

_KIND = re.compile(r'^kind\s*=\s*"([\w-]+)"', re.MULTILINE)
BENCH_VARIABLE = "WINCHKIT_BENCH"
_HEAD = 2000
"""Characters of a file in which its kind stands."""


def complete_bench(ctx: click.Context, _param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Bench files, and folders that may hold some."""
    return _files(typed, ("bench",))


def complete_programme(
    ctx: click.Context, _param: click.Parameter, typed: str
) -> list[CompletionItem]:
    """Programmes in files, and those that are shipped, by name."""
    from winchkit import catalog

    shipped = [path.stem for path in catalog.folder("sim").glob("programme-*.toml")]
    return _names(shipped, typed) + _files(typed, ("programme",))


def complete_device(
    ctx: click.Context, _param: click.Parameter, typed: str
) -> list[CompletionItem]:
    """Shipped devices."""
    from winchkit import catalog

    return _names(catalog.names("devices"), typed)


def complete_winch(ctx: click.Context, param: click.Parameter, typed: str) -> list[CompletionItem]:
    """Winches of the bench file that stands on the line already, or in the environment."""
    bench = ctx.params.get("bench") or _from_environment(ctx)
    if not bench:
        return []
    try:
        with open(bench, "rb", opener=regular) as file:
            winches = tomllib.load(file).get("winch", {})
    except (OSError, tomllib.TOMLDecodeError):
        return []
    return _names(winches if isinstance(winches, dict) else (), typed)


def _from_environment(ctx: click.Context) -> str | None:
    for option in ctx.command.params:
        if option.name == "bench":
            value = option.value_from_envvar(ctx)
            return value if isinstance(value, str) else None
    return None


def _names(known: Iterable[str], typed: str) -> list[CompletionItem]:
    return [CompletionItem(name) for name in sorted(known) if name.startswith(typed)]


def _files(typed: str, kinds: tuple[str, ...]) -> list[CompletionItem]:
    """TOML files of these kinds, and folders, that begin with what is typed."""
    folder, _, name = typed.rpartition("/")
    lead = f"{folder}/" if "/" in typed else ""
    try:
        here = sorted((Path(lead) if lead else Path()).iterdir())
    except OSError:
        return []
    found = [path for path in here if path.name.startswith(name) and not path.name.startswith(".")]
    folders = [CompletionItem(f"{lead}{path.name}/") for path in found if path.is_dir()]
    files = [
        CompletionItem(f"{lead}{path.name}")
        for path in found
        if path.suffix == ".toml" and path.is_file() and _kind(path) in kinds
    ]
    return files + folders


def _kind(path: Path) -> str:
    """Kind of a declaration by its first lines; empty where it has none."""
    try:
        with open(path, encoding="utf-8", errors="replace", opener=regular) as file:
            found = _KIND.search(file.read(_HEAD))
    except OSError:
        return ""
    return found[1] if found else ""


Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def bench_by_default(ctx: click.Context, _param: click.Parameter, value: str | None) -> str | None:
    """The bench that was given, else the one bench file of this folder.

    Raises UsageError where the folder has none or several. The file that was chosen is reported
    on stderr, since a command may move what it describes.
    """
    if value is not None or ctx.resilient_parsing:
        return value
    here = [str(path) for path in sorted(Path().glob("*.toml")) if _kind(path) == "bench"]
    if len(here) == 1:
        click.echo(f"bench: {here[0]}", err=True)
        return here[0]
    found = f"this folder has {', '.join(here)}" if here else "this folder has no bench file"
    raise UsageError(f"which bench? {found}; give --bench FILE, or set {BENCH_VARIABLE}")


bench_option: Decorator = click.option(
    "-b",
    "--bench",
    metavar="FILE",
    shell_complete=complete_bench,
    callback=bench_by_default,
    help="Bench file.  [default: the only one of this folder]",
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
        from winchkit.bench.drives.node_access import bus_only

        return bus_only(self.interface, self.channel, self.bitrate, self.port)


def bus_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add --bench or, in its place, the options of a CAN bus."""
    options = [
        click.option(
            "-b",
            "--bench",
            metavar="FILE",
            shell_complete=complete_bench,
            help="Bench file of the bench.",
        ),
        click.option("--interface", help="Without a bench: python-can's name, e.g. socketcan."),
        click.option("--channel", help="Without a bench: e.g. can0."),
        click.option("--bitrate", default=1_000_000, show_default=True, help="bit/s."),
        click.option("--port", type=int, help="Without a bench: UDP port of udp_multicast."),
    ]
    for option in reversed(options):
        function = option(function)
    return function

"""``winchkit log``: records a bench, and looks after what was recorded."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.bench_option import effects_option
from winchkit.cli.completing import complete_bench
from winchkit.cli.lazy import At, LazyGroup
from winchkit.cli.output import echo_json

if TYPE_CHECKING:
    from winchkit.bench.live_sinks import LiveSink
    from winchkit.bench.station import Station

__all__ = ["command"]

COMMANDS = {
    "info": At("winchkit.cli.log_info", "What a log holds: channels, rates, gaps, counters."),
    "recover": At("winchkit.cli.log_recover", "Save what is whole of a log that was cut off."),
    "export": At("winchkit.cli.export", "Convert a log to CSV, MCAP, Parquet or MF4."),
    "replay": At("winchkit.cli.log_replay", "Play a log as if it came from the bench."),
}
_CHECK_PERIOD = 0.1
_SHOW_PERIOD = 0.5


@click.group(cls=LazyGroup, table=COMMANDS, invoke_without_command=True)
@click.option(
    "-b",
    "--bench",
    metavar="FILE",
    shell_complete=complete_bench,
    help="Wiring file of the bench.",
)
@click.option("-o", "--output", metavar="FILE", help="Where to: a .csv or .mcap file.")
@click.option("--rotate", metavar="LIMIT", help="Go on in a new file, e.g. after 100MB or 10min.")
@click.option("--replace", is_flag=True, help="Write over an earlier log of that name.")
@click.option("--for", "duration", metavar="TIME", help="End after this time, e.g. 10s or '2 min'.")
@click.option("--jsonl", is_flag=True, help="Print live pictures to stdout, one JSON a line.")
@click.option("--udp", metavar="HOST:PORT", help="Send live pictures as JSON, e.g. to PlotJuggler.")
@click.option("--period", default="0.02 s", show_default=True, help="Between two live pictures.")
@effects_option
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
@click.pass_context
def command(
    context: click.Context,
    *,
    bench: str | None,
    output: str | None,
    rotate: str | None,
    replace: bool,
    duration: str | None,
    jsonl: bool,
    udp: str | None,
    period: str,
    effects: Sequence[str],
    as_json: bool,
) -> None:
    """Log every winch of a bench until Ctrl-C, or for a time.

    MCAP holds every channel with its own time stamps. In CSV a row stands for each reading of the
    load cell (else of the length instrument). Attaches to whoever owns the bench; moves nothing.
    """
    if context.invoked_subcommand is not None:
        return
    if bench is None:
        raise click.UsageError("Missing option '-b' / '--bench'.")
    _refuse(output, rotate, jsonl=jsonl, udp=udp, as_json=as_json)
    _refuse_to_lose(None if replace else output)
    from winchkit.bench.session import at_station
    from winchkit.cli.duration import quantity, seconds
    from winchkit.cli.live_output import live_sinks

    limit, pause = seconds(duration), quantity(period, "time")
    with live_sinks(jsonl=jsonl, udp=udp) as sinks, at_station(bench, effects) as station:
        _begin(station, output, rotate)
        with _counter_row(station) as show:
            _follow(station, limit, pause if sinks else _CHECK_PERIOD, sinks, show)
        counted = station.counters()
        rows = station.end_log() if output else 0
    if as_json:
        echo_json({"schema": 1, "output": output, "rows": rows, "counters": counted})
    elif output and not jsonl:
        click.echo(f"{output}: {rows} rows")


def _begin(station: Station, output: str | None, rotate: str | None) -> None:
    """Start the log that was asked for, in the place of an earlier one."""
    if output:
        _let_go(output)
        station.start_log(str(Path(output).absolute()), rotate)


def _earlier(output: str) -> list[Path]:
    """What is there of an earlier log of that name, its parts included."""
    from winchkit.runs.rotation import parts_beside

    path = Path(output)
    return [item for item in (path, *parts_beside(path)) if item.is_file()]


def _refuse_to_lose(output: str | None) -> None:
    """Raise UsageError where an earlier log would be written over."""
    held = [item for item in _earlier(output) if item.stat().st_size] if output else []
    if held:
        raise click.UsageError(f"{held[0]} holds a log already; name another file, or --replace.")


def _let_go(output: str) -> None:
    """Take an earlier log away: parts of it would be read as parts of the new one."""
    from winchkit.errors import Fault, FileError

    for item in _earlier(output):
        try:
            item.unlink()
        except OSError as error:
            raise FileError(Fault(f"cannot be replaced: {error.strerror}", str(item))) from None


def _refuse(
    output: str | None, rotate: str | None, *, jsonl: bool, udp: str | None, as_json: bool
) -> None:
    """Raise UsageError for options that cannot be meant together, before anything is opened."""
    if not (output or jsonl or udp):
        raise click.UsageError("Missing option '-o' / '--output' (or '--jsonl', '--udp').")
    if jsonl and as_json:
        raise click.UsageError("'--jsonl' and '--json' both print to stdout; choose one.")
    if rotate is not None:
        from winchkit.runs.rotation import Rotation

        Rotation.parse(rotate)


def _follow(
    station: Station,
    limit: float | None,
    pause: float,
    sinks: list[LiveSink],
    show: Callable[[], None],
) -> None:
    """Watch over the log, and show every new picture, until the time is over."""
    start, seen = time.monotonic(), -1
    try:
        while limit is None or time.monotonic() - start < limit:
            time.sleep(min(pause, limit or pause))
            station.log_rows()
            status = station.status() if sinks else {"cycle": seen}
            if status["cycle"] != seen:
                seen = status["cycle"]
                for sink in sinks:
                    sink(status)
            show()
    except KeyboardInterrupt:
        click.echo("ending the log", err=True)


@contextmanager
def _counter_row(station: Station) -> Iterator[Callable[[], None]]:
    """A live table of what is counted, where somebody sees it."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.live import Live

    from winchkit.cli.counter_table import counter_table

    shown = 0.0

    with Live(console=Console(stderr=True), auto_refresh=False) as live:

        def show() -> None:
            nonlocal shown
            now = time.monotonic()
            if now - shown >= _SHOW_PERIOD:
                shown = now
                counted: dict[str, dict[str, Any]] = station.counters()
                live.update(counter_table(counted), refresh=True)

        yield show

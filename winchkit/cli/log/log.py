"""``winchkit log``: records a bench, and looks after what was recorded."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.bench.remote.interruption import Terminated
from winchkit.cli.core.early_checks import check_output
from winchkit.cli.core.lazy import CommandPlace, LazyGroup
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import (
    bench_by_default,
    bench_file_option,
    duration_option,
    effects_option,
    output_option,
    quantity_option,
)
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.errors import UsageError, WinchkitError

if TYPE_CHECKING:
    from winchkit.bench.recording.live_sinks import LiveSink
    from winchkit.bench.remote.cell_session import CellStation
    from winchkit.bench.remote.operations import Station

COMMANDS = {
    "decode": CommandPlace("winchkit.cli.log.decode", "Print a trace of CAN frames in words."),
    "info": CommandPlace(
        "winchkit.cli.log.info", "What a log holds: channels, rates, gaps, counters."
    ),
    "recover": CommandPlace(
        "winchkit.cli.log.info", "Save what is whole of a log that was cut off.", "recover"
    ),
    "export": CommandPlace(
        "winchkit.cli.files.export", "Convert a log to CSV, MCAP, Parquet or MF4."
    ),
    "replay": CommandPlace("winchkit.cli.log.replay", "Play a log as if it came from the bench."),
}
_CHECK_PERIOD = 0.1
"""s between two looks at the recorder, so that a full disk is reported at once."""
_SHOW_PERIOD = 0.5
"""s between two pictures of the counts: fast enough to follow, slow enough to read."""


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    invoke_without_command=True,
    examples=("winchkit log -o lift.mcap --for 5s", "winchkit log -b bench.toml --jsonl --for 1s"),
)
@bench_file_option()
@output_option("Where to: a .csv or .mcap file.", callback=None)
@click.option("--rotate", metavar="LIMIT", help="Go on in a new file, e.g. after 100MB or 10min.")
@click.option("--replace", is_flag=True, help="Write over an earlier log of that name.")
@duration_option("End after this time, e.g. 10s or '2 min'.")
@click.option("--jsonl", is_flag=True, help="Print live pictures to stdout, one JSON a line.")
@click.option("--udp", metavar="HOST:PORT", help="Send live pictures as JSON, e.g. to PlotJuggler.")
@quantity_option("--period", of="time", default="0.02 s", help="Time between two live pictures.")
@effects_option
@click.option("--strict", is_flag=True, help="Exit with 1 where a drive or instrument fell silent.")
@json_flag("Print the result as JSON.")
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
    strict: bool,
) -> None:
    """Log every winch of a bench until Ctrl-C, or for a time.

    MCAP holds every channel with its own time stamps. In CSV a row stands for each reading of the
    load cell (else of the length instrument); while it is silent, for samples of the others. A
    drive or instrument that falls silent is reported at once and at the end. Moves nothing, and
    keeps no program from owning the bench; when the owner ends, the log goes on in a file of its
    own, FILE-2 and so on. A bench of instruments only, without drives, is opened by the log itself.
    """
    if context.invoked_subcommand is not None:
        return
    bench = bench_by_default(context, context.command.params[0], bench)
    assert bench is not None, "else UsageError"
    if output is not None:
        check_output(output, (".csv", ".mcap"))
    _refuse(output, rotate, jsonl=jsonl, udp=udp)
    _refuse_to_lose(None if replace else output)
    from winchkit.cli.core.quantities import quantity, seconds
    from winchkit.cli.core.terminal import live_sinks

    limit, pause = seconds(duration), quantity(period, "time")
    with live_sinks(jsonl=jsonl, udp=udp) as sinks:
        log = _Log(output, rotate, replace, limit, pause if sinks else _CHECK_PERIOD, sinks)
        try:
            _follow(bench, log, effects)
        except KeyboardInterrupt as error:
            log.note_interrupt(error)
        except WinchkitError as error:
            if is_json():
                echo_json(log.result | {"problem": str(error)})
            raise
    for line in log.silences.summary:
        click.echo(f"winchkit: {line}", err=True)
    if is_json():
        echo_json(log.result)
    elif output and not jsonl:
        for file, rows in log.files.items():
            click.echo(f"{file}: {rows} rows")
        if log.files:
            suggest_next("log", "info", next(iter(log.files)))
    if log.terminated is not None:
        raise log.terminated
    if strict and log.silences.summary:
        context.exit(WinchkitError.exit_code)


def _follow(bench: str, log: _Log, effects: Sequence[str]) -> None:
    """Log at the owner of a bench, or the instruments of a bench that has only these."""
    from winchkit.bench.remote.session import watch
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    if not spec.cells:
        watch(bench, "log", log.follow, log.lose, effects)
        return
    if log.sinks:
        raise UsageError(
            f"bench '{spec.name}' has instruments only, of which there are no live pictures; leave "
            "out --jsonl and --udp, and name a file by -o"
        )
    from winchkit.bench.remote.cell_session import at_cell_station

    with at_cell_station(spec) as station:
        log.follow(station)


class _Silences:
    """Reports drives and instruments whose samples cease while a log is written."""

    def __init__(self) -> None:
        self._known: dict[str, dict[str, Any]] = {}

    def note(self, silent: dict[str, dict[str, Any]]) -> None:
        """Report what has changed of the silences, by source (``A.cell``)."""
        for name, found in silent.items():
            before = self._known.get(name, {"times": 0, "now": 0.0})
            if found["now"] and found["times"] > before["times"]:
                said = f"{name}: no sample for {found['now']:.1f} s; the log goes on without it"
                click.echo(f"winchkit: {said}", err=True)
            elif before["now"] and not found["now"]:
                click.echo(f"winchkit: {name}: samples again", err=True)
        self._known = silent

    @property
    def summary(self) -> list[str]:
        """A line for each that was silent at any time."""
        return [
            f"{name} was silent {found['times']} time{'s' * (found['times'] != 1)}, for "
            f"{found['longest']:.1f} s at most"
            + (f", and at the end of the log for {found['now']:.1f} s" if found["now"] else "")
            for name, found in self._known.items()
        ]


@dataclass
class _Log:
    """A log over the life of one or several owners of the bench, each of which writes a file."""

    _output: str | None
    _rotate: str | None
    _replace: bool
    _limit: float | None
    _pause: float
    sinks: list[LiveSink]
    files: dict[str, int] = field(default_factory=dict)
    """Rows by file."""
    terminated: Terminated | None = None
    """SIGTERM, SIGHUP or a closed terminal, where one has ended it; Ctrl-C is its usual end."""
    silences: _Silences = field(default_factory=_Silences)
    _counted: dict[str, dict[str, Any]] = field(default_factory=dict)
    _start: float = 0.0

    @property
    def result(self) -> dict[str, Any]:
        """Content of the log as JSON."""
        return {
            "schema": 1,
            "output": self._output,
            "files": self.files,
            "counters": self._counted,
            "rows": sum(self.files.values()),
        }

    def note_interrupt(self, error: KeyboardInterrupt) -> None:
        """The log ends by an interrupt."""
        self.terminated = error if isinstance(error, Terminated) else None
        click.echo("ending the log", err=True)

    def lose(self, words: str) -> None:
        """Report that an owner has gone."""
        goes_on = f"; the log goes on in {self._next()}" if self._output else ""
        click.echo(f"winchkit: {words}{goes_on}", err=True)

    def follow(self, station: Station | CellStation) -> None:
        """Log at an owner until the time is over, or Ctrl-C."""
        file = self._next()
        self._start = self._start or time.monotonic()
        if file:
            station.start_log(str(Path(file).absolute()), self._rotate, self._replace)
            self.files[file], self._replace = 0, False
        try:
            with _counter_row(station) as show:
                self._watch(station, file, show)
        except KeyboardInterrupt as error:
            self.note_interrupt(error)
        except WinchkitError:
            self._note_rows(station, file)
            raise
        self._note_counters(station)
        if file:
            self.files[file] = station.end_log()

    def _note_rows(self, station: Station | CellStation, file: str) -> None:
        """Counters and rows of a log that has failed, where its owner still answers."""
        with suppress(WinchkitError):
            self._note_counters(station)
            if file:
                self.files[file] = int(self._counted.get("log", {}).get("rows") or 0)

    def _note_counters(self, station: Station | CellStation) -> None:
        """Take what has been counted, and report who fell silent or is heard again."""
        self._counted = station.counters()
        self.silences.note(self._counted.get("log", {}).get("silent", {}))

    def _watch(self, station: Station | CellStation, file: str, show: Callable[[], None]) -> None:
        """Look after the log, and show every new picture, until the time is over."""
        seen = -1
        while self._limit is None or time.monotonic() - self._start < self._limit:
            time.sleep(min(self._pause, self._limit or self._pause))
            rows = station.log_rows()
            if file:
                self.files[file] = rows
                self._note_counters(station)
            status = station.status() if self.sinks else {"cycle": seen}
            if status["cycle"] != seen:
                seen = status["cycle"]
                for sink in self.sinks:
                    sink(status)
            show()

    def _next(self) -> str:
        """The file for the next owner: ``lift.csv``, then ``lift-2.csv`` and so on."""
        if not self._output or not self.files:
            return self._output or ""
        path, number = Path(self._output), len(self.files) + 1
        while True:
            following = path.with_stem(f"{path.stem}-{number}")
            if not _earlier(str(following)):
                return str(following)
            number += 1


def _earlier(output: str) -> list[Path]:
    """Existing files of an earlier log of that name, its parts included."""
    from winchkit.runs.recording.rotation import parts_beside

    path = Path(output)
    return [item for item in (path, *parts_beside(path)) if item.is_file()]


def _refuse_to_lose(output: str | None) -> None:
    """Raise UsageError where an earlier log would be written over."""
    held = [item for item in _earlier(output) if item.stat().st_size] if output else []
    if held:
        raise click.UsageError(
            f"{held[0]} contains a log already; name another file, or --replace."
        )


def _refuse(output: str | None, rotate: str | None, *, jsonl: bool, udp: str | None) -> None:
    """Raise UsageError for options that cannot be meant together, before anything is opened."""
    if not (output or jsonl or udp):
        raise click.UsageError("Missing option '-o' / '--output' (or '--jsonl', '--udp').")
    if jsonl and is_json():
        raise click.UsageError("'--jsonl' and '--json' both print to stdout; choose one.")
    if rotate is not None:
        from winchkit.runs.recording.rotation import Rotation

        try:
            Rotation.parse(rotate)
        except UsageError as error:
            raise UsageError(f"--rotate: {error}") from None


@contextmanager
def _counter_row(station: Station | CellStation) -> Iterator[Callable[[], None]]:
    """A live table of what is counted, where somebody sees it."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from winchkit.cli.core.terminal import counter_table, live_table

    shown = 0.0

    with live_table() as live:

        def show() -> None:
            nonlocal shown
            now = time.monotonic()
            if now - shown >= _SHOW_PERIOD:
                shown = now
                counted: dict[str, dict[str, Any]] = station.counters()
                live.update(counter_table(counted), refresh=True)

        yield show

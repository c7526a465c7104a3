"""What reaches a terminal: control characters of files and devices are escaped, once, here.

A name or a metadata value may hold an escape sequence that clears the screen, renames the window
or shows another text than is there. While a command runs, standard output and standard error are
:class:`EscapedStream`; what may steer the terminal writes to :func:`screen`.
"""

from __future__ import annotations

import io
import math
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO, cast

import click

from winchkit.arguments import ProgressCallback
from winchkit.cli.core.messages import detail, is_quiet, is_verbose
from winchkit.errors import one_line, printable

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.live import Live
    from rich.table import Table
    from rich.text import Text

    from winchkit.bench.recording.live_sinks import LiveSink


class EscapedStream:
    """A text stream that writes printable characters, line feeds and tabs only."""

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream
        """The stream itself: rich, which steers the terminal, asks for it by this name."""
        self.names: dict[str, str] = {}
        """Shown name of a file by its path, where that is a temporary one."""

    def write(self, text: str) -> int:
        """Write a text, its control characters as ``\\x1b``."""
        shown, stream = printable(text), self.rich_proxied_file
        for path, name in self.names.items():
            shown = shown.replace(path, name)
        try:
            return stream.write(shown)
        except UnicodeEncodeError as error:
            return stream.write(
                shown.encode(error.encoding, "backslashreplace").decode(error.encoding)
            )

    def writelines(self, lines: list[str]) -> None:
        """Write texts, their control characters as ``\\x1b``."""
        for line in lines:
            self.write(line)

    @property
    def buffer(self) -> io.BufferedIOBase:
        """Takes text as bytes in UTF-8, as click writes completions."""
        return _EscapedBytes(self)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)


class _EscapedBytes(io.BufferedIOBase):
    def __init__(self, text: EscapedStream) -> None:
        self._text = text

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        self._text.write(bytes(data).decode(errors="backslashreplace"))
        return len(data)

    def flush(self) -> None:
        self._text.rich_proxied_file.flush()


def screen(stream: TextIO | None = None) -> TextIO:
    """A stream that may steer the terminal; text of files must be ``printable`` before."""
    asked: TextIO = sys.stderr if stream is None else stream
    return getattr(asked, "rich_proxied_file", asked)


def terminal_console() -> Console:
    """A console of rich on standard error, not escaped: a live display would show its sequences."""
    from rich.console import Console

    return Console(file=screen())


class _AboveDisplay(EscapedStream):
    """A stream on the terminal of a live display, which is erased while a text is written."""

    def __init__(self, stream: EscapedStream, live: Live) -> None:
        super().__init__(stream.rich_proxied_file)
        self.names = stream.names
        self._live = live

    def write(self, text: str) -> int:
        """Write a text in place of the display, which is then drawn below it."""
        if not self._live.is_started:
            return super().write(text)
        kept, self._live.transient = self._live.transient, True
        self._live.stop()
        try:
            written = super().write(text)
            self.rich_proxied_file.flush()
        finally:
            self._live.transient = kept
            self._live.start(refresh=True)
        return written


@contextmanager
def live_display(live: Live) -> Iterator[None]:
    """Show a live display; text that is printed while it is shown appears above it.

    rich could redirect both streams itself, but click writes past it, into the display's line.
    """
    with escaped_output(), live:
        before = sys.stdout, sys.stderr
        sys.stdout, sys.stderr = (
            cast("TextIO", _AboveDisplay(stream, live))
            if isinstance(stream, EscapedStream) and stream.isatty()
            else stream
            for stream in before
        )
        try:
            yield
        finally:
            sys.stdout, sys.stderr = before


@contextmanager
def live_table(first: RenderableType = "", *, auto_refresh: bool = False) -> Iterator[Live]:
    """A live display on standard error, whose content the caller replaces; four times a second."""
    from rich.live import Live

    live = Live(
        first,
        console=terminal_console(),
        auto_refresh=auto_refresh,
        redirect_stdout=False,
        redirect_stderr=False,
    )
    with live_display(live):
        yield live


def cell(text: str) -> Text:
    """A text for a cell of a table of rich: in one line, printable, its brackets no markup."""
    from rich.text import Text

    return Text(one_line(text))


@contextmanager
def escaped_output() -> Iterator[None]:
    """Escape what is printed to standard output and standard error meanwhile."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (_escaped(stream) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _escaped(stream: object) -> TextIO:
    escaped = stream if isinstance(stream, EscapedStream) else EscapedStream(cast("TextIO", stream))
    return cast("TextIO", escaped)


UNKNOWN_LENGTH = "length unknown (home it)"
"""In place of a cable length that is not known."""


def status_line(status: dict[str, Any]) -> str:
    """Length (an instrument's as well), cable speed (pays out), tension and phase by winch."""
    parts = []
    for name, winch in status["winch"].items():
        known = winch["length_known"]
        text = f"{name}: " + (f"{_decimals(winch['cable_length'])} m" if known else UNKNOWN_LENGTH)
        if winch["length"] is not None:
            text += f" (measured {_decimals(winch['length'], 4)} m)"
        text += f" {_decimals(winch['cable_speed'])} m/s"
        if winch["load_tension"] is not None:
            text += f" {_decimals(winch['load_tension'], 1)} N"
        parts.append(f"{text} {winch['phase']}")
    return "  ".join(parts)


def unknown_length(status: dict[str, Any], winch: str) -> str:
    """Why the cable length of a winch is not known, by its warnings."""
    about = f"winch {winch}: the cable length is not known"
    found = [text for text in status["warnings"] if text.startswith(about)]
    return found[0] if found else f"{about}; home the winch"


def _decimals(value: float | None, digits: int = 3) -> str:
    return "—" if value is None else f"{value:.{digits}f}"


@contextmanager
def progress_bar() -> Iterator[ProgressCallback]:
    """A function for task and share done (0 to 1): a bar, lines with ``-v``; or None."""
    if is_verbose():
        yield _steps()
        return
    if is_quiet() or not sys.stderr.isatty():
        yield lambda what, share: None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (
        BarColumn(),
        TaskProgressColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("{task.description}", markup=False),
    )
    bar = Progress(
        *columns,
        console=terminal_console(),
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
    )
    with live_display(bar.live):
        task = bar.add_task("reading", total=None)

        def update(what: str, share: float | None) -> None:
            total = None if share is None else 1.0
            bar.update(task, description=one_line(what), total=total, completed=share)

        yield update


def _steps() -> ProgressCallback:
    """Report every new step as a line, as ``-v`` asks for."""
    last = ""

    def report(what: str, share: float | None) -> None:
        nonlocal last
        if what != last:
            detail(last := what)

    return report


@contextmanager
def live_sinks(*, jsonl: bool, udp: str | None) -> Iterator[list[LiveSink]]:
    """The sinks that were asked for; says at the end what could not be sent."""
    from winchkit.bench.recording.live_sinks import JsonLines, UdpJson

    datagrams = None if udp is None else UdpJson(udp, time.time)
    sinks: list[LiveSink] = [JsonLines(sys.stdout)] if jsonl else []
    try:
        yield sinks if datagrams is None else [*sinks, datagrams]
    finally:
        if datagrams is not None:
            datagrams.close()
            if datagrams.dropped:
                click.echo(f"{udp}: {datagrams.dropped} pictures could not be sent", err=True)


HEADS: dict[str, tuple[str, str]] = {
    "rate": ("Hz", "rate in Hz"),
    "readings": ("read", "readings"),
    "drops": ("drop", "drops"),
    "duplicates": ("dup", "duplicates"),
    "crc": ("CRC", "CRC errors"),
    "timeouts": ("t/o", "timeouts"),
    "late": ("late", "late replies"),
    "resynchronised": ("sync", "resynchronised bytes"),
    "reconnects": ("recon", "reconnects"),
    "latency": ("p50/p99/max ms", "latency p50/p99/max in ms"),
}
"""Short head and full words by counter."""
_LOG = "log"


def counter_rows(counters: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """A row of texts per instrument, in the order of :data:`HEADS` after the name."""
    return [
        [name, *(_text(key, counted.get(key)) for key in HEADS)]
        for name, counted in counters.items()
        if name != _LOG
    ]


def counter_table(counters: Mapping[str, Mapping[str, Any]]) -> Table:
    """All of them, with the log itself below."""
    from rich.table import Table

    log = counters.get(_LOG, {})
    table = Table(
        box=None,
        caption=", ".join(f"{k} {v}" for k, v in log.items() if not isinstance(v, dict)) or None,
    )
    table.add_column("instrument")
    for head, _ in HEADS.values():
        table.add_column(head, justify="right", no_wrap=True)
    for row in counter_rows(counters):
        table.add_row(*map(cell, row))
    return table


def _text(key: str, value: Any) -> str:
    if key == "latency":
        times = (value or {}).values()
        return "/".join(_number(item, 1e3) for item in times) if times else "—"
    if key == "rate":
        return _number(value, 1.0)
    return "—" if value is None else str(value)


def _number(value: float | None, factor: float) -> str:
    return "—" if value is None or math.isnan(value) else f"{value * factor:.3g}"

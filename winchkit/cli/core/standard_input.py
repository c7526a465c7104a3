"""Files that a command reads: by name, or ``-`` for standard input.

The readers take files (a run is read in several passes, and by its suffix), so that standard input
is copied into a temporary file, which is deleted when the command ends. Messages name it ``-``.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click
from click.shell_completion import CompletionItem

from winchkit.cli.core.completion import Completer
from winchkit.cli.core.messages import COPY_OF_INPUT, note
from winchkit.cli.core.output import is_json
from winchkit.cli.core.terminal import EscapedStream

_MAGIC = (
    (b"\x89MCAP", ".mcap"),
    (b"\x89HDF", ".h5"),
    (b"MATLAB 5.0", ".mat"),
    (b"\x93NUMPY", ".npy"),
    (b"PAR1", ".parquet"),
    (b"MDF ", ".mf4"),
    (b"PK", ".xlsx"),
)
"""First bytes of the formats that are no text."""
_TEXT = (
    (rb"(?m)^\s*(schema|kind)\s*=", ".toml"),
    (rb"(?mi)^\s*\[(FileInfo|DeviceInfo)\]", ".dcf"),
    (rb"\A\s*\{", ".json"),
)
_HEAD = 4000
"""Bytes by which the format is recognised; the header of every format is shorter."""


def forget_typed() -> None:
    """Drop what was typed on the terminal before a question is shown: it is no answer to it."""
    if not sys.stdin.isatty():
        return
    if sys.platform == "win32":
        import msvcrt

        while msvcrt.kbhit():
            msvcrt.getwch()
        return
    import termios

    termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)


def may_ask() -> bool:
    """Whether an answer can be typed: a terminal, and no JSON is asked for."""
    return not is_json() and sys.stdin.isatty() and sys.stderr.isatty()


class Readable(click.ParamType):  # type: ignore[type-arg]
    """A file to read, or standard input."""

    def __init__(self, what: str, complete: Completer | None = None) -> None:
        self.name = what
        self._complete = complete

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The name of the file; for ``-`` that of a copy of standard input."""
        if value != "-" or ctx is None or ctx.resilient_parsing:
            return value
        return _copied(ctx, self.name)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Completions for the shell."""
        if self._complete is None:
            return [CompletionItem(incomplete, type="file")]
        return self._complete(ctx, param, incomplete)


def is_standard_input(path: object) -> bool:
    """Whether a path is the copy of standard input."""
    context = click.get_current_context(silent=True)
    return context is not None and str(path) == context.meta.get(COPY_OF_INPUT)


def _copied(ctx: click.Context, what: str) -> str:
    """Copy standard input into a file; raises UsageError for a second time, or for nothing."""
    if COPY_OF_INPUT in ctx.meta:
        raise click.UsageError("'-' stands for standard input, which can be read once.", ctx)
    stream = sys.stdin.buffer
    if sys.stdin.isatty():
        note(f"reading the {what} from the terminal; Ctrl-D ends it")
    data = stream.read()
    if not data.strip():
        raise click.UsageError(f"'-': standard input is empty; it should hold the {what}.", ctx)
    folder = ctx.find_root().with_resource(TemporaryDirectory(prefix="winchkit-"))
    path = Path(folder) / f"stdin{_suffix(data[:_HEAD])}"
    path.write_bytes(data)
    ctx.meta[COPY_OF_INPUT] = str(path)
    for shown in (sys.stdout, sys.stderr):
        if isinstance(shown, EscapedStream):
            shown.names[str(path)] = "-"
    return str(path)


def _suffix(head: bytes) -> str:
    """Suffix of the format, by the first bytes."""
    for magic, suffix in _MAGIC:
        if head.startswith(magic):
            return suffix
    return next((suffix for pattern, suffix in _TEXT if re.search(pattern, head)), ".csv")

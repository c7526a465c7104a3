"""What reaches a terminal: control characters of files and devices are escaped, once, here.

A name or a metadata value may hold an escape sequence that clears the screen, renames the window
or shows another text than is there. While a command runs, standard output and standard error are
:class:`EscapedStream`; what may steer the terminal writes to :func:`screen`.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO, cast

from winchkit.errors import one_line, printable

if TYPE_CHECKING:
    from rich.text import Text

__all__ = ["EscapedStream", "cell", "escaped_output", "screen"]


class EscapedStream:
    """A text stream that writes printable characters, line feeds and tabs only."""

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream
        """The stream itself: rich, which steers the terminal, asks for it by this name."""

    def write(self, text: str) -> int:
        """Write a text, its control characters as ``\\x1b``."""
        shown, stream = printable(text), self.rich_proxied_file
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
    """A stream that may steer the terminal: standard error, or the one that is given.

    What is written to it from a file or a device has to be :func:`~winchkit.errors.printable`.
    """
    asked: TextIO = sys.stderr if stream is None else stream
    return getattr(asked, "rich_proxied_file", asked)


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

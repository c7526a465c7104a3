"""Turns the bytes of a CSV file into lines, whichever program wrote them."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from pathlib import Path

from winchkit.errors import Fault, RunError
from winchkit.regular_file import regular
from winchkit.runs.recording.log_file import is_written

__all__ = ["cut_off", "read_bytes", "read_lines"]

_PIECE = 1 << 20


def read_bytes(path: Path, *, may_be_empty: bool = False) -> bytes:
    """Content of a file; raises RunError where there is none to read."""
    try:
        with open(path, "rb", opener=regular) as file:
            data = file.read()
    except FileNotFoundError:
        raise RunError(Fault("there is no such file", str(path))) from None
    except IsADirectoryError:
        raise RunError(Fault("is a directory, not a run", str(path))) from None
    except OSError as error:
        raise RunError(Fault(f"cannot be read: {error.strerror}", str(path))) from None
    except ValueError as error:
        raise RunError(Fault(f"is no usable file name: {error}", repr(str(path)))) from None
    if not data and not may_be_empty:
        raise RunError(Fault("the file is empty", str(path)))
    return data


def cut_off(path: str, whole: str) -> str:
    """What is said of a log without its end, of which something whole was read."""
    if is_written(Path(path)):
        return f"the log is still being written; its {whole} so far are read"
    return (
        f"the file is cut off; its {whole} are read, what follows is left out "
        f"(`winchkit log recover {path}` writes a whole file)"
    )


def read_lines(path: Path) -> Iterator[str]:
    """Lines of a text file in UTF-8, UTF-16 with its mark, or Windows-1252, one after another.

    Each has its line feed, but for a last line that the file ends without one.
    The file is gone through twice and never held whole: an hour of eight winches is gigabytes.
    """
    encoding = _encoding(path)
    with open(path, encoding=encoding, opener=regular) as file:
        yield from file


def _encoding(path: Path) -> str:
    """The first encoding in which all of a file reads; raises RunError where it is no text."""
    marked = _beginning(path).startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        try:
            is_text = _holds_no_zero(path, encoding)
        except UnicodeDecodeError:
            continue
        if not is_text:
            raise RunError(Fault("is a binary file, not CSV text", str(path)))
        return encoding
    raise RunError(Fault("is not a text file; save it as CSV in UTF-8", str(path)))


def _holds_no_zero(path: Path, encoding: str) -> bool:
    with open(path, encoding=encoding, opener=regular) as file:
        return not any("\0" in piece for piece in iter(lambda: file.read(_PIECE), ""))


def _beginning(path: Path) -> bytes:
    """First bytes of a file; raises RunError where there is none to read."""
    try:
        with open(path, "rb", opener=regular) as file:
            data = file.read(4)
    except (OSError, ValueError):
        return read_bytes(path)
    return data or read_bytes(path)

"""Opening of regular files only, as a FIFO may block without end; none is replaced unasked."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from winchkit.errors import Fault, FileError, UsageError

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a FIFO",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a character device",
    stat.S_IFBLK: "a block device",
}


def regular(path: str | os.PathLike[str], flags: int = os.O_RDONLY) -> int:
    """Open a regular file and return its descriptor: an ``opener`` for the built-in ``open``.

    Raises OSError as ``os.open`` does; for anything but a regular file its ``strerror`` names the
    kind of file, and nothing is opened.
    """
    try:
        _require_regular(os.stat(path).st_mode, path)
    except FileNotFoundError:
        if not flags & os.O_CREAT:
            raise
    descriptor = os.open(path, flags | getattr(os, "O_NONBLOCK", 0), 0o666)
    try:
        _require_regular(os.fstat(descriptor).st_mode, path)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


@contextmanager
def file_errors(path: str | os.PathLike[str], what: str = "written") -> Iterator[None]:
    """Raise FileError, with the reason of the system, where a file cannot be ``what``."""
    try:
        yield
    except OSError as error:
        raise FileError(Fault(f"cannot be {what}: {error.strerror}", os.fspath(path))) from error


def refuse_existing(target: Path, replace: bool) -> None:
    """Raise UsageError where ``target`` exists and is not to be replaced."""
    if target.exists() and not replace:
        raise UsageError(
            f"{target} exists already; name another file, or write over it "
            "(--replace, in Python replace=True)"
        )


def read_text(path: str | os.PathLike[str], encoding: str = "utf-8") -> str:
    """Text of a regular file; raises OSError, UnicodeDecodeError."""
    with open(path, encoding=encoding, opener=regular) as file:
        return file.read()


def read_whole(
    path: Path, what: str, largest: int | None = None, error: type[FileError] = FileError
) -> bytes:
    """Content of a regular file, at most ``largest`` and one bytes; else raises ``error``."""
    try:
        with open(path, "rb", opener=regular) as file:
            return file.read() if largest is None else file.read(largest + 1)
    except FileNotFoundError:
        raise error(Fault("there is no such file", str(path))) from None
    except IsADirectoryError:
        raise error(Fault(f"is a folder; name a {what} in it", str(path))) from None
    except OSError as reason:
        raise error(Fault(f"cannot be read: {reason.strerror}", str(path))) from None
    except ValueError as reason:
        raise error(Fault(f"is not a usable file name: {reason}", repr(str(path)))) from None


def file_kind(mode: int) -> str:
    """Description of a file's kind from its ``st_mode``; empty for a regular file."""
    return "" if stat.S_ISREG(mode) else _KINDS.get(stat.S_IFMT(mode), "a special file")


def _require_regular(mode: int, path: str | os.PathLike[str]) -> None:
    if kind := file_kind(mode):
        number = errno.EISDIR if stat.S_ISDIR(mode) else errno.EINVAL
        raise OSError(number, f"it is {kind}, not a regular file", os.fspath(path))

"""Exclusive creation of the files of logs, which are locked while they are written.

The lock (flock; on Windows msvcrt) belongs to the open file. It is effective for every other name
of the file (symbolic links, hard links, other spellings), in this process and in others, and ends
with the process. Another writer of a locked file is refused.
"""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from enum import Enum, auto
from pathlib import Path
from typing import BinaryIO

from winchkit.errors import Fault, FileError, UsageError
from winchkit.regular_file import file_errors, regular
from winchkit.runs.recording.rotation import parts_beside

_BUFFER = 1 << 20
"""Bytes: one write per second or less at the rates of a bench."""
_PATIENCE = 2.0
"""Longest wait for another process that starts a log in the same folder, s."""
_FAR = 1 << 62
"""Position of the byte that Windows locks, beyond those of readers."""
_PART = re.compile(r"(.+)\.\d{3,}")


class Lock(Enum):
    """Result of locking a file."""

    HELD = auto()
    BUSY = auto()
    UNSUPPORTED = auto()
    """The file system has no locks, e.g. some network shares."""


def create(path: Path, *, replace: bool) -> BinaryIO:
    """Create and lock a file that is empty or may be replaced; raises UsageError, FileError."""
    place = Path(os.path.realpath(path))
    with file_errors(path):
        return _created(place, path, replace=replace)


def begin_log(path: Path, first: Path, *, replace: bool) -> BinaryIO:
    """Create the first file of the log ``path``: ``path`` itself, or part 1 of a log in parts.

    Earlier files of that log are removed with ``replace``, since they would be read as parts of the
    new one. Raises UsageError, without any change, where one is being written or is to be kept;
    FileError where a file cannot be removed or written.
    """
    with _folder_locked(path.parent), ExitStack() as held:
        earlier = [item for item in (path, *parts_beside(path)) if os.path.lexists(item)]
        for item in earlier:
            _hold(item, held, replace=replace)
        if replace and path.exists() and (part := _PART.fullmatch(path.stem)):
            refuse_written(parts_beside(path.with_name(part[1] + path.suffix)))
        if sys.platform == "win32":
            held.close()  # an open file cannot be removed there
        for item in earlier:
            if item != first:
                with file_errors(item, "replaced"):
                    item.unlink()
        held.close()
        return create(first, replace=replace)


def refuse_written(paths: Sequence[Path]) -> None:
    """Raise UsageError where one of these files is being written by a log."""
    for path in paths:
        if is_written(path):
            raise _being_written(path)


def is_written(path: Path) -> bool:
    """Whether a log is being written to a file; False where that is unknown."""
    try:
        descriptor = regular(path)
    except OSError:
        return False
    try:
        return lock_file(descriptor) is Lock.BUSY
    finally:
        os.close(descriptor)


def require_in_place(path: Path, stream: BinaryIO, size: int) -> None:
    """Raise FileError where a file that is being written was removed, replaced or truncated."""
    own = os.fstat(stream.fileno())
    try:
        found = path.stat()
        lost = "replaced" if (found.st_ino, found.st_dev) != (own.st_ino, own.st_dev) else ""
    except OSError:
        lost = "removed"
    if not lost and own.st_size < size:
        lost = "cut off"
    if lost:
        message = f"was {lost} by another program while it was written; the log has ended"
        raise FileError(Fault(message, str(path)))


def _created(place: Path, path: Path, *, replace: bool) -> BinaryIO:
    flags = os.O_RDWR | getattr(os, "O_BINARY", 0)
    is_new = True
    try:
        descriptor = os.open(place, flags | os.O_CREAT | os.O_EXCL, 0o666)
    except FileExistsError:
        descriptor, is_new = regular(place, flags), False
    try:
        _require_free(descriptor, path, replace=replace, is_new=is_new)
        _require_same(descriptor, place, path)
        os.ftruncate(descriptor, 0)
        return os.fdopen(descriptor, "wb", buffering=_BUFFER)
    except BaseException:
        os.close(descriptor)
        raise


def _hold(item: Path, held: ExitStack, *, replace: bool) -> None:
    """Lock an earlier file of a log until ``held`` is closed; raises where it must not be lost."""
    try:
        descriptor = regular(item)
    except FileNotFoundError:
        return
    except OSError as error:
        raise FileError(Fault(f"cannot be written: {error.strerror}", str(item))) from None
    held.callback(os.close, descriptor)
    _require_free(descriptor, item, replace=replace)


def _require_free(descriptor: int, path: Path, *, replace: bool, is_new: bool = False) -> None:
    """Lock an open file; raises UsageError where a log would be lost by writing to it."""
    lock = lock_file(descriptor)
    if lock is Lock.BUSY:
        raise _being_written(path)
    if os.fstat(descriptor).st_size and not replace:
        raise UsageError(
            f"{path} contains a log already; name another file, or replace it "
            "(--replace, in Python replace=True)"
        )
    if lock is Lock.UNSUPPORTED and not is_new:
        raise UsageError(
            f"{path}: its file system has no locks, so that another writer cannot be detected; "
            "name another file"
        )


def _require_same(descriptor: int, place: Path, path: Path) -> None:
    """Raise UsageError where another program has put another file in an open file's place."""
    try:
        same = os.path.samestat(os.fstat(descriptor), place.stat())
    except FileNotFoundError:
        same = False
    if not same:
        raise _being_written(path)


def lock_file(descriptor: int) -> Lock:
    """Lock a file exclusively if it is free; the system releases it with the last descriptor."""
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(descriptor, _FAR, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            os.lseek(descriptor, 0, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return Lock.BUSY
    except OSError:
        return Lock.UNSUPPORTED
    return Lock.HELD


@contextmanager
def _folder_locked(folder: Path) -> Iterator[None]:
    """Lock a folder, where the system can: a log in one file and one in parts may have one name."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:
        yield
        return
    try:
        deadline = time.monotonic() + _PATIENCE
        while lock_file(descriptor) is Lock.BUSY and time.monotonic() < deadline:
            time.sleep(0.005)
        yield
    finally:
        os.close(descriptor)


def _being_written(path: Path) -> UsageError:
    return UsageError(f"{path}: another log is being written to it; name another file")

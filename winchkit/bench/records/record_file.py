"""A small file beside the bench file that is overwritten in place, from the control thread too.

Written at once and in place, so that a full disk, a missing directory entry or a short write cannot
lose what it says; what a power failure leaves half written cannot be read, and counts as the worst
case. A new file has its name only when it is complete and on the disk (:meth:`replace`).
"""

from __future__ import annotations

import os
import stat
import sys
import threading
from contextlib import suppress

_PAGE = 4096
"""Bytes: a record grows by whole pages, padded with spaces."""
_FLAGS = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_CLOEXEC", "O_NONBLOCK", "O_BINARY"))


class RecordFile:
    """One record, of text; every method but :meth:`close` raises OSError."""

    def __init__(self, path: str) -> None:
        """Take the path; the file is opened later."""
        self.path = path
        self.size = 2 * _PAGE
        self._descriptor: int | None = None
        self._lock = threading.Lock()

    @property
    def is_open(self) -> bool:
        """Whether it can be written in place."""
        return self._descriptor is not None

    def open(self, empty: str) -> bytes:
        """Open it, made with the record ``empty`` where there is none; returns what it holds."""
        if not os.path.lexists(self.path):
            self._create(empty)
        self._descriptor = os.open(self.path, os.O_RDWR | _FLAGS)
        status = os.fstat(self._descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(22, "it is no regular file")
        self.size = max(self.size, -(-status.st_size // _PAGE) * _PAGE)
        return os.read(self._descriptor, self.size)

    def write(self, text: str) -> None:
        """Overwrite it in place, into the page cache; the disk is waited for by another thread."""
        with self._lock:
            if self._descriptor is None:
                raise OSError(9, "it could not be opened")
            data = self._padded(text)
            os.lseek(self._descriptor, 0, os.SEEK_SET)
            _write(self._descriptor, data)
            if not self._in_place(self._descriptor):
                # Somebody removed or replaced the file: a later process reads what has its name.
                self._replace(text)
        threading.Thread(target=self._flush, name="record", daemon=True).start()

    def replace(self, text: str) -> None:
        """Write another file, complete and on the disk before it has the name; opens it."""
        with self._lock:
            self._replace(text)

    def close(self, *, remove: bool = False) -> None:
        """Close the file, and remove it where asked to."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is None:
            return
        os.close(descriptor)
        if remove:
            with suppress(OSError):
                os.unlink(self.path)

    def _replace(self, text: str) -> None:
        self._create(text)
        before, self._descriptor = self._descriptor, os.open(self.path, os.O_RDWR | _FLAGS)
        if before is not None:
            os.close(before)

    def _create(self, text: str) -> None:
        data, draft = self._padded(text), f"{self.path}.{os.getpid()}"
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | _FLAGS, 0o644)
        try:
            _write(descriptor, data)
            os.fsync(descriptor)
        except OSError:
            os.unlink(draft)
            raise
        finally:
            os.close(descriptor)
        if sys.platform == "win32":
            self.close()  # an open file cannot be replaced there
        os.replace(draft, self.path)
        _sync_folder(os.path.dirname(self.path) or ".")

    def _in_place(self, descriptor: int) -> bool:
        """Whether the open file is the one that has the name."""
        try:
            named = os.stat(self.path, follow_symlinks=False)
        except FileNotFoundError:
            return False
        return os.path.samestat(named, os.fstat(descriptor))

    def _padded(self, text: str) -> bytes:
        data = text.encode()
        self.size = max(self.size, -(-(len(data) + 1) // _PAGE) * _PAGE)
        return data.ljust(self.size - 1) + b"\n"

    def _flush(self) -> None:
        descriptor = self._descriptor
        if descriptor is not None:
            with suppress(OSError):
                os.fsync(descriptor)


def _write(descriptor: int, data: bytes) -> None:
    if os.write(descriptor, data) != len(data):
        raise OSError(28, "no space left on the device")


def _sync_folder(folder: str) -> None:
    """Have the new name on the disk too, where folders can be opened."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

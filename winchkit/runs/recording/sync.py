"""fsync of files on a separate thread, for which neither the writer nor a control loop waits."""

from __future__ import annotations

import errno
import os
import threading

SYNC_PERIOD = 0.8
"""Period of fsync, s: written data reach the disk within a second."""
_CANNOT = (errno.EINVAL, errno.ENOTSUP, errno.EROFS)
"""Errors of fsync on a pipe or a device, which need no sync."""


class Syncer:
    """Calls fsync periodically for the current file."""

    def __init__(self) -> None:
        self.error: OSError | None = None
        """First error of fsync, after which no file is synced."""
        self._lock = threading.Lock()
        self._watched: int | None = None
        self._finished: list[int] = []
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder sync", daemon=True)
        self._thread.start()

    def watch(self, descriptor: int) -> None:
        """Sync this file from now on, and the previous one once more."""
        with self._lock:
            self._release()
            self._watched = os.dup(descriptor)

    def close(self) -> None:
        """Sync a last time and end."""
        with self._lock:
            self._release()
        self._stopping.set()
        self._thread.join()

    def _release(self) -> None:
        if self._watched is not None:
            self._finished.append(self._watched)
            self._watched = None

    def _run(self) -> None:
        ending = False
        while not ending:
            ending = self._stopping.wait(SYNC_PERIOD)
            with self._lock:
                finished, self._finished = self._finished, []
                current = [] if self._watched is None else [os.dup(self._watched)]
            for descriptor in (*finished, *current):
                self._sync(descriptor)

    def _sync(self, descriptor: int) -> None:
        try:
            os.fsync(descriptor)
        except OSError as error:
            if error.errno not in _CANNOT:
                self.error = error
        finally:
            os.close(descriptor)

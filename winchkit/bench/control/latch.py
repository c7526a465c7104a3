"""The latch file: trips and lost positions, kept beyond the end of the process.

It is kept beside the bench file (``bench.toml`` -> ``bench.trip.json``) from opening on. Its record
has a fixed size and is overwritten in place, so that a full disk, a missing directory entry or a
short write cannot lose a trip: what cannot be read counts as latched. A position is lost to a later
process where the drive's counter 6064h has left its range, or may have. A bench that was closed
without a trip and with every position leaves no file.
"""

from __future__ import annotations

import json
import os
import stat
import threading
from collections.abc import Collection, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from winchkit.bench.control.snapshot import Trip
from winchkit.errors import NotPermitted

__all__ = ["LatchFile"]

_SIZE = 8192
"""Bytes of a record, padded with spaces: written at once, in place."""
_MOST = 16
"""Trips in a record; the first ones name the cause."""
_LONGEST = 300
"""Characters of a message in the record."""
_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0)


class LatchFile:
    """Keeps the trips of one bench on disk; without a path it keeps nothing."""

    def __init__(self, path: str) -> None:
        """Take the path; the file is opened later."""
        self.path = path
        self._descriptor: int | None = None
        self._since: dict[tuple[str, str], str] = {}
        self._latched = False
        self.lost: frozenset[str] = frozenset()
        """Winches whose position is not that of the drive's counter."""

    def open(self) -> tuple[Trip, ...]:
        """Trips that an earlier process latched; a file that cannot be used is one, too."""
        if not self.path:
            return ()
        try:
            if not os.path.lexists(self.path):
                self._create()
            self._descriptor = os.open(self.path, os.O_RDWR | _FLAGS)
            if not stat.S_ISREG(os.fstat(self._descriptor).st_mode):
                return (self._unusable("it is no regular file"),)
            trips = self._parse(os.read(self._descriptor, _SIZE + 1))
        except OSError as error:
            return (self._unusable(error.strerror or str(error)),)
        except (ValueError, KeyError, TypeError):
            return (self._unusable("it holds no record of trips"),)
        self._latched = bool(trips)
        return trips

    def keep(self, trips: Sequence[Trip], lost: Collection[str] = ()) -> Trip | None:
        """Write trips and lost positions; returns a trip with the reason where it cannot.

        Called on the control thread: one write of a fixed size into the page cache. The disk is
        waited for by a thread of its own.
        """
        self.lost = frozenset(lost)
        if not self.path:
            return None
        self._latched = self._latched or bool(trips)
        try:
            self._write(trips)
        except OSError as error:
            return self._unusable(error.strerror or str(error))
        threading.Thread(target=self._flush, name="latch", daemon=True).start()
        return None

    def clear(self) -> None:
        """Write an empty latch; raises NotPermitted where that is not possible.

        Lost positions stay: only homing finds them.
        """
        if not self.path:
            return
        self._since.clear()
        try:
            if self._descriptor is None:
                Path(self.path).unlink(missing_ok=True)
                self._create()
                self._descriptor = os.open(self.path, os.O_RDWR | _FLAGS)
            self._write(())
            os.fsync(self._descriptor)
        except OSError as error:
            raise NotPermitted(str(self._unusable(error.strerror or str(error)))) from error
        self._latched = False

    def close(self) -> None:
        """Close the file; one without a trip or a lost position is removed."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is None:
            return
        if not self._latched and not self.lost:
            with suppress(OSError):
                os.unlink(self.path)
        os.close(descriptor)

    def _in_place(self) -> bool:
        """Whether the open file is the one that has the name."""
        assert self._descriptor is not None, "the caller has looked"
        try:
            named = os.stat(self.path, follow_symlinks=False)
        except FileNotFoundError:
            return False
        return os.path.samestat(named, os.fstat(self._descriptor))

    def _create(self, rows: Sequence[dict[str, str]] = ()) -> None:
        """Make the file with a record, complete before it has its name."""
        draft = f"{self.path}.{os.getpid()}"
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | _FLAGS, 0o644)
        try:
            if os.write(descriptor, _record(rows, self.lost)) != _SIZE:
                raise OSError(28, "no space left on the device")
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        os.replace(draft, self.path)

    def _write(self, trips: Sequence[Trip]) -> None:
        if self._descriptor is None:
            raise OSError(9, "it could not be opened")
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        rows = [
            {
                "time": self._since.setdefault((trip.kind, trip.winch), now),
                "winch": trip.winch,
                "kind": trip.kind,
                "message": trip.message[:_LONGEST],
            }
            for trip in trips[:_MOST]
        ]
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        if os.write(self._descriptor, _record(rows, self.lost)) != _SIZE:
            raise OSError(28, "no space left on the device")
        if not self._in_place():
            # Somebody removed or replaced the file: a later process reads what has its name.
            self._create(rows)
            os.close(self._descriptor)
            self._descriptor = os.open(self.path, os.O_RDWR | _FLAGS)

    def _parse(self, data: bytes) -> tuple[Trip, ...]:
        """Trips of a record; raises ValueError, KeyError, TypeError for anything else."""
        record = json.loads(data)
        if record["schema"] != 1 or len(data) != _SIZE:
            raise ValueError("unknown schema")
        lost = record.get("positions_lost", [])
        if not isinstance(lost, list):
            raise TypeError("positions_lost is no list")
        self.lost = frozenset(map(str, lost))
        trips = []
        for row in record["tripped"]:
            kind, winch, since = str(row["kind"]), str(row["winch"]), str(row["time"])
            self._since[kind, winch] = since
            note = f" (latched {since})"
            message = str(row["message"]).removesuffix(note) + note
            trips.append(Trip(kind, winch, message, latches=True))
        return tuple(trips)

    def _unusable(self, reason: str) -> Trip:
        self._latched = True
        return Trip(
            "latch file",
            "",
            f"{self.path}: {reason}; what cannot be kept or read counts as tripped: look at the "
            "winches, make the file and its folder writable, then reset",
            latches=True,
        )

    def _flush(self) -> None:
        descriptor = self._descriptor
        if descriptor is not None:
            with suppress(OSError):
                os.fsync(descriptor)


def _record(rows: Sequence[dict[str, str]], lost: Collection[str]) -> bytes:
    """A record of exactly ``_SIZE`` bytes; the first trips stay where not all fit."""
    content = {"schema": 1, "tripped": list(rows), "positions_lost": sorted(lost)}
    text = json.dumps(content, indent=1).encode()
    if len(text) >= _SIZE and rows:
        return _record(rows[:-1], lost)
    return text.ljust(_SIZE - 1) + b"\n"

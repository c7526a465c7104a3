"""The latch file: trips, kept beyond the end of the process.

It is kept beside the bench file (``bench.toml`` -> ``bench.trip.json``) from opening on: what
cannot be read counts as latched. A bench that was closed without a trip leaves no file.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from winchkit.bench.control.snapshot import Trip
from winchkit.bench.records.record_file import RecordFile
from winchkit.errors import NotPermitted

_SIZE = 8192
"""Bytes of a record."""
_MOST = 16
"""Trips in a record; the first ones name the cause."""
_LONGEST = 300
"""Characters of a message in the record."""


class LatchFile:
    """Keeps the trips of one bench on disk; without a path it keeps nothing."""

    def __init__(self, path: str) -> None:
        """Take the path; the file is opened later."""
        self.path = path
        self._file = RecordFile(path)
        self._since: dict[tuple[str, str], str] = {}
        self._latched = False

    def open(self) -> tuple[Trip, ...]:
        """Trips that an earlier process latched; a file that cannot be used is one, too."""
        if not self.path:
            return ()
        try:
            trips = self._parse(self._file.open(_record(())))
        except OSError as error:
            return (self._unusable(error.strerror or str(error)),)
        except (ValueError, KeyError, TypeError):
            return (self._unusable("it holds no record of trips"),)
        self._latched = bool(trips)
        return trips

    def keep(self, trips: Sequence[Trip]) -> Trip | None:
        """Write the trips, on the control thread; returns a trip where it cannot."""
        if not self.path:
            return None
        self._latched = self._latched or bool(trips)
        try:
            self._file.write(_record(self._rows(trips)))
        except OSError as error:
            return self._unusable(error.strerror or str(error))
        return None

    def clear(self) -> None:
        """Write an empty latch to the disk; raises NotPermitted where that is not possible."""
        if not self.path:
            return
        self._since.clear()
        try:
            if not self._file.is_open:
                Path(self.path).unlink(missing_ok=True)
            self._file.replace(_record(()))
        except OSError as error:
            raise NotPermitted(str(self._unusable(error.strerror or str(error)))) from error
        self._latched = False

    def close(self) -> None:
        """Close the file; one without a trip is removed."""
        self._file.close(remove=not self._latched)

    def _rows(self, trips: Sequence[Trip]) -> list[dict[str, str]]:
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        return [
            {
                "time": self._since.setdefault((trip.kind, trip.winch), now),
                "winch": trip.winch,
                "kind": trip.kind,
                "message": trip.message[:_LONGEST],
            }
            for trip in trips[:_MOST]
        ]

    def _parse(self, data: bytes) -> tuple[Trip, ...]:
        """Trips of a record; raises ValueError, KeyError, TypeError for anything else."""
        record = json.loads(data)
        if record["schema"] != 1 or len(data) != _SIZE:
            raise ValueError("unknown schema")
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


def _record(rows: Sequence[dict[str, str]]) -> str:
    """A record of fewer than ``_SIZE`` bytes; the first trips stay where not all fit."""
    text = json.dumps({"schema": 1, "tripped": list(rows)}, indent=1)
    if len(text.encode()) >= _SIZE and rows:
        return _record(rows[:-1])
    return text

"""The record of positions: where each drive stood when it was disabled, for later processes.

It is kept beside the bench file (``bench.toml`` -> ``bench.position.json``). The entry of a winch
is open from the command to enable its drive until that is disabled, at rest; it is closed before
the bench lets the drive go. An entry that was not closed is of a process that ended in motion, or
whose drive did not say, when the bench was closed, that it is disabled.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from winchkit.bench.control.snapshot import Trip
from winchkit.bench.records.record_file import RecordFile
from winchkit.drivers.can.cia402.motor_position import KeptPosition

_KILLED = (
    "the process that moved it ended in motion: it was killed, or its computer failed; its record "
    "was not closed"
)
_UNDECIDED = "its drive did not say, when the bench was closed, that it is disabled"
_MOVE_ON = "look at the winches, make the file and its folder writable, then reset"


class PositionFile:
    """Keeps the positions of one bench on disk; without a path it keeps nothing."""

    def __init__(self, path: str) -> None:
        """Take the path; the file is opened later."""
        self.path = path
        self.found: dict[str, KeptPosition] = {}
        """Position of each winch as an earlier process left it."""
        self._file = RecordFile(path)

    def open(self) -> tuple[Trip, ...]:
        """Read what an earlier process left; returns trips: what ended in motion, what fails."""
        if not self.path:
            return ()
        try:
            data = self._file.open(_record({}, ended=True))
        except OSError as error:
            return (self._unusable(error.strerror or str(error)),)
        try:
            since, ended, self.found = _parse(data)
        except (ValueError, KeyError, TypeError):
            # As after a power failure while it was written: no position is trusted.
            return (self._unusable("it holds no record of positions"),)
        return tuple(
            Trip(
                "owner",
                name,
                f"{_UNDECIDED if ended else _KILLED} (record of {since}); look at the winch and "
                "its load, then reset",
                latches=True,
            )
            for name, kept in self.found.items()
            if not kept.closed
        )

    def keep(self, positions: Mapping[str, KeptPosition]) -> Trip | None:
        """Write the positions, on the control thread; returns a trip where it cannot."""
        return self._write(positions, closing=False)

    def close_with(self, positions: Mapping[str, KeptPosition]) -> None:
        """Write the positions to the disk, before the drives are released.

        One that cannot be written leaves the one before, which no drive agrees with that has moved.
        """
        self._write(positions, closing=True)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, positions: Mapping[str, KeptPosition], *, closing: bool) -> Trip | None:
        if not self.path:
            return None
        write = self._file.replace if closing else self._file.write
        # A winch that has not answered yet keeps its entry.
        self.found |= positions
        try:
            write(_record(self.found, ended=closing))
        except OSError as error:
            return self._unusable(error.strerror or str(error))
        return None

    def _unusable(self, reason: str) -> Trip:
        message = f"{self.path}: {reason}; no position can be kept for the next opening; {_MOVE_ON}"
        return Trip("position record", "", message, latches=True)


def _record(positions: Mapping[str, KeptPosition], *, ended: bool) -> str:
    rows = {
        name: vars(kept) | {"objects": [[*key, value] for key, value in kept.objects.items()]}
        for name, kept in positions.items()
    }
    now = datetime.now(UTC).isoformat(timespec="milliseconds")
    return json.dumps({"schema": 1, "time": now, "ended": ended, "winch": rows})


def _parse(data: bytes) -> tuple[str, bool, dict[str, KeptPosition]]:
    """Time of a record, whether it was closed, and its positions; raises ValueError, KeyError."""
    record = json.loads(data)
    if record["schema"] != 1:
        raise ValueError("unknown schema")
    positions = {name: _kept(row) for name, row in record["winch"].items()}
    return str(record["time"]), record["ended"] is True, positions


def _kept(row: Mapping[str, Any]) -> KeptPosition:
    return KeptPosition(
        count=int(row["count"]),
        offset=int(row["offset"]),
        zero=int(row["zero"]),
        doubt=str(row["doubt"]),
        closed=row["closed"] is True,
        serial=int(row["serial"]),
        unit=float(row["unit"]),
        trim=float(row["trim"]),
        objects={(int(i), int(sub)): int(value) for i, sub, value in row["objects"]},
    )

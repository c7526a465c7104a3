"""Units of diagnosis: the runs of one winch and one session."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.fleet.library.partitions import Partitions, Row

if TYPE_CHECKING:
    from winchkit.runs.run import Run


@dataclass(frozen=True)
class SessionRun:
    """A run of one winch."""

    path: str
    """Below the library."""
    hash: str
    prefix: str
    """Prefix of the winch's columns; empty without."""
    mapping: str | None
    """Mapping by which it is read, below the library."""

    def read(self, library: Path) -> Run:
        """Read it; raises FileError."""
        from winchkit.runs.read import read_run

        mapping = None if self.mapping is None else library / self.mapping
        return read_run(library / self.path, mapping).of_winch(self.prefix)


@dataclass(frozen=True)
class WinchSession:
    """Runs of one winch and one session, which are diagnosed together."""

    winch: str
    session: str
    time: datetime
    """UTC of the first run."""
    runs: tuple[SessionRun, ...]


def winch_sessions(tables: Partitions) -> list[WinchSession]:
    """Sessions of a library, by winch and time: runs with the same metadata ``session`` or, without
    it, the same UTC day of their start, so that repeats are in one diagnosis. Of files with the
    same content the first is taken, since copies are no repeats."""
    columns = ("winch", "session", "time", "path", "hash", "prefix", "mapping", "fault")
    groups: dict[tuple[str, str], list[Row]] = {}
    rows = tables.read("runs", columns).to_pylist()
    for row in sorted(rows, key=lambda row: (row["winch"], row["time"], row["path"])):
        if row["fault"] is None:
            groups.setdefault((row["winch"], row["session"]), []).append(row)
    sessions = []
    for (winch, session), members in groups.items():
        first = {row["hash"]: row for row in reversed(members)}
        kept = [row for row in members if first[row["hash"]] is row]
        runs = tuple(SessionRun(r["path"], r["hash"], r["prefix"], r["mapping"]) for r in kept)
        sessions.append(WinchSession(winch, session, members[0]["time"], runs))
    return sessions

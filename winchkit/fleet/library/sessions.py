"""Units of diagnosis: the runs of one winch and one session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from winchkit.fleet.library.files import run_files
from winchkit.fleet.library.partitions import Partitions, Row

if TYPE_CHECKING:
    from winchkit.runs.run import Run


_LEAST_RUNS = 3
"""Runs of a programme from which on its usual duration is known (rule of thumb)."""
_SHORT = 0.9
"""Share of the usual duration below which a run was cut short (rule of thumb: a programme moves by
its set-points, so that its runs differ by seconds)."""
_COLUMNS = ("path", "programme", "load_mass", "duration", "complete", "fault")


def run_faults(tables: Partitions) -> dict[str, str]:
    """Files of a library whose runs are lost, unreadable or cut short, each with the reason. A log
    without its end was cut; the duration of a table of numbers, which has no end, is compared with
    the median of the runs with the same programme and load."""
    rows = tables.read("runs", _COLUMNS).to_pylist()
    there = {file.path for file in run_files(tables.runs)}
    usual = _usual_durations(rows)
    found = {row["path"]: _fault(row, there, usual) for row in rows}
    return {path: fault for path, fault in sorted(found.items()) if fault}


def _usual_durations(rows: Sequence[Row]) -> dict[tuple[str, float | None], float]:
    """Median duration by programme and load, s, where three runs or more have them."""
    groups: dict[tuple[str, float | None], dict[str, float]] = {}
    for row in rows:
        if row["fault"] is None and row["complete"] and row["programme"]:
            same = groups.setdefault((row["programme"], row["load_mass"]), {})
            same[row["path"]] = row["duration"]
    return {k: median(own.values()) for k, own in groups.items() if len(own) >= _LEAST_RUNS}


def _fault(row: Row, there: set[str], usual: Mapping[tuple[str, float | None], float]) -> str:
    """What is wrong with a run; empty where nothing is."""
    if row["path"] not in there:
        return "is in the index, but no longer in the folder; restore it, or index again"
    if row["fault"] is not None:
        return f"is no run: {row['fault']}"
    if not row["complete"]:
        return "was cut: the log has no end; record it again, or use it knowingly"
    whole = usual.get((row["programme"], row["load_mass"]), 0.0)
    if row["duration"] < _SHORT * whole:
        return (
            f"was cut: it lasts {row['duration']:.4g} s, the runs of programme "
            f"'{row['programme']}' with its load last {whole:.4g} s (median; limit: "
            f"{_SHORT:.0%} of it); record it again, or use it knowingly"
        )
    return ""


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

"""Diagnoses of all sessions of a library: in a plain loop, or by the workers of a Dask cluster.

Paths go to a worker and rows of tables come back.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from winchkit.arguments import ProgressCallback, no_progress
from winchkit.fleet.library.index import indexed
from winchkit.fleet.library.partitions import Partitions, Row
from winchkit.fleet.library.sessions import run_faults, winch_sessions
from winchkit.fleet.library.tasks import Outcome, Task, outcome_of, task_of

_COMMIT = 5.0
"""Longest time between two writings of the tables, s."""


@dataclass(frozen=True)
class FleetReport:
    """Result of the diagnoses of a library."""

    diagnosed: int
    unchanged: int
    """Sessions whose diagnosis was known."""
    failures: Mapping[str, str]
    """``winch session`` to the reason."""
    faults: Mapping[str, str]
    """Files whose runs are lost, unreadable or cut short, with the reason."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that ``winchkit fleet diagnose --json`` prints."""
        return {
            "schema": 1,
            "diagnosed": self.diagnosed,
            "unchanged": self.unchanged,
            "failures": dict(self.failures),
            "faults": dict(self.faults),
        }


def diagnose_library(
    folder: str | Path,
    profile: str | Path,
    *,
    effect_files: Sequence[str | Path] = (),
    band: float | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: ProgressCallback = no_progress,
) -> FleetReport:
    """Diagnose every winch and session of an indexed library that has no diagnosis yet.

    Parameters
    ----------
    folder : str or Path
        Folder of the runs, which was indexed.
    profile : str or Path
        Profile of all winches, or a folder with ``WINCH.toml`` for each (``/`` as ``-``).
    effect_files : sequence of str or Path, optional
        Files of user effects.
    band : float, optional
        Cut-off of the torque's low-pass, Hz.
    jobs : int, optional
        Processes of this computer; 1 for a plain loop without Dask, by default by its cores and
        memory.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers read the folder by the same path.
    progress : callable, optional
        Called with a text and the share of the work done.

    Returns
    -------
    FleetReport
        Counts, failures and runs with faults, with their reasons.

    Raises
    ------
    FileError
        For a folder without an index, a profile or effect that is wrong, tables that cannot be
        written.
    UsageError
        Without Dask where it is needed, and for workers with another version of winchkit.

    Notes
    -----
    A diagnosis that fails is tried once more. After an interruption the diagnoses that ended are
    in the tables, and the next call continues.
    """
    tables = indexed(folder)
    sources = tuple(
        (Path(file).name, Path(file).read_text(encoding="utf-8")) for file in effect_files
    )
    tasks = [task_of(tables, session, profile, sources, band) for session in winch_sessions(tables)]
    rows = tables.read("diagnoses", ("key", "failure")).to_pylist()
    done = {row["key"] for row in rows if row["failure"] is None}
    due = [task for task in tasks if task.key not in done]
    kept = _Keeping(tables, len(due), progress)
    if due:
        with kept:
            for outcome in _outcomes(due, jobs, scheduler):
                kept.take(outcome)
    return FleetReport(
        kept.count - len(kept.failures), len(tasks) - len(due), kept.failures, run_faults(tables)
    )


def _outcomes(due: Sequence[Task], jobs: int | None, scheduler: str | None) -> Iterator[Outcome]:
    if jobs == 1 and scheduler is None:
        yield from map(_with_retry, due)
        return
    from winchkit.fleet.library.cluster import cluster_outcomes

    yield from cluster_outcomes(due, jobs, scheduler)


def _with_retry(task: Task) -> Outcome:
    outcome = outcome_of(task)
    return outcome if outcome.diagnosis["failure"] is None else outcome_of(task)


@dataclass
class _Keeping:
    """Outcomes for the tables; at an interruption those that wait are written."""

    tables: Partitions
    due: int
    progress: ProgressCallback
    failures: dict[str, str] = field(default_factory=dict)
    count: int = 0
    waiting: list[Outcome] = field(default_factory=list)
    started: float = field(default_factory=time.monotonic)
    written: float = field(default_factory=time.monotonic)

    def __enter__(self) -> _Keeping:
        return self

    def __exit__(self, *_: object) -> None:
        self._write()

    def take(self, outcome: Outcome) -> None:
        """Count an outcome, and write those that wait where the last writing is long ago."""
        row = outcome.diagnosis
        self.count += 1
        self.waiting.append(outcome)
        if row.get("failure"):
            self.failures[f"{row['winch']} {row['session']}".strip()] = row["failure"]
        now = time.monotonic()
        left = (now - self.started) / self.count * (self.due - self.count)
        failed = f", {len(self.failures)} failed" if self.failures else ""
        text = f"{self.count} of {self.due} sessions{failed}, {left / 60:.1f} min left"
        self.progress(text, self.count / self.due)
        if now - self.written > _COMMIT:
            self._write()

    def _write(self) -> None:
        """Replace the rows of these sessions, of other profiles too; estimates first: after a kill
        between the two tables the diagnosis is missing and is computed again."""
        outcomes, self.waiting, self.written = self.waiting, [], time.monotonic()
        if not outcomes:
            return
        rows = [outcome.diagnosis for outcome in outcomes]
        known = {(row["winch"], row["session"]) for row in rows}
        with self.tables.locked("diagnoses"):
            fitted = [row for outcome in outcomes for row in outcome.estimates]
            winches = {row["winch"] for row in rows}

            def replaced(row: Row) -> bool:
                return (row["winch"], row["session"]) in known

            for table, new in (("estimates", fitted), ("diagnoses", rows)):
                touched = [path for winch in winches for path in self.tables.of_winch(table, winch)]
                self.tables.change(table, replaced, touched, new)

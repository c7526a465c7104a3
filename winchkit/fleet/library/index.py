"""Index of a library: the table of runs is brought to the state of the files."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

from winchkit.arguments import ProgressCallback, no_progress, path_of
from winchkit.errors import Fault, FileError
from winchkit.fleet.library.description import ProfileOfRuns, described
from winchkit.fleet.library.files import RunFile, run_files
from winchkit.fleet.library.partitions import Partitions, Row

_COMMIT = 5.0
"""Longest time between two writings of the table, s: a kill costs at most these runs."""
_STATE = ("path", "winch", "size", "mtime", "fault", "profile", "imported_from")


@dataclass(frozen=True)
class IndexReport:
    """Result of an indexing."""

    indexed: tuple[str, ...]
    """Files that were read."""
    unchanged: int
    """Files that the table has already."""
    removed: tuple[str, ...]
    """Files that are no longer there."""
    faults: dict[str, str] = field(default_factory=dict)
    """Files that are no runs, or not yet, with the reason; they are read again next time."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that ``winchkit library index --json`` prints."""
        return {
            "schema": 1,
            "indexed": list(self.indexed),
            "unchanged": self.unchanged,
            "removed": list(self.removed),
            "faults": dict(self.faults),
        }


def profile_of_runs(profile: str | Path) -> ProfileOfRuns:
    """Hash of a profile's content, and its name; raises FileError."""
    import hashlib

    from winchkit.catalog import find

    path = find("profiles", str(profile))
    return ProfileOfRuns(hashlib.sha256(path.read_bytes()).hexdigest(), path.stem)


def indexed(folder: str | Path) -> Partitions:
    """Tables of a folder; raises FileError where it has no index, or is not there."""
    if not path_of(folder, "folder").is_dir():
        raise FileError(Fault("no such folder of runs", str(folder)))
    tables = Partitions(Path(folder))
    if not tables.files("runs"):
        raise FileError(f"{folder}: has no index; run 'winchkit library index {folder}' first")
    return tables


def profile_path(profile: str | Path, winch: str) -> Path:
    """File of a winch's profile, or in a folder ``WINCH.toml`` (``/`` as ``-``); raises
    FileError."""
    from winchkit.catalog import find

    if Path(profile).is_dir():
        profile = Path(profile) / f"{winch.replace('/', '-')}.toml"
    return find("profiles", str(profile))


def index_library(
    folder: str | Path,
    profile: str | Path | None = None,
    progress: ProgressCallback = no_progress,
) -> IndexReport:
    """Bring the table of runs of a folder to the state of its files.

    Parameters
    ----------
    folder : str or Path
        Folder tree with runs.
    profile : str or Path, optional
        Profile of the winches, whose hash the rows have; by default they keep the one they have.
    progress : callable, optional
        Called with the present file and the share of the work done.

    Returns
    -------
    IndexReport
        Files that were read, left alone, removed, and those with a fault.

    Raises
    ------
    FileError
        For a folder that is not there, or tables that cannot be written; rows that were written
        before stay.
    UsageError
        Without pyarrow.

    Notes
    -----
    A file is read again where its size or date of change differs, where it had a fault, or where
    its profile changed. Another writer waits until this one has ended, and then finds the rows.
    """
    library = path_of(folder, "folder")
    if not library.is_dir():
        raise FileError(Fault("no such folder of runs", str(folder)))
    tables = Partitions(library)
    known_profile = None if profile is None else profile_of_runs(profile)
    with tables.locked("runs", lambda: progress("waiting for another writer", None)):
        return _Indexing(tables, known_profile, progress).run()


@dataclass
class _Indexing:
    """One indexing, under the lock of the table."""

    tables: Partitions
    profile: ProfileOfRuns | None
    progress: ProgressCallback

    def run(self) -> IndexReport:
        self.progress("looking for runs", None)
        files = {file.path: file for file in run_files(self.tables.runs)}
        known: dict[str, list[tuple[Path, Row]]] = {}
        for place, row in self.tables.placed("runs", _STATE):
            known.setdefault(row["path"], []).append((place, row))
        due = [file for path, file in files.items() if self._is_due(file, known.get(path, []))]
        gone = [path for path in known if path not in files]
        self._forget(gone, known)
        self._commit(gone, known, [])
        report = IndexReport((), len(files) - len(due), tuple(gone))
        return self._without_sources(self._read(due, known, report))

    def _forget(self, paths: Sequence[str], known: dict[str, list[tuple[Path, Row]]]) -> None:
        """Remove diagnoses and estimates of runs that are gone, before the rows of these runs:
        after a kill in between this is repeated next time."""
        if not paths:
            return
        gone, winches = set(paths), {row["winch"] for path in paths for _, row in known[path]}
        with self.tables.locked("diagnoses"):
            for table in ("estimates", "diagnoses"):
                touched = [path for winch in winches for path in self.tables.of_winch(table, winch)]
                self.tables.change(table, lambda row: not gone.isdisjoint(row["runs"]), touched, [])

    def _is_due(self, file: RunFile, rows: Sequence[tuple[Path, Row]]) -> bool:
        return not rows or any(
            row["fault"] is not None
            or (row["size"], row["mtime"]) != (file.size, file.mtime)
            or (self.profile is not None and row["profile"] != self.profile.hash)
            for _, row in rows
        )

    def _read(
        self, due: Sequence[RunFile], known: dict[str, list[tuple[Path, Row]]], report: IndexReport
    ) -> IndexReport:
        rows: list[Row] = []
        faults: dict[str, str] = {}
        last = time.monotonic()
        try:
            for number, file in enumerate(due):
                self.progress(file.path, number / len(due))
                found = described(file, self.profile)
                rows += found
                if found[0]["fault"]:
                    faults[file.path] = found[0]["fault"]
                if time.monotonic() - last > _COMMIT:
                    self._commit([row["path"] for row in rows], known, rows)
                    rows, last = [], time.monotonic()
        finally:
            # After Ctrl-C too: what was read is kept.
            self._commit([row["path"] for row in rows], known, rows)
        read = tuple(file.path for file in due if file.path not in faults)
        return replace(report, indexed=read, faults=faults)

    def _commit(
        self, paths: Sequence[str], known: dict[str, list[tuple[Path, Row]]], rows: list[Row]
    ) -> None:
        if not paths:
            return
        dropped = set(paths)
        touched = {place for path in dropped for place, _ in known.get(path, ())}
        touched |= {self.tables.place("runs", row) for row in rows}
        self.tables.change("runs", lambda row: row["path"] in dropped, touched, rows)

    def _without_sources(self, report: IndexReport) -> IndexReport:
        """Remove files of other programs whose imported run is in the same folder."""
        placed = self.tables.placed("runs", ("path", "mapping", "fault", "imported_from"))
        sources = {
            str(PurePosixPath(row["path"]).with_name(row["imported_from"]))
            for _, row in placed
            if row["imported_from"] and row["mapping"] is None
        }
        # An imported run is no source, also where it has the name of its own source elsewhere.
        extra = [
            (place, row)
            for place, row in placed
            if row["path"] in sources and not (row["imported_from"] and row["mapping"] is None)
        ]
        if not extra:
            return report
        paths = {row["path"] for _, row in extra}
        self.tables.change(
            "runs", lambda row: row["path"] in paths, {place for place, _ in extra}, []
        )
        return replace(
            report,
            indexed=tuple(path for path in report.indexed if path not in paths),
            faults={path: fault for path, fault in report.faults.items() if path not in paths},
        )

"""The Library view: runs of a folder with their verdicts, laid over each other.

Rows are those of the library's table of runs where it has them, else the files are read. Verdicts
are those of the library's diagnoses, and of what was diagnosed on the page.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from winchkit.errors import UsageError
from winchkit.fleet.library.description import described
from winchkit.fleet.library.files import RunFile, run_files
from winchkit.fleet.library.partitions import Partitions, Row
from winchkit.report.words.vocabulary import effect_name
from winchkit.runs.read import read_run
from winchkit.runs.run import Run
from winchkit.web.channels import lines_of
from winchkit.web.state import Judgement

_MOST_READ = 2000
"""Files that are read for the list; an index has them at once."""


@dataclass(frozen=True)
class LibraryRun:
    """A winch of a run of the folder."""

    path: Path
    prefix: str
    mapping: Path | None

    def read(self) -> Run:
        """Read it; raises FileError."""
        return read_run(self.path, self.mapping).of_winch(self.prefix)


class Library:
    """Runs below a folder; a file is read again where its size or date changed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self._read: dict[str, tuple[tuple[int, int], list[Row]]] = {}
        self._runs: dict[str, LibraryRun] = {}

    @property
    def tables(self) -> Partitions | None:
        """Tables of the library; None for a folder without an index."""
        tables = Partitions(self.folder)
        return tables if tables.files("runs") else None

    def rows(self, judged: Mapping[Path, Judgement] | None = None) -> dict[str, Any]:
        """All runs with what is known of each, and files that are none with the reason."""
        tables = self.tables
        indexed: dict[str, list[Row]] = {}
        known: dict[str, Judgement] = {}
        if tables is not None:
            for row in tables.read("runs").to_pylist():
                indexed.setdefault(row["path"], []).append(row)
            known = _judgements(tables)
        rows: list[dict[str, Any]] = []
        runs: dict[str, LibraryRun] = {}
        for number, file in enumerate(run_files(self.folder)):
            own = indexed.get(file.path)
            if own is None or (own[0]["size"], own[0]["mtime"]) != (file.size, file.mtime):
                own = self._described(file) if number < _MOST_READ else _unread(file)
            for row in own:
                name = f"{row['path']}:{row['prefix']}" if row["prefix"] else row["path"]
                mapping = self.folder / row["mapping"] if row.get("mapping") else None
                run = runs[name] = LibraryRun(self.folder / row["path"], row["prefix"], mapping)
                found = (judged or {}).get(run.path) or known.get(row["path"])
                rows.append(_json(name, row, found))
        self._runs = runs
        return {"folder": self.folder.name, "indexed": tables is not None, "runs": rows}

    def run(self, name: str) -> LibraryRun:
        """Run of a row; raises UsageError for a name that is not listed."""
        if name not in self._runs:
            self.rows()
        if name not in self._runs:
            raise UsageError(f"there is no run '{name}' in the folder")
        return self._runs[name]

    def overlay(self, names: Sequence[str], channel: str, over: str) -> dict[str, Any]:
        """A channel of several runs over time or another channel, as ``lines_of`` has it."""
        return lines_of([(name, self.run(name).read()) for name in names], channel, over)

    def _described(self, file: RunFile) -> list[Row]:
        stamp = file.size, file.mtime
        known = self._read.get(file.path)
        if known is None or known[0] != stamp:
            known = self._read[file.path] = stamp, described(file)
        return known[1]


def _judgements(tables: Partitions) -> dict[str, Judgement]:
    """Diagnoses of a library by the path of each run."""
    columns = ("runs", "verdict", "failure", "effects", "places", "profile_name", "result")
    out: dict[str, Judgement] = {}
    for row in tables.read("diagnoses", columns).to_pylist():
        if row["failure"] is None:
            outputs = json.loads(row["result"]).get("outputs", {})
            causes = [effect_name(effect) for effect in row["effects"]]
            causes += [place.replace("_", " ") for place in row["places"] or ()]
            found = Judgement(row["verdict"], causes, outputs, row["profile_name"])
            out |= dict.fromkeys(row["runs"], found)
    return out


def _unread(file: RunFile) -> list[Row]:
    fault = f"not read, as it is beyond {_MOST_READ} files; run 'winchkit library index' first"
    return [{"path": file.path, "prefix": "", "winch": "", "fault": fault}]


def _json(name: str, row: Row, found: Judgement | None) -> dict[str, Any]:
    if row["fault"]:
        return {"name": name, "winch": row["winch"], "fault": row["fault"]}
    return {
        "name": name,
        "winch": row["winch"],
        "session": row["session"],
        "programme": row["programme"] or "",
        "load": None if row["load_mass"] is None else f"{row['load_mass']:.4g} kg",
        "date": _date(row),
        "seconds": row["duration"],
        "samples": row["samples"],
        "channels": row["channels"],
        "sanity": row["sanity"],
        "verdict": None if found is None else found.to_json(),
    }


def _date(row: Row) -> str:
    """Time of a run; a date alone where the file, or its path, has no time of day."""
    time = row["time"]
    is_day = row["time_source"] in {"metadata", "path"} and time.time() == time.min.time()
    return str(time.date().isoformat() if is_day else time.isoformat(timespec="minutes"))

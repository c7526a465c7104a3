"""The Library view: runs of a folder with load, programme and date, laid over each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import FileError, UsageError
from winchkit.plain_json import significant
from winchkit.report.figures.reduction import decimated
from winchkit.runs.read import read_run
from winchkit.runs.run import Run

__all__ = ["Library"]

_SUFFIXES = {".csv", ".mcap", ".parquet", ".mf4"}
_DEEPEST = 3
"""Folders below the one that is listed."""
_MOST = 2000
_POINTS = 1600


@dataclass(frozen=True)
class _Entry:
    stamp: tuple[float, int]
    row: dict[str, Any]


class Library:
    """Runs below a folder; a file is read again where its size or date changed.

    Parameters
    ----------
    folder : Path
        The folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self._known: dict[str, _Entry] = {}

    def rows(self) -> dict[str, Any]:
        """All runs with what is known of each, and files that are none with the reason."""
        rows = []
        for path in self._files():
            name = str(path.relative_to(self.folder))
            state = path.stat()
            stamp = (state.st_mtime, state.st_size)
            known = self._known.get(name)
            if known is None or known.stamp != stamp:
                known = self._known[name] = _Entry(stamp, _row(name, path, state.st_mtime))
            rows.append(known.row)
        return {"folder": self.folder.name, "runs": rows}

    def path(self, name: str) -> Path:
        """File of a row; raises UsageError for a name that is not listed."""
        path = (self.folder / name).resolve()
        if not path.is_relative_to(self.folder) or path not in self._files():
            raise UsageError(f"there is no run '{name}' in the folder")
        return path

    def overlay(self, names: Sequence[str], channel: str) -> dict[str, Any]:
        """A channel of several runs from their starts, reduced for drawing; of two, the difference.

        The first run is interpolated at the instants of the second one as far as both last.

        Parameters
        ----------
        names : sequence of str
            Rows of the library.
        channel : str
            Name of the channel.
        """
        curves: list[tuple[str, str, Array, Array]] = []
        for name in names:
            run = read_run(self.path(name))
            own = run.of_winch(run.winches()[0])
            if channel in own:
                unit = own.channels[channel].unit
                curves.append((name, unit, own.time - own.time[0], own[channel]))
        difference = None
        if len(curves) == 2:
            (first, unit, x1, y1), (second, _, x2, y2) = curves
            both = x2 <= x1[-1]
            change = y2[both] - np.interp(x2[both], x1, y1)
            difference = _line(f"{second} less {first}", unit, x2[both], change)
        return {
            "channel": channel,
            "lines": [_line(*curve) for curve in curves],
            "difference": difference,
        }

    def _files(self) -> list[Path]:
        found = [
            path
            for path in sorted(self.folder.rglob("*"))
            if path.suffix in _SUFFIXES
            and path.is_file()
            and len(path.relative_to(self.folder).parts) <= _DEEPEST
            and not any(part.startswith(".") for part in path.relative_to(self.folder).parts)
        ]
        return found[:_MOST]


def _line(name: str, unit: str, x: Array, y: Array) -> dict[str, Any]:
    """A curve reduced to the extremes of every pixel."""
    shown = decimated([y], _POINTS // 2)
    return {
        "name": name,
        "unit": unit,
        "x": significant(x[shown].tolist(), 6),
        "y": significant(y[shown].tolist(), 5),
    }


def _row(name: str, path: Path, changed: float) -> dict[str, Any]:
    row: dict[str, Any] = {
        "name": name,
        "date": datetime.fromtimestamp(changed, UTC).isoformat(timespec="minutes"),
    }
    try:
        run = read_run(path)
    except FileError as error:
        return row | {"fault": str(error.faults[0])}
    return row | _facts(run)


def _facts(run: Run) -> dict[str, Any]:
    first = run.winches()[0]
    channels = sorted({channel.rpartition(".")[2] for channel in run.channels})
    return {
        "load": run.metadata.get("load_mass", ""),
        "programme": run.metadata.get("programme", ""),
        "recorded": run.metadata.get("date", run.metadata.get("started", "")),
        "winch": first,
        "winches": run.winches(),
        "samples": len(run),
        "seconds": float(np.ptp(run.time)) if len(run) else 0.0,
        "channels": channels,
    }

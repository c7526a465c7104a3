"""Writers of runs: row by row while they are recorded, or at once.

    with open_writer("lift.mcap", [("time", "s"), ("tension", "N")], {"load_mass": "15 kg"}) as log:
        log.append({"time": 0.0, "tension": 147.1})

Rows are flushed when the next row is added after 0.5 s (CSV) or 0.25 s (MCAP); call ``flush``
before a pause.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from winchkit.arguments import path_of, require_type
from winchkit.errors import UsageError
from winchkit.runs.read import SUFFIXES
from winchkit.runs.recording.log_file import create
from winchkit.runs.run import Run
from winchkit.runs.run_writer import Clock, Columns, CsvWriter, RunWriter


def open_writer(
    path: str | Path,
    columns: Columns,
    metadata: Mapping[str, str] | None = None,
    clock: Clock = time.monotonic,
    *,
    replace: bool = False,
) -> RunWriter:
    """Start a run in a file, in the format of its suffix; the file is locked until it is closed.

    Parameters
    ----------
    path : str or Path
        File, ``.csv`` or ``.mcap``.
    columns : sequence of (str, str)
        Names and units in order; values are written in these units.
    metadata : mapping, optional
        Keys and texts.
    clock : callable
        Time of flushing, s.
    replace : bool
        Overwrite an earlier file.

    Returns
    -------
    RunWriter
        Open writer.

    Raises
    ------
    FileError
        Where the file cannot be written.
    UsageError
        For an unknown suffix, an existing file without ``replace``, and a file that is being
        written.
    """
    begin = partial(create, path_of(path), replace=replace)
    return kind_for(path)(Path(path), columns, metadata or {}, clock, begin)


def write_run(run: Run, path: str | Path, *, replace: bool = False) -> None:
    """Write a run in the format of the file's suffix, with the units of its channels.

    Parameters
    ----------
    run : Run
        The run.
    path : str or Path
        File.
    replace : bool
        Write over a file of that name.

    Raises
    ------
    FileError
        Where the file cannot be written.
    UsageError
        For an unknown suffix, a file that exists and is not to be replaced, and one to which a log
        is being written.
    """
    require_type(run, Run, "run")
    kind = kind_for(path)
    columns = [("time", "s"), *((name, channel.unit) for name, channel in run.channels.items())]
    series = [run.time.tolist(), *(channel.values.tolist() for channel in run.channels.values())]
    begin = partial(create, path_of(path), replace=replace)
    clock = time.monotonic
    with kind(path_of(path), columns, run.metadata, clock, begin, is_streamed=False) as writer:
        for row in zip(*series, strict=True):
            writer.append_values(row)


def kind_for(path: str | Path) -> type[RunWriter]:
    """The writer of the format that a file's suffix names; raises UsageError."""
    suffix = path_of(path).suffix.lower()
    if suffix == ".csv":
        return CsvWriter
    if suffix == ".mcap":
        from winchkit.runs.formats.mcap_write import McapWriter

        return McapWriter
    message = f"'{suffix}' is no format of a run; use one of {', '.join(SUFFIXES)}"
    raise UsageError(f"{path}: {message}")

"""Export of a run, or of the parts of a log, in the format of the output's suffix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from winchkit.arguments import path_of, require_types
from winchkit.errors import RunError, UsageError
from winchkit.runs.files import refuse_existing
from winchkit.runs.log import aligned, log_of_run
from winchkit.runs.read import read_log, read_run
from winchkit.runs.run import Run
from winchkit.runs.writer import write_run

FORMATS = (".csv", ".mcap", ".parquet", ".mf4")


def export(
    paths: Sequence[str | Path], output: str | Path, winch: str = "", *, replace: bool = False
) -> Run:
    """Write a run, or the parts of a log, to one file.

    Parameters
    ----------
    paths : sequence of str or Path
        The run, or the parts of a log.
    output : str or Path
        File; its suffix is the format. MF4 keeps the time stamps of every source, the other formats
        have rows.
    winch : str
        Only this winch, with its columns without prefix.
    replace : bool
        Write over a file of that name.

    Returns
    -------
    Run
        The written rows.

    Raises
    ------
    RunError, FileError, UsageError
        For an invalid run, a file that cannot be written, an unknown suffix, and an output that
        exists and is not to be replaced.
    """
    require_types(paths, (str, Path), "paths")
    if not paths:
        raise RunError("no log given")
    suffix = path_of(output, "output").suffix.lower()
    if suffix not in FORMATS:
        raise UsageError(f"{output}: '{suffix}' is no format of a run; use {', '.join(FORMATS)}")
    if any(Path(path).resolve() == Path(output).resolve() for path in paths):
        raise UsageError(f"{output}: would replace the file that is exported; name another")
    refuse_existing(Path(output), replace)
    log = None if len(paths) == 1 and suffix != ".mf4" else read_log(paths)
    run = (read_run(paths[0]) if log is None else aligned(log)).of_winch(winch)
    if log is not None and suffix == ".mf4":
        from winchkit.runs.formats.tables import write_mf4

        write_mf4(log_of_run(run) if winch else log, output)
    elif suffix == ".parquet":
        from winchkit.runs.formats.tables import write_parquet

        write_parquet(run, output)
    else:
        write_run(run, output, replace=True)
    return run

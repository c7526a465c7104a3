"""Export of a run, or of the parts of a log, in the format of the output's suffix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from winchkit.arguments import path_of, require_types
from winchkit.errors import RunError, UsageError
from winchkit.extras import library
from winchkit.regular_file import file_errors, refuse_existing
from winchkit.runs.log import Log, aligned, log_of_run
from winchkit.runs.read import read_log, read_run
from winchkit.runs.run import Run
from winchkit.runs.writer import write_run


def write_mf4(log: Log, path: str | Path) -> None:
    """Write a log as MDF 4, a group per source; raises UsageError without asammdf, FileError."""
    asammdf = library("asammdf", f"{path}: MF4")
    start, _ = log.span
    with asammdf.MDF(version="4.10") as mdf:
        for source in log.layout.sources:
            samples = log.samples[source.topic]
            signals = [
                asammdf.Signal(
                    samples=samples.values[:, n],
                    timestamps=samples.times - start,
                    unit=signal.unit,
                    name=signal.column
                    or f"{source.topic.strip('/').replace('/', '.')}.{signal.name}",
                )
                for n, signal in enumerate(source.signals)
            ]
            mdf.append(signals, acq_name=source.topic, common_timebase=True)
        mdf.header.comment = "\n".join(f"{key}: {value}" for key, value in log.metadata.items())
        with file_errors(path):
            mdf.save(Path(path), overwrite=True)


def write_parquet(run: Run, path: str | Path) -> None:
    """Write a run as Parquet, null for NaN; raises UsageError without pyarrow, FileError."""
    library("pyarrow", f"{path}: Parquet")
    from pyarrow import parquet

    table = run.to_arrow()
    with file_errors(path), Path(path).open("wb") as stream:
        parquet.write_table(table, stream, compression="zstd")


FORMATS = (".csv", ".mcap", ".parquet", ".mf4")


def export(
    sources: Sequence[str | Path], path: str | Path, winch: str = "", *, replace: bool = False
) -> Run:
    """Write a run, or the parts of a log, to one file.

    Parameters
    ----------
    sources : sequence of str or Path
        The run, or the parts of a log.
    path : str or Path
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
    require_types(sources, (str, Path), "sources")
    if not sources:
        raise RunError("no log given")
    suffix = path_of(path).suffix.lower()
    if suffix not in FORMATS:
        raise UsageError(f"{path}: '{suffix}' is no format of a run; use {', '.join(FORMATS)}")
    if any(Path(source).resolve() == Path(path).resolve() for source in sources):
        raise UsageError(f"{path}: would replace the file that is exported; name another")
    refuse_existing(Path(path), replace)
    log = None if len(sources) == 1 and suffix != ".mf4" else read_log(sources)
    run = (read_run(sources[0]) if log is None else aligned(log)).of_winch(winch)
    if log is not None and suffix == ".mf4":
        write_mf4(log_of_run(run) if winch else log, path)
    elif suffix == ".parquet":
        write_parquet(run, path)
    else:
        write_run(run, path, replace=True)
    return run

"""Reader of runs and logs in the format of their suffix, in one file or in parts."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from winchkit.arguments import path_of, require_types
from winchkit.errors import Fault, RunError
from winchkit.runs.formats.csv_read import read_bytes, read_csv, read_events
from winchkit.runs.log import Log, aligned, joined, log_of_run
from winchkit.runs.recording.rotation import parts_beside
from winchkit.runs.run import Run
from winchkit.schema.mapping import ImportMapping

SUFFIXES = (".csv", ".mcap")
_LOGGER = logging.getLogger(__name__)


def read_run(path: str | Path, mapping: str | Path | ImportMapping | None = None) -> Run:
    """Read a run from CSV or MCAP, or by a mapping from a file of another program.

    Parameters
    ----------
    path : str or Path
        The file; ``lift.mcap`` also stands for the parts ``lift.001.mcap``, ``lift.002.mcap`` …
    mapping : str, Path or ImportMapping, optional
        Channels and units of another program's columns, as ``winchkit import`` writes them; the
        file may then be of any format that it reads.

    Returns
    -------
    Run
        Channels in SI on one time base.

    Raises
    ------
    RunError
        With every fault of the file.
    FileError
        With every fault of the mapping.
    """
    if mapping is not None:
        from winchkit.runs.importing.runs import read_mapped

        return read_mapped(path, mapping)
    _format_of(path)
    files = _files(path)
    run = _read_run(files[0]) if len(files) == 1 else aligned(read_log(files))
    _LOGGER.info("read %s: run of %d rows, channels %s", path, len(run), ", ".join(run))
    return run


def read_log(paths: str | Path | Sequence[str | Path]) -> Log:
    """Read a log with the time stamps of every source.

    Parameters
    ----------
    paths : str, Path or sequence of these
        One file, or the parts of one log.

    Returns
    -------
    Log
        A run of rows is a log of one source.

    Raises
    ------
    RunError
        For invalid files, and for parts of different logs.
    """
    given = [paths] if isinstance(paths, str | Path) else paths
    require_types(given, (str, Path), "paths")
    if not given:
        raise RunError("no log given")
    files = [file for path in given for file in _files(path)]
    if len(files) > 1 and not _has_begun(files[-1]):
        files.pop()
    _LOGGER.info("read %s: log", ", ".join(map(str, files)))
    return joined([_read_log(file, is_part=len(files) > 1) for file in files])


def _files(path: str | Path) -> list[Path]:
    file = Path(path)
    return [file] if file.exists() else parts_beside(file) or [file]


def _has_begun(path: Path) -> bool:
    """Whether a part has content: a killed recorder may leave its last part empty."""
    data = read_bytes(path, may_be_empty=True)
    if _format_of(path) == ".csv":
        return any(line.strip() and line[:1] != b"#" for line in data.split(b"\n")[:-1])
    from winchkit.runs.formats.mcap_file import COLUMNS, LOG
    from winchkit.runs.formats.mcap_read import read_content
    from winchkit.runs.formats.mcap_records import MARK

    if MARK.startswith(data):
        return False
    content = read_content(data)
    return not content.metadata.keys().isdisjoint((LOG, COLUMNS)) or bool(content.damage)


def _format_of(path: str | Path) -> str:
    suffix = path_of(path).suffix.lower()
    if Path(path).is_dir():
        runs = Path(path) / "*.csv"
        raise RunError(Fault(f"is a folder; name the runs in it, such as {runs}", str(path)))
    if suffix == ".toml":
        message = "is a declaration such as a profile, and no run; runs are .csv or .mcap files"
        raise RunError(Fault(message, str(path)))
    if suffix not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        from winchkit.can_trace import trace_advice

        message = trace_advice(Path(path)) or (
            f"'{suffix}' is no format of a run; use one of {known}, or `winchkit import` for files "
            "of other programs"
        )
        raise RunError(Fault(message, str(path)))
    return suffix


def _read_csv(path: Path, *, is_part: bool = False) -> Run:
    """Run of a CSV file; a trace of CAN frames is refused with what to do."""
    from winchkit.can_trace import trace_advice

    try:
        return read_csv(path, is_part=is_part)
    except RunError:
        if advice := trace_advice(path):
            raise RunError(Fault(advice, str(path))) from None
        raise


def _read_run(path: Path) -> Run:
    if _format_of(path) == ".csv":
        return _read_csv(path)
    from winchkit.runs.formats.mcap_read import read_mcap

    return read_mcap(path)


def _read_log(path: Path, *, is_part: bool) -> Log:
    if _format_of(path) == ".csv":
        log = log_of_run(_read_csv(path, is_part=is_part), closed=None)
        return replace(log, events=read_events(path))
    from winchkit.runs.formats.mcap_read import read_mcap_log

    return read_mcap_log(path)

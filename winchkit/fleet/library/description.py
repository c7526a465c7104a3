"""Rows of the table of runs for one file: what is known of a recording without a model."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from winchkit.errors import Fault, FileError, RunError
from winchkit.fleet.library.files import RunFile
from winchkit.fleet.library.partitions import Row
from winchkit.runs.info import LogInfo, info_of
from winchkit.runs.read import read_log, read_run
from winchkit.runs.recording.log_file import is_written
from winchkit.runs.run import Run
from winchkit.runs.sanity.inspection import inspect_run

_DATE = re.compile(r"\d{4}\D?\d{2}(\D?\d{2})?\b.*")
"""Name of a folder that begins with a date: a session, and no winch."""
_STARTS = ("start_time", "started", "begun", "date", "recorded")
"""Metadata with the time of the first sample, ISO 8601; ``recorded`` is that of a bench. Of another
program's file with the prefix ``source``, in any case."""
_SOURCE = "source "
_DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})(.*)")
"""A date with points has its day first; one with slashes is ambiguous and not used."""
_CLOCK = re.compile(r"\d{1,2}:\d{2}(:\d{2}(\.\d+)?)?")
_IN_A_NAME = re.compile(
    r"(?<!\d)((?:19|20)\d{2})([-_]?)(\d{2})\2(\d{2})"
    r"(?:[T _-]?(\d{2})[-_:h]?(\d{2})(?:[-_:m]?(\d{2}))?)?(?!\d)"
)
"""Date, with or without a time, in the name of a file or folder: ``trip-20260301-143005``."""


@dataclass(frozen=True)
class ProfileOfRuns:
    """Profile that the runs are compared with."""

    hash: str
    name: str


def described(file: RunFile, profile: ProfileOfRuns | None = None) -> list[Row]:
    """Rows of a file: one per winch, or one with its fault."""
    own = {"path": file.path, "size": file.size, "mtime": file.mtime}
    digest, run, mapping, info = "", None, None, None
    try:
        digest = _hash(file)
        if any(is_written(part) for part in file.files):
            raise RunError(Fault("is being recorded; index again when it ends"))
        run, mapping = _read(file)
        info = (
            info_of(read_log(run.path)) if mapping is None and file.path.endswith(".mcap") else None
        )
    except FileError as error:
        return [own | _faulty(file, digest, str(error.faults[0]))]
    if sum(part.stat().st_size for part in file.files) != file.size:
        return [own | _faulty(file, digest, "changed while it was read; index again")]
    if mapping is not None:
        digest = hashlib.sha256((digest + _content_hash(mapping)).encode()).hexdigest()
    where = None if mapping is None else mapping.relative_to(_library(file)).as_posix()
    shared = own | {"hash": digest, "mapping": where} | _of_file(run, info, file, profile)
    return [shared | _of_winch(run, prefix, file.path) for prefix in run.winches()]


def library_winch(path: str, prefix: str, metadata: str = "") -> str:
    """Name of a winch in the library: the first folder of the path that does not begin with a date,
    and ``/`` and the prefix where the run has prefixes; without such a folder the prefix or the
    ``metadata``."""
    folders = PurePosixPath(path).parts[:-1]
    named = next((name for name in folders if not _DATE.fullmatch(name)), "")
    return "/".join(filter(None, (named, prefix))) or metadata


def session_of(metadata: dict[str, str], time: datetime) -> str:
    """Session of a run: its metadata ``session``, else the UTC date of its start."""
    return metadata.get("session") or time.date().isoformat()


def _library(file: RunFile) -> Path:
    """Folder of the library, which the path of the file is below."""
    return file.files[0].parents[len(PurePosixPath(file.path).parts) - 1]


def _read(file: RunFile) -> tuple[Run, Path | None]:
    """Run of a file, and the mapping by which it was read; raises FileError."""
    # Parts have a common name that no file has.
    path = file.files[0] if len(file.files) == 1 else file.files[0].parent / Path(file.path).name
    fault: FileError | None = None
    if file.is_native:
        try:
            return read_run(path), None
        except FileError as error:
            fault = error
    for mapping in file.mappings:
        try:
            return read_run(path, mapping), mapping
        except FileError as error:
            fault = fault or error
    raise fault or RunError(Fault("no mapping has its columns", str(path)))


def _of_file(
    run: Run, info: LogInfo | None, file: RunFile, profile: ProfileOfRuns | None
) -> dict[str, Any]:
    texts = dict(run.metadata)
    time, source = _time(texts, info, file)
    return {
        "session": session_of(texts, time),
        "time": time,
        "time_source": source,
        "duration": float(np.ptp(run.time)) if len(run) else 0.0,
        "samples": len(run),
        "programme": texts.get("programme") or None,
        "profile": profile.hash if profile else None,
        "profile_name": profile.name if profile else texts.get("profile"),
        "counters": json.dumps(info.counters) if info and info.counters else None,
        "complete": info is None or info.closed is not False,
        "fault": None,
        "imported_from": texts.get("imported_from"),
    }


def _of_winch(run: Run, prefix: str, path: str) -> dict[str, Any]:
    own = run.of_winch(prefix)
    load = own.metadata.get(f"{prefix}.load_mass") if prefix else None
    return {
        "winch": library_winch(path, prefix, "" if prefix else own.metadata.get("winch", "")),
        "prefix": prefix,
        "load_mass": _mass(load) if load else own.load_mass,
        "temperature": _mean(own, "temperature"),
        "channels": sorted(own),
        "sanity": sorted({finding.code for finding in inspect_run(own).findings}),
    }


def _mass(text: str) -> float:
    from winchkit.units import parse

    return parse(text, "mass")


def _mean(run: Run, channel: str) -> float | None:
    if channel not in run or not np.isfinite(run[channel]).any():
        return None
    return float(np.nanmean(run[channel]))


def _time(texts: dict[str, str], info: LogInfo | None, file: RunFile) -> tuple[datetime, str]:
    """Time of the first sample (UTC), and where it is from."""
    if (found := _in_metadata(texts)) is not None:
        return found, "metadata"
    if info is not None and info.begun is not None:
        return datetime.fromisoformat(info.begun), "clock"
    for name in reversed(PurePosixPath(file.path).parts):
        if (found := _in_name(name)) is not None:
            return found, "path"
    return _changed(file), "file"


def _in_metadata(texts: dict[str, str]) -> datetime | None:
    known = {key.removeprefix(_SOURCE).casefold(): text for key, text in texts.items()}
    for key in _STARTS:
        text = _DAY_FIRST.sub(_year_first, known.get(key, "").strip())
        clock = known.get("time", "").strip()
        if len(text) == len("2026-03-01") and _CLOCK.fullmatch(clock):
            hours, _, rest = clock.partition(":")
            text = f"{text}T{int(hours):02d}:{rest}"
        try:
            found = datetime.fromisoformat(text)
        except ValueError:
            continue
        return found.replace(tzinfo=found.tzinfo or UTC).astimezone(UTC)
    return None


def _year_first(found: re.Match[str]) -> str:
    day, month, year, rest = found.groups()
    return f"{year}-{int(month):02d}-{int(day):02d}{rest}"


def _in_name(name: str) -> datetime | None:
    for found in _IN_A_NAME.finditer(name):
        year, month, day, hour, minute, second = (int(found[k] or 0) for k in (1, 3, 4, 5, 6, 7))
        try:
            return datetime(year, month, day, hour, minute, second, tzinfo=UTC)
        except ValueError:
            continue
    return None


def _changed(file: RunFile) -> datetime:
    """Date of change of the oldest part: a mapping may be newer."""
    return datetime.fromtimestamp(min(part.stat().st_mtime for part in file.files), UTC)


def _faulty(file: RunFile, digest: str, fault: str) -> dict[str, Any]:
    time = datetime.fromtimestamp(file.mtime / 1e9, UTC)
    return {
        "winch": library_winch(file.path, ""),
        "prefix": "",
        "time": time,
        "time_source": "file",
        "hash": digest,
        "fault": fault,
    }


def _hash(file: RunFile) -> str:
    """SHA-256 of the content of all parts; raises FileError."""
    if len(file.files) == 1:
        return _content_hash(file.files[0])
    return hashlib.sha256("".join(map(_content_hash, file.files)).encode()).hexdigest()


def _content_hash(path: Path) -> str:
    try:
        with path.open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except OSError as error:
        raise RunError(Fault(f"cannot be read: {error.strerror}", str(path))) from None

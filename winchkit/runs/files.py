"""Writing of files: none over an existing one unasked, all or nothing, cut to what is complete."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from winchkit.errors import Fault, FileError
from winchkit.runs.recording.log_file import refuse_written


def write_whole(path: Path, data: bytes) -> None:
    """Write a file completely or not at all; raises FileError, UsageError for an open log."""
    refuse_written([path])
    beside = path.with_name(f".{path.name}.new")
    try:
        beside.write_bytes(data)
        beside.replace(path)
    except OSError as error:
        with suppress(OSError):
            beside.unlink()
        raise _refused(path, error) from None


def abandoned(stream: BinaryIO, path: Path, whole: int, error: OSError) -> FileError:
    """Close a stream, truncate its file to ``whole`` bytes, and return the error to raise."""
    if not stream.closed:
        # Closing writes the buffer, which fails again; its partial output is truncated afterwards.
        with suppress(OSError):
            stream.close()
        with suppress(OSError):
            os.truncate(path, whole)
    return _refused(path, error)


def _refused(path: Path, error: OSError) -> FileError:
    return FileError(Fault(f"cannot be written: {error.strerror}", str(path)))

"""Opening of a log for writing, in the format of its suffix."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from winchkit.runs.layout import Layout
from winchkit.runs.recording.rotation import Rotation
from winchkit.runs.recording.writer import LogWriter, Watch


def open_log(
    path: Path,
    layout: Layout,
    metadata: Mapping[str, str],
    rotation: Rotation | None = None,
    watch: Watch = lambda _descriptor: None,
    *,
    replace: bool = False,
) -> LogWriter:
    """Start a log in the format of the file's suffix; raises UsageError, FileError.

    Its files are locked while they are written.
    """
    if path.suffix.lower() == ".mcap":
        from winchkit.runs.recording.channels import ChannelLog

        return ChannelLog(path, layout, metadata, rotation, watch, replace=replace)
    from winchkit.runs.recording.rows import RowLog
    from winchkit.runs.writer import kind_for

    kind_for(path)
    return RowLog(path, layout, metadata, rotation, watch, replace=replace)

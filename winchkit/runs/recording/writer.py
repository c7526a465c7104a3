"""Base class of log writers: samples in, one file or several parts out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from winchkit.errors import UsageError
from winchkit.runs.layout import Layout, SourceSamples
from winchkit.runs.recording.log_file import begin_log, create
from winchkit.runs.recording.rotation import Rotation, part_path

Watch = Callable[[int], None]
"""Called with the descriptor of every file that is written."""


class LogWriter(ABC):
    """Writes the new samples of every source. Raises FileError where it cannot."""

    def __init__(
        self,
        path: Path,
        layout: Layout,
        metadata: Mapping[str, str],
        rotation: Rotation | None,
        watch: Watch,
        *,
        replace: bool,
    ) -> None:
        self.rows = 0
        """Rows of the run so far."""
        self.parts: list[Path] = []
        """Files so far, the last one being written."""
        self._path, self._layout = path, layout
        self.metadata = metadata
        """Metadata of further parts."""
        self._rotation, self._watch = rotation, watch
        self._began = layout.rule.opened
        first = part_path(path, 1) if rotation else path
        self._put_part(1, first, begin_log(path, first, replace=replace))

    def write(self, pieces: Mapping[str, SourceSamples], now: float) -> None:
        """Write samples by topic, and flush them to the operating system."""
        if self._rotation and self._rotation.due(self._size(), now - self._began):
            self._close_part({})
            self._began = now
            self._next_part()
        self._put(pieces, now)

    def add_event(self, time: float, event: Mapping[str, Any]) -> None:
        """Keep an event at a moment (s), where the format has a place for it."""
        return

    def count(self, time: float, counters: Mapping[str, Any]) -> None:
        """Keep what was counted until a moment (s), where the format has a place for it."""
        return

    def close(self, end: Mapping[str, str]) -> None:
        """Finish the file; ``end`` has the counters."""
        self._close_part(end)

    def _next_part(self) -> None:
        """Continue in a new file; numbers of existing non-empty files are skipped."""
        while True:
            self._number += 1
            path = part_path(self._path, self._number)
            try:
                stream = create(path, replace=False)
            except UsageError:
                continue
            self._put_part(self._number, path, stream)
            return

    def _put_part(self, number: int, path: Path, stream: BinaryIO) -> None:
        self._number = number
        self.parts.append(path)
        self._open_part(path, stream, {"part": str(number)} if self._rotation else {})

    @abstractmethod
    def require_in_place(self) -> None:
        """Raise FileError where another program has removed, replaced or truncated the file."""

    @abstractmethod
    def _open_part(self, path: Path, stream: BinaryIO, about: Mapping[str, str]) -> None: ...

    @abstractmethod
    def _put(self, pieces: Mapping[str, SourceSamples], now: float) -> None: ...

    @abstractmethod
    def _close_part(self, end: Mapping[str, str]) -> None: ...

    @abstractmethod
    def _size(self) -> int:
        """Bytes of the part so far."""

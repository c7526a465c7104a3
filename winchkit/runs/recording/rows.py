"""A log as rows: CSV, aligned while it is recorded."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from winchkit.runs.align import Aligner
from winchkit.runs.layout import Layout, SourceSamples
from winchkit.runs.recording.writer import LogWriter
from winchkit.runs.run_writer import RunWriter
from winchkit.runs.writer import kind_for


class RowLog(LogWriter):
    """Rows at the samples of the slowest instrument."""

    _writer: RunWriter

    def __init__(self, path: Path, layout: Layout, *others: Any, replace: bool) -> None:
        self._aligner, self._newest = Aligner(layout), layout.rule.opened
        self._events: list[tuple[float, Mapping[str, Any]]] = []
        self._event: tuple[float, Mapping[str, Any]] | None = None
        super().__init__(path, layout, *others, replace=replace)

    def _open_part(self, path: Path, stream: BinaryIO, about: Mapping[str, str]) -> None:
        metadata = {**self.metadata, **about}
        columns = self._layout.columns()
        self._writer = kind_for(path)(path, columns, metadata, time.monotonic, lambda: stream)
        self._watch(self._writer.descriptor)
        if self._event and not self._events:  # else the waiting ones end with it
            self._events.append(self._event)

    def add_event(self, time: float, event: Mapping[str, Any]) -> None:
        """Keep an event (s) until the first row has a time; the last one begins the next part."""
        self._event = time, event
        self._events.append(self._event)

    def _put(self, pieces: Mapping[str, SourceSamples], now: float) -> None:
        for topic, samples in pieces.items():
            self._aligner.add(topic, samples.times, samples.values)
        self._newest = now
        self._append(self._aligner.rows(now))

    def _append(self, rows: NDArray[np.float64]) -> None:
        for row in rows.tolist():
            self._writer.append_values(row)
        if self._aligner.start is not None:
            for moment, event in self._events:
                self._writer.add_event(moment - self._aligner.start, event)
            self._events.clear()
        self._writer.flush()
        self.rows += len(rows)

    def close(self, end: Mapping[str, str]) -> None:
        """Write the rows that wait for a source, and finish the file, where one is open."""
        try:
            if self._writer.is_open:
                self._append(self._aligner.rows(self._newest, ends=True))
        finally:
            super().close(end)

    def _close_part(self, end: Mapping[str, str]) -> None:
        self._writer.close()

    def require_in_place(self) -> None:
        """Raise FileError where another program has removed, replaced or cut the file."""
        self._writer.require_in_place()

    def _size(self) -> int:
        return self._writer.size

"""A log as rows: CSV as it grows, aligned while it is recorded."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from winchkit.runs.align import Aligner
from winchkit.runs.layout import Layout, Samples
from winchkit.runs.log_writer import LogWriter
from winchkit.runs.run_writer import RunWriter
from winchkit.runs.writer import open_writer

__all__ = ["RowLog"]


class RowLog(LogWriter):
    """Rows at the moments of the slowest instrument."""

    _writer: RunWriter

    def __init__(self, path: Path, layout: Layout, *others: Any) -> None:
        self._aligner = Aligner(layout)
        super().__init__(path, layout, *others)

    def _open_part(self, path: Path, about: Mapping[str, str]) -> None:
        self._writer = open_writer(path, self._layout.columns(), {**self._metadata, **about})
        self._watch(self._writer.descriptor)

    def _put(self, pieces: Mapping[str, Samples], now: float) -> None:
        for topic, samples in pieces.items():
            self._aligner.add(topic, samples.times, samples.values)
        rows = self._aligner.rows(now)
        for row in rows.tolist():
            self._writer.append_values(row)
        self._writer.flush()
        self.rows += len(rows)

    def _close_part(self, end: Mapping[str, str]) -> None:
        self._writer.close()

    def _size(self) -> int:
        return self._writer.size

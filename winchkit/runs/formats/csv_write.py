"""Writer of runs in CSV: metadata lines, one header line, numbers without loss of digits."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

from winchkit.runs.run_writer import RunWriter

CSV_MARK = "# written by winchkit"
"""First line of a CSV file of winchkit, each of whose lines ends with a line feed.

A run without metadata that is written at once starts with its header instead.
"""
EVENT_MARK = "# event"
"""Start of a comment between the rows: the time of an event (s), a colon, a JSON object."""


class CsvWriter(RunWriter):
    """A CSV file in UTF-8; a missing value is an empty cell."""

    flush_interval = 0.5

    def _begin(self, metadata: Mapping[str, str]) -> None:
        self._waiting: list[str] = []
        lines = [f"# {key}: {value}\n" for key, value in metadata.items()]
        header = io.StringIO()
        cells = [f"{name} [{unit}]" if unit else name for name, unit in self.columns]
        csv.writer(header, lineterminator="\n").writerow(cells)
        if metadata or self.is_streamed:
            lines.insert(0, f"{CSV_MARK}\n")
        self._stream.write("".join([*lines, header.getvalue()]).encode())

    def add_event(self, time: float, event: Mapping[str, Any]) -> None:
        """Add an event at a time of the run (s) as a comment between the rows."""
        self._waiting.append(f"{EVENT_MARK} {time:.6f} s: {json.dumps(event)}\n")

    def _row(self, values: Sequence[float]) -> None:
        # NaN is the only number that differs from itself.
        cells = [repr(value) if value == value else "" for value in values]  # noqa: PLR0124
        self._waiting.append(",".join(cells) + "\n")

    def _hand_over(self) -> None:
        # Complete rows in one write: a number that is cut off would be read as another one.
        self._stream.write("".join(self._waiting).encode())
        self._waiting.clear()

"""Base class of run writers: rows, flushed in time, and one error for a full disk."""

from __future__ import annotations

import csv
import io
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Self

from winchkit.errors import UsageError, suggest
from winchkit.runs.files import abandoned
from winchkit.runs.recording.log_file import require_in_place

Columns = Sequence[tuple[str, str]]
"""Names and units of the columns, in order."""
Clock = Callable[[], float]


class RunWriter(ABC):
    """Writer of a run, and context manager that closes it."""

    flush_interval: float

    def __init__(
        self,
        path: Path,
        columns: Columns,
        metadata: Mapping[str, str],
        clock: Clock,
        begin: Callable[[], BinaryIO],
        *,
        is_streamed: bool = True,
    ) -> None:
        """``begin`` opens the file; one that is streamed may be cut off at any moment."""
        self.is_streamed = is_streamed
        self.path = path
        self.columns = tuple(columns)
        self._names = [name for name, _ in columns]
        self._clock = clock
        self._flushed = clock()
        if "time" not in self._names:
            raise UsageError(f"{path}: a run needs a column 'time'")
        for text in (text for column in columns for text in column):
            if "\n" in text or "\r" in text:
                raise UsageError(f"{path}: a line break in the name or unit of a column: {text!r}")
        self._whole = 0
        self._stream = begin()
        with self._writing():
            self._begin({_words(key): _words(value) for key, value in metadata.items()})
        self.flush()

    @property
    def descriptor(self) -> int:
        """Descriptor of the open file, for fsync."""
        return self._stream.fileno()

    @property
    def is_open(self) -> bool:
        """Whether rows can still be added."""
        return not self._stream.closed

    @property
    def size(self) -> int:
        """Bytes written so far."""
        return self._stream.tell()

    def append(self, row: Mapping[str, float]) -> None:
        """Add a row; missing columns are NaN. Raises UsageError for an unknown one."""
        for name in row:
            if name not in self._names:
                known = f"no column '{name}' in {self.path}; it has {', '.join(self._names)}"
                raise UsageError(known + suggest(name, self._names))
        self.append_values([row.get(name, math.nan) for name in self._names])

    def append_values(self, values: Iterable[float]) -> None:
        """Add a row in the order of the columns; numbers that are not finite are missing values."""
        if self._stream.closed:
            raise UsageError(f"{self.path} is closed; no row can follow")
        with self._writing():
            self._row([float(value) if math.isfinite(value) else math.nan for value in values])
        now = self._clock()
        if now - self._flushed >= self.flush_interval:
            self.flush()

    def add_event(self, time: float, event: Mapping[str, Any]) -> None:
        """Add an event at a time of the run (s), where the format has a place for it."""
        return

    def require_in_place(self) -> None:
        """Raise FileError where the file was removed, replaced or truncated."""
        require_in_place(self.path, self._stream, self._whole)

    def flush(self) -> None:
        """Flush the rows to the operating system, so that they are kept if this process ends."""
        with self._writing():
            if not self._stream.closed:
                self._hand_over()
                self._stream.flush()
                self._whole = self._stream.tell()
        self._flushed = self._clock()

    def close(self) -> None:
        """Finish the file; further calls have no effect."""
        if not self._stream.closed:
            with self._writing():
                self._hand_over()
                self._end()
                self._stream.close()

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Convert the error of a full disk to FileError, and close the writer."""
        try:
            yield
        except OSError as error:
            raise abandoned(self._stream, self.path, self._whole, error) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @abstractmethod
    def _begin(self, metadata: Mapping[str, str]) -> None: ...

    @abstractmethod
    def _row(self, values: Sequence[float]) -> None: ...

    def _hand_over(self) -> None:
        """Flush buffers of the format; without effect in the base class."""
        return

    def _end(self) -> None:
        """Write the end of the file; without effect in the base class."""
        return


def _words(text: str) -> str:
    """A text in one line, with single spaces."""
    return " ".join(text.split())


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

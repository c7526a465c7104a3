"""Logs that are written: rows (CSV), or channels with the time stamps of every source (MCAP)."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from winchkit.plain_json import without_nan
from winchkit.runs.align import Aligner, Moments
from winchkit.runs.files import abandoned
from winchkit.runs.formats.mcap_file import (
    CDR,
    COUNTERS,
    END,
    EVENTS,
    LOG,
    METADATA,
    PROFILE,
    McapFile,
    message_definition,
    message_name,
)
from winchkit.runs.formats.mcap_records import pack_messages
from winchkit.runs.layout import Layout, SourceSamples, write_layout
from winchkit.runs.recording.log_file import require_in_place
from winchkit.runs.recording.rotation import Rotation
from winchkit.runs.recording.writer import LogWriter, Watch
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


class ChannelLog(LogWriter):
    """One topic per source, and topics of events and counters."""

    _file: McapFile

    def __init__(self, path: Path, layout: Layout, *others: Any, replace: bool) -> None:
        self._aligner, self._moments = Aligner(layout), Moments(layout)
        self._numbers = {source.topic: n for n, source in enumerate(layout.sources, start=1)}
        self._notes = {EVENTS: len(self._numbers) + 1, COUNTERS: len(self._numbers) + 2}
        self._sequences = dict.fromkeys([*self._numbers, *self._notes], 0)
        self._waiting: list[bytes] = []
        self._newest = layout.rule.opened
        super().__init__(path, layout, *others, replace=replace)

    def add_event(self, time: float, event: Mapping[str, Any]) -> None:
        """Keep an event at a moment (s)."""
        self._note(EVENTS, time, event)

    def count(self, time: float, counters: Mapping[str, Any]) -> None:
        """Keep what was counted until a moment (s)."""
        self._note(COUNTERS, time, counters)

    def _note(self, topic: str, time: float, value: Mapping[str, Any]) -> None:
        data = np.frombuffer(_json(value), np.uint8)[None, :]
        stamp = self._stamps(np.array([time]))
        self._waiting.append(self._packed(topic, self._notes[topic], stamp, stamp, data))

    def _open_part(self, path: Path, stream: BinaryIO, about: Mapping[str, str]) -> None:
        self._whole = 0
        self._stream = stream
        with self._writing():
            self._watch(self._stream.fileno())
            self._file = McapFile(self._stream, PROFILE, "winchkit")
            for source in self._layout.sources:
                number = self._numbers[source.topic]
                definition = message_definition(source.signals)
                self._file.put_schema(number, message_name(source), "ros2msg", definition)
                self._file.put_channel(number, number, source.topic, "cdr")
            note = len(self._numbers) + 1
            self._file.put_schema(note, "winchkit.Note", "jsonschema", b'{"type":"object"}')
            for topic, number in self._notes.items():
                self._file.put_channel(number, note, topic, "json")
            self._file.put_metadata(METADATA, {**self.metadata, **about})
            rule = replace(self._layout.rule, start=self._aligner.start)
            layout = write_layout(replace(self._layout, rule=rule))
            self._file.put_metadata(LOG, {"layout": layout, **about})

    def _put(self, pieces: Mapping[str, SourceSamples], now: float) -> None:
        content = [self._message_block(topic, samples) for topic, samples in pieces.items()]
        self._put_chunk([*content, *self._waiting])
        if self._aligner.start is None:
            # Later parts need the time of the first row, from which time is counted.
            for topic, samples in pieces.items():
                self._aligner.add(topic, samples.times, samples.values)
            self._aligner.rows(now)
        for topic, samples in pieces.items():
            self._moments.add(topic, samples.times)
        self._newest = now
        self._count_rows(ends=False)

    def _count_rows(self, *, ends: bool) -> None:
        """Count the rows that the run of this log has so far."""
        start = self._aligner.start
        if start is not None:
            self.rows += int(np.count_nonzero(self._moments.take(self._newest, ends=ends) >= start))

    def close(self, end: Mapping[str, str]) -> None:
        """Count the last rows, and finish the file."""
        self._count_rows(ends=True)
        super().close(end)

    def _close_part(self, end: Mapping[str, str]) -> None:
        if self._stream.closed:
            return
        self._put_chunk(self._waiting)
        with self._writing():
            if end:
                self._file.put_metadata(END, end)
            self._file.finish()
        self._stream.close()

    def require_in_place(self) -> None:
        """Raise FileError where another program has removed, replaced or cut the file."""
        require_in_place(self.parts[-1], self._stream, self._whole)

    def _size(self) -> int:
        return self._file.size

    def _put_chunk(self, blocks: list[bytes]) -> None:
        content = b"".join(blocks)
        self._waiting = []
        if content:
            with self._writing():
                self._file.put_chunk(content)

    def _message_block(self, topic: str, samples: SourceSamples) -> bytes:
        known = np.isfinite(samples.times)
        times, received = samples.times[known], samples.received[known]
        values = np.ascontiguousarray(samples.values[known], dtype="<f8")
        data = np.empty((len(values), len(CDR) + 8 * values.shape[1]), np.uint8)
        data[:, : len(CDR)] = np.frombuffer(CDR, np.uint8)
        data[:, len(CDR) :] = values.view(np.uint8)
        arrived = self._stamps(np.where(np.isfinite(received), received, times))
        return self._packed(topic, self._numbers[topic], self._stamps(times), arrived, data)

    def _stamps(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.rint(times * 1e9).astype(np.int64) + self._layout.clock_offset

    def _packed(
        self,
        topic: str,
        number: int,
        sampled: NDArray[np.int64],
        arrived: NDArray[np.int64],
        data: NDArray[np.uint8],
    ) -> bytes:
        begin = self._sequences[topic]
        self._sequences[topic] = begin + len(data)
        return pack_messages(number, begin, sampled, arrived, data)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Flush at the end; raise FileError for a full disk, and keep the complete part."""
        try:
            yield
            self._stream.flush()
            self._whole = self._file.size
        except OSError as error:
            raise abandoned(self._stream, self.parts[-1], self._whole, error) from None


def _json(value: object) -> bytes:
    """JSON with null for numbers that are not finite."""
    return json.dumps(without_nan(value), separators=(",", ":"), allow_nan=False).encode()


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
        return ChannelLog(path, layout, metadata, rotation, watch, replace=replace)
    from winchkit.runs.writer import kind_for

    kind_for(path)
    return RowLog(path, layout, metadata, rotation, watch, replace=replace)

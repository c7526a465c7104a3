"""Reader of runs and logs in MCAP; of a file that was cut off, all complete records."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError
from winchkit.runs.assemble import RawColumns, assemble, refuse
from winchkit.runs.formats.csv_read import cut_off, read_bytes
from winchkit.runs.formats.mcap_file import (
    CDR,
    COLUMNS,
    COUNTERS,
    END,
    EVENTS,
    LOG,
    METADATA,
    TOPIC,
)
from winchkit.runs.formats.mcap_records import (
    MARK,
    Damage,
    McapRecord,
    MessageBlock,
    Op,
    RecordBody,
    chunk_content,
    is_intact,
    joint_after,
    next_chunk,
    records,
)
from winchkit.runs.layout import Layout, SignalSource, SourceSamples, read_layout
from winchkit.runs.log import Log, Note, aligned, known_event, log_of_run, tables_in
from winchkit.runs.run import Run


@dataclass
class McapContent:
    """Content of a file."""

    topics: dict[int, str] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    """Metadata records by name."""
    messages: dict[str, list[MessageBlock]] = field(default_factory=dict)
    """By topic, in the order of the file."""
    complete: bool = False
    damage: str = ""
    """Reason why reading ended before the end of the file, other than a cut-off file."""

    def count(self, topic: str) -> int:
        """Number of messages of a topic."""
        return sum(len(batch.log_times) for batch in self.messages.get(topic, ()))


def read_content(data: bytes) -> McapContent:
    """Read an MCAP file that starts with its magic bytes; damage is noted in the result."""
    content = McapContent()
    end = len(MARK)
    try:
        for item in records(data, len(MARK)):
            if isinstance(item, McapRecord) and item.op == Op.FOOTER:
                content.complete = data[item.end :] == MARK
                break
            if (
                isinstance(item, McapRecord)
                and item.op == Op.DATA_END
                and not is_intact(item, data)
            ):
                content.damage = "the checksum of its data is wrong"
                break
            _take(content, item)
            end = item.end
    except Damage as error:
        content.damage = str(error)
    if not content.complete:
        content.damage = _not_cut(data, end, content.damage)
    return content


def _not_cut(data: bytes, end: int, damage: str) -> str:
    """Why a file whose whole records end before its end was not cut off there; else empty."""
    joint = joint_after(data, len(MARK))
    if joint < len(data):
        return f"another log was joined to it, which begins at byte {joint}"
    if not damage and (data.endswith(MARK, end) or next_chunk(data, end + 1) < len(data)):
        return f"the record at byte {end} has a wrong length"
    return damage


def _take(content: McapContent, item: McapRecord | MessageBlock) -> None:
    if isinstance(item, MessageBlock):
        if item.channel in content.topics:
            content.messages.setdefault(content.topics[item.channel], []).append(item)
    elif item.op == Op.CHUNK:
        packed = chunk_content(item.body)
        end = 0
        for inner in records(packed):
            _take(content, inner)
            end = inner.end
        if end != len(packed):
            raise Damage("a chunk ends within a record")
    elif item.op == Op.CHANNEL:
        fields = RecordBody(item.body)
        number = fields.number(2)
        fields.number(2)
        content.topics[number] = fields.text()
    elif item.op == Op.METADATA:
        fields = RecordBody(item.body)
        name = fields.text()
        content.metadata[name] = fields.texts()


def samples_of(content: McapContent, source: SignalSource, layout: Layout) -> SourceSamples:
    """Samples of a source; raises Damage where its messages do not match the layout."""
    size = len(CDR) + 8 * len(source.signals)
    pieces = []
    for batch in content.messages.get(source.topic, ()):
        if batch.data.shape[1] != size:
            raise Damage(f"a message of {source.topic} has {batch.data.shape[1]} bytes, not {size}")
        values = np.ascontiguousarray(batch.data[:, len(CDR) :]).view("<f8")
        times = _seconds(batch.log_times, layout)
        pieces.append(SourceSamples(times, _seconds(batch.publish_times, layout), values))
    return SourceSamples.joined(pieces, len(source.signals))


def _seconds(stamps: NDArray[np.uint64], layout: Layout) -> NDArray[np.float64]:
    """Time stamps on the bench's clock, s."""
    return (stamps.astype(np.int64) - layout.clock_offset) / 1e9


def read_mcap(path: str | Path) -> Run:
    """Read a run; raises RunError for any other file. Of a cut-off file the complete rows."""
    name, content = str(path), _content(path)
    return aligned(_log(name, content)) if LOG in content.metadata else _run(name, content)


def read_mcap_log(path: str | Path) -> Log:
    """Read a log by channels; a run of rows is a log of one source. Raises RunError."""
    name, content = str(path), _content(path)
    if LOG in content.metadata:
        return _log(name, content)
    return log_of_run(_run(name, content), content.complete)


def _content(path: str | Path) -> McapContent:
    name, data = str(path), read_bytes(Path(path))
    if not data.startswith(MARK):
        raise RunError(Fault("is not an MCAP file: it does not start with its magic bytes", name))
    content = read_content(data)
    if content.damage:
        rows = content.count(TOPIC)
        message = f"is damaged after {rows} rows: {content.damage}"
        if LOG in content.metadata:
            message = f"is damaged: {content.damage}"
        advice = "; `winchkit log recover` saves the complete part"
        raise RunError(Fault(message + advice, name))
    return content


def _run(name: str, content: McapContent) -> Run:
    """A run that was written row by row."""
    columns = content.metadata.get(COLUMNS, {})
    if not columns:
        topics = ", ".join(sorted(set(content.topics.values()))) or "none"
        message = f"has no run: there is no metadata record '{COLUMNS}'; its topics are {topics}"
        raise RunError(Fault(message, name))
    rows = [bytes(row) for batch in content.messages.get(TOPIC, ()) for row in batch.data]
    notes = []
    if not content.complete:
        notes.append(cut_off(name, f"{len(rows)} whole rows"))
    values = _values(name, list(columns), rows)
    metadata = content.metadata.get(METADATA, {})
    header = list(columns.items())
    return assemble(RawColumns(name, header, list(values), metadata=metadata, notes=notes))


def _values(path: str, names: list[str], rows: list[bytes]) -> Array:
    """Columns by rows, NaN for null and for absent keys."""
    values = np.full((len(names), len(rows)), np.nan)
    faults: list[Fault] = []
    for index, message in enumerate(rows):
        row = _object(message)
        cells = [None] if row is None else [_number(row.get(name)) for name in names]
        if None in cells:
            faults.append(Fault(f"row {index + 1} is no JSON object of numbers", path))
        else:
            values[:, index] = cells
    refuse(faults)
    return values


def _object(message: bytes) -> dict[str, Any] | None:
    """A JSON object; None where it is none."""
    try:
        found = json.loads(message)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _number(value: object) -> float | None:
    """A cell's value, NaN for null; None where it is no number."""
    if value is None:
        return float("nan")
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def _log(name: str, content: McapContent) -> Log:
    layout = read_layout(content.metadata[LOG].get("layout", ""), name)
    try:
        samples = {item.topic: samples_of(content, item, layout) for item in layout.sources}
    except Damage as error:
        raise RunError(Fault(f"is damaged: {error}", name)) from None
    notes = []
    if not content.complete:
        count = sum(map(len, samples.values()))
        notes.append(cut_off(name, f"{count} whole samples"))
    return Log(
        name,
        layout,
        samples,
        content.metadata.get(METADATA, {}),
        _notes(content, EVENTS, layout.clock_offset, known_event),
        _notes(content, COUNTERS, layout.clock_offset, tables_in),
        content.metadata.get(END, {}),
        content.complete,
        tuple(notes),
    )


def _notes(
    content: McapContent, topic: str, offset: int, known: Callable[[dict[str, Any]], dict[str, Any]]
) -> tuple[Note, ...]:
    """JSON messages, of each the entries that ``known`` accepts."""
    found: list[Note] = []
    for batch in content.messages.get(topic, ()):
        for stamp, data in zip(batch.log_times.tolist(), batch.data, strict=True):
            value = _object(bytes(data))
            if value is not None:
                found.append(Note((stamp - offset) / 1e9, known(value)))
    return tuple(found)

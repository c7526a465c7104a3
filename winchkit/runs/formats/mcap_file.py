"""Writer of an MCAP file, record by record, with the index at its end."""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import BinaryIO

import numpy as np
import zstandard

from winchkit.runs.formats.mcap_records import (
    MARK,
    McapRecord,
    MessageBlock,
    Op,
    RecordBody,
    records,
)
from winchkit.runs.layout import SignalSource, SourceSignal

PROFILE = "winchkit"
TOPIC = "run"
SCHEMA = "winchkit.Row"
METADATA = "winchkit.metadata"
COLUMNS = "winchkit.columns"
LOG = "winchkit.log"
"""Metadata record of a log: its ``layout`` as JSON, and the number of its ``part``."""
END = "winchkit.end"
"""Metadata record of a closed log: its counters."""
EVENTS = "/events"
COUNTERS = "/counters"
CDR = b"\x00\x01\x00\x00"
"""Header of a CDR message: little-endian; the data after it are aligned to eight bytes."""

_WORD = re.compile(r"[A-Za-z]+")


def row_schema(columns: Sequence[tuple[str, str]]) -> bytes:
    """The JSON schema of a row; each property carries its unit."""
    properties = {name: {"type": ["number", "null"], "unit": unit} for name, unit in columns}
    return json.dumps({"title": SCHEMA, "type": "object", "properties": properties}).encode()


def message_name(source: SignalSource) -> str:
    """Name of a source's message type, after the last word of its topic."""
    word: str = _WORD.findall(source.topic)[-1]
    return f"winchkit/msg/{word.capitalize()}"


def message_definition(signals: Sequence[SourceSignal]) -> bytes:
    """The ROS 2 definition of a message; each field has its unit as a comment."""
    return "".join(f"float64 {item.name} # {item.unit}\n" for item in signals).encode()


_LEVEL = 1
"""Fastest of zstd: a log is compressed while it is recorded."""


class McapFile:
    """Writes records to a stream that it does not own; ``finish`` writes the index."""

    def __init__(self, stream: BinaryIO, profile: str, library: str) -> None:
        self._stream = stream
        self._at = self._crc = 0
        self._repeated: dict[int, list[bytes]] = {op: [] for op in _GROUPS}
        self._counts: Counter[int] = Counter()
        self._kinds: Counter[int] = Counter()
        self._first, self._last = 0, 0
        self._packer = zstandard.ZstdCompressor(level=_LEVEL)
        self._write(MARK)
        self.put(Op.HEADER, _text(profile) + _text(library))

    @property
    def size(self) -> int:
        """Bytes so far."""
        return self._at

    def put(self, op: int, body: bytes) -> None:
        """Write a record, and note its entry of the index."""
        at = self._at
        self._write(_record(op, body))
        self._kinds[op] += 1
        if op in (Op.SCHEMA, Op.CHANNEL):
            self._repeated[op].append(_record(op, body))
        elif op == Op.METADATA:
            index = struct.pack("<QQ", at, self._at - at) + _text(RecordBody(body).text())
            self._repeated[Op.METADATA_INDEX].append(_record(Op.METADATA_INDEX, index))

    def put_schema(self, number: int, name: str, encoding: str, data: bytes) -> None:
        """Declare a kind of message."""
        head = struct.pack("<H", number) + _text(name) + _text(encoding)
        self.put(Op.SCHEMA, head + struct.pack("<I", len(data)) + data)

    def put_channel(self, number: int, schema: int, topic: str, encoding: str) -> None:
        """Declare a topic."""
        head = struct.pack("<HH", number, schema)
        self.put(Op.CHANNEL, head + _text(topic) + _text(encoding) + texts({}))

    def put_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        self.put(Op.METADATA, _text(name) + texts(values))

    def put_chunk(self, content: bytes) -> None:
        """Write records as one compressed chunk, followed by the index of its messages."""
        batches = [item for item in records(content) if isinstance(item, MessageBlock)]
        for item in records(content):
            if isinstance(item, McapRecord) and item.op in (Op.SCHEMA, Op.CHANNEL):
                self._kinds[item.op] += 1
                self._repeated[item.op].append(_record(item.op, bytes(item.body)))
        first = min((int(item.log_times.min()) for item in batches), default=0)
        last = max((int(item.log_times.max()) for item in batches), default=0)
        packed = self._packer.compress(content)
        about = struct.pack("<QQQI", first, last, len(content), zlib.crc32(content))
        at = self._at
        self.put(Op.CHUNK, about + _text("zstd") + struct.pack("<Q", len(packed)) + packed)
        index_at, offsets = self._at, b""
        for channel in dict.fromkeys(item.channel for item in batches):
            offsets += struct.pack("<HQ", channel, self._at)
            self.put(Op.MESSAGE_INDEX, _message_index(channel, batches))
        for item in batches:
            self.count(item)
        self._repeated[Op.CHUNK_INDEX].append(
            _record(
                Op.CHUNK_INDEX,
                struct.pack("<QQQQI", first, last, at, index_at - at, len(offsets))
                + offsets
                + struct.pack("<Q", self._at - index_at)
                + _text("zstd")
                + struct.pack("<QQ", len(packed), len(content)),
            )
        )

    def count(self, batch: MessageBlock) -> None:
        """Note messages for the statistics."""
        first, last = int(batch.log_times.min()), int(batch.log_times.max())
        self._first = min(self._first, first) if self._counts else first
        self._last = max(self._last, last)
        self._counts[batch.channel] += len(batch.log_times)

    def put_messages(self, batch: MessageBlock, data: bytes) -> None:
        """Write messages outside any chunk."""
        self._write(data)
        self.count(batch)

    def finish(self) -> None:
        """Write the index and the end; the stream stays open."""
        self.put(Op.DATA_END, struct.pack("<I", self._crc))
        self._repeated[Op.STATISTICS].append(_record(Op.STATISTICS, self._statistics()))
        start, summary, offsets = self._at, b"", b""
        for op, items in self._repeated.items():
            group = b"".join(items)
            if group:
                place = struct.pack("<BQQ", op, start + len(summary), len(group))
                offsets += _record(Op.SUMMARY_OFFSET, place)
                summary += group
        places = struct.pack("<QQ", start, start + len(summary))
        covered = summary + offsets + struct.pack("<BQ", Op.FOOTER, 20) + places
        self._write(covered + struct.pack("<I", zlib.crc32(covered)) + MARK)

    def _statistics(self) -> bytes:
        counts = b"".join(struct.pack("<HQ", *item) for item in self._counts.items())
        return (
            struct.pack(
                "<QHIIIIQQI",
                sum(self._counts.values()),
                self._kinds[Op.SCHEMA],
                self._kinds[Op.CHANNEL],
                0,
                self._kinds[Op.METADATA],
                self._kinds[Op.CHUNK],
                self._first,
                self._last,
                len(counts),
            )
            + counts
        )

    def _write(self, data: bytes) -> None:
        self._stream.write(data)
        self._at += len(data)
        self._crc = zlib.crc32(data, self._crc)


_GROUPS = (Op.SCHEMA, Op.CHANNEL, Op.STATISTICS, Op.CHUNK_INDEX, Op.METADATA_INDEX)


def texts(values: Mapping[str, str]) -> bytes:
    """A map of texts in the encoding of MCAP."""
    packed = b"".join(_text(key) + _text(value) for key, value in values.items())
    return struct.pack("<I", len(packed)) + packed


def _text(value: str) -> bytes:
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def _record(op: int, body: bytes) -> bytes:
    return struct.pack("<BQ", op, len(body)) + body


def _message_index(channel: int, batches: list[MessageBlock]) -> bytes:
    """Log time and place of every message of a channel in a chunk, in order of time."""
    own = [item for item in batches if item.channel == channel]
    times = np.concatenate([item.log_times for item in own])
    places = np.concatenate(
        [item.offset + item.size * np.arange(len(item.log_times)) for item in own]
    )
    pairs = np.column_stack([times, places.astype(np.uint64)]).astype("<u8")
    pairs = pairs[np.argsort(times, kind="stable")]
    return struct.pack("<HI", channel, pairs.nbytes) + pairs.tobytes()

"""Parser of MCAP files: complete records, and batches of messages of one kind.

Consecutive messages of one channel and size are one batch of arrays: a log of eight winches at 1
kHz has five million messages in ten minutes.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

MARK = b"\x89MCAP0\r\n"
"""First and last bytes of a file."""
_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = 22
"""Bytes of a Message record before its data: channel (2), sequence (4), two times (8 each)."""
_LARGEST = 1 << 30
"""Bytes of a chunk; a larger size in its header is that of a damaged file."""
_ZSTD = b"\x04\0\0\0zstd"
_ZSTD_AT = 37
"""Position of the name of the compression in a chunk record, by which chunks are searched."""
_FIRST_LOOK, _LOOK_GROWTH = 16, 16
"""Messages that are compared with the first for equal length, and growth of their number while all
agree: few comparisons in a chunk of mixed channels, few steps in a chunk of one."""


class Op:
    """Kinds of records."""

    HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 1, 2, 3, 4, 5, 6
    MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, METADATA, METADATA_INDEX = 7, 8, 11, 12, 13
    SUMMARY_OFFSET, DATA_END = 14, 15


class Damage(ValueError):
    """Invalid bytes; the readers of files convert it to an error with its place."""


@dataclass(frozen=True)
class McapRecord:
    """One record of the file."""

    op: int
    offset: int
    body: memoryview

    @property
    def end(self) -> int:
        """Start of the next record."""
        return self.offset + _HEAD.size + len(self.body)


@dataclass(frozen=True)
class MessageBlock:
    """Consecutive messages of one channel and size."""

    channel: int
    offset: int
    size: int
    """Size of each record with its header, bytes."""
    log_times: NDArray[np.uint64]
    publish_times: NDArray[np.uint64]
    data: NDArray[np.uint8]
    """Shape (n, bytes)."""

    @property
    def end(self) -> int:
        """Start of the next record."""
        return self.offset + self.size * len(self.log_times)


def records(data: bytes, start: int = 0) -> Iterator[McapRecord | MessageBlock]:
    """Records from ``start`` to the end or to an incomplete record; raises Damage."""
    view = memoryview(data)
    while start + _HEAD.size <= len(data):
        op, length = _HEAD.unpack_from(data, start)
        end = start + _HEAD.size + length
        if op == 0:
            raise Damage(f"no record begins at byte {start}")
        if end > len(data):
            return
        if op == Op.MESSAGE:
            batch = _messages(data, start, length)
            yield batch
            start = batch.end
        else:
            yield McapRecord(op, start, view[start + _HEAD.size : end])
            start = end


@cache
def _message_type(length: int) -> np.dtype[np.void]:
    return np.dtype(
        [
            ("op", "u1"),
            ("length", "<u8"),
            ("channel", "<u2"),
            ("sequence", "<u4"),
            ("log", "<u8"),
            ("publish", "<u8"),
            ("data", "u1", (length - _MESSAGE_HEAD,)),
        ]
    )


def _messages(data: bytes, start: int, length: int) -> MessageBlock:
    """The message at ``start`` and the following ones of the same kind."""
    if length < _MESSAGE_HEAD:
        raise Damage(f"the message at byte {start} is shorter than its head")
    kind = _message_type(length)
    there = (len(data) - start) // kind.itemsize
    look, count = _FIRST_LOOK, 1
    while True:
        look = min(look, there)
        found = np.frombuffer(data, kind, look, start)
        same = (found["op"] == Op.MESSAGE) & (found["length"] == length)
        same &= found["channel"] == found["channel"][0]
        count = look if same.all() else int(np.argmin(same))
        if count < look or look == there:
            break
        look *= _LOOK_GROWTH
    found = found[:count]
    return MessageBlock(
        channel=int(found["channel"][0]),
        offset=start,
        size=kind.itemsize,
        log_times=found["log"],
        publish_times=found["publish"],
        data=found["data"],
    )


def pack_messages(
    channel: int,
    sequence: int,
    log_times: NDArray[np.int64],
    publish_times: NDArray[np.int64],
    data: NDArray[np.uint8],
) -> bytes:
    """Message records, one per row of ``data`` (n, bytes), numbered from ``sequence``."""
    count, width = data.shape
    block = np.zeros(count, _message_type(_MESSAGE_HEAD + width))
    block["op"], block["length"], block["channel"] = Op.MESSAGE, _MESSAGE_HEAD + width, channel
    block["sequence"] = np.arange(sequence, sequence + count) & 0xFFFFFFFF
    block["log"], block["publish"], block["data"] = log_times, publish_times, data
    return block.tobytes()


class RecordBody:
    """Reads the fields of a record in order; raises Damage for invalid ones."""

    def __init__(self, body: memoryview | bytes) -> None:
        self._view, self._at = memoryview(body), 0

    def take(self, length: int) -> memoryview:
        """The next ``length`` bytes."""
        end = self._at + length
        if end > len(self._view):
            raise Damage("a field is longer than its record")
        taken, self._at = self._view[self._at : end], end
        return taken

    def number(self, size: int) -> int:
        """An unsigned number of ``size`` bytes."""
        return int.from_bytes(self.take(size), "little")

    def text(self) -> str:
        """A text with its length before it."""
        try:
            return str(self.take(self.number(4)), "utf-8")
        except UnicodeDecodeError:
            raise Damage("a text is not UTF-8") from None

    def texts(self) -> dict[str, str]:
        """A map of texts."""
        inner, found = RecordBody(self.take(self.number(4))), {}
        while not inner.done:
            key = inner.text()
            found[key] = inner.text()
        return found

    @property
    def done(self) -> bool:
        """Whether nothing is left."""
        return self._at == len(self._view)


def chunk_content(body: memoryview) -> bytes:
    """The records in a chunk; raises Damage, also for a wrong checksum."""
    fields = RecordBody(body)
    fields.take(16)
    size, crc, compression = fields.number(8), fields.number(4), fields.text()
    packed = bytes(fields.take(fields.number(8)))
    if size > _LARGEST:
        raise Damage(f"a chunk has an impossible size of {size} bytes")
    content = _unpacked(packed, compression, size)
    if len(content) != size:
        raise Damage(f"a chunk has {len(content)} bytes in place of {size}")
    if crc and zlib.crc32(content) != crc:
        raise Damage("a chunk's checksum is wrong")
    return content


def is_intact(end: McapRecord, data: bytes) -> bool:
    """Whether the checksum in the record at the end of the data matches the data before it."""
    checksum = int.from_bytes(end.body, "little")
    return not checksum or checksum == zlib.crc32(memoryview(data)[: end.offset])


def whole_chunk(item: McapRecord) -> bytes | None:
    """Content of a chunk; None where it is damaged."""
    try:
        content = chunk_content(item.body)
        ends = [inner.end for inner in records(content)]
    except Damage:
        return None
    return content if ends and ends[-1] == len(content) else None


def next_chunk(data: bytes, start: int) -> int:
    """Start of the next complete chunk, or the end of the data."""
    found = data.find(_ZSTD, start)
    while found >= 0:
        at = found - _ZSTD_AT
        if at >= start and data[at] == Op.CHUNK:
            item = next(records(data, at), None)
            if isinstance(item, McapRecord) and whole_chunk(item) is not None:
                return at
        found = data.find(_ZSTD, found + 1)
    return len(data)


def joint_after(data: bytes, start: int) -> int:
    """Where the next file begins that was joined to this one from ``start`` on; else the end."""
    found = data.find(MARK + bytes((Op.HEADER,)), start)
    return found if found >= 0 else len(data)


def _unpacked(packed: bytes, compression: str, size: int) -> bytes:
    if not compression or not size:
        return packed
    if compression == "zstd":
        import zstandard

        try:
            if zstandard.frame_content_size(packed) not in (-1, size):
                raise Damage("a chunk's size differs from its declared one")
            return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
        except zstandard.ZstdError as error:
            raise Damage(f"a chunk cannot be unpacked: {error}") from None
    if compression == "lz4":
        import lz4.frame

        try:
            unpacker = lz4.frame.LZ4FrameDecompressor()
            return bytes(unpacker.decompress(packed, max_length=size))
        except (RuntimeError, EOFError) as error:
            raise Damage(f"a chunk cannot be unpacked: {error}") from None
    raise Damage(f"a chunk is packed by the unknown method '{compression}'")

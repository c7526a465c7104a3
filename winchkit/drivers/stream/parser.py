"""Incremental parser of the bytes of a device: the same result for any division into chunks.

The bytes of a line are cut into frames; bytes outside a frame are counted and dropped.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import NamedTuple

from winchkit.drivers.stream.decoder import FrameType, ParsedFrame, StreamDecoder
from winchkit.errors import Fault, FileError
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.stream import StreamSpec


class Piece(NamedTuple):
    """A frame without its terminator."""

    data: bytes
    behind: int
    """Bytes of the same chunk that came after it."""
    size: int
    """Bytes on the wire, terminator included."""
    broken: bool = False
    """The terminator is not where it must be."""


class Framing(ABC):
    """Cuts a sequence of bytes; base of all kinds, with the incomplete remainder."""

    def __init__(self, terminator: str) -> None:
        self._end = terminator.encode("latin-1")
        self._buffer = bytearray()
        self._inside = False
        """Whether a frame is known to begin where the buffer does."""
        self.resynchronised = 0
        """Bytes that belonged to no frame so far."""

    @property
    def pending(self) -> int:
        """Bytes of a frame that is not whole yet."""
        return len(self._buffer)

    def begin(self, *, sure: bool = True) -> None:
        """Forget what is half; ``sure`` where a frame begins with the next byte."""
        self.resynchronised += len(self._buffer)
        self._buffer.clear()
        self._inside = sure

    @abstractmethod
    def feed(self, data: bytes) -> list[Piece]:
        """Frames that are whole now."""


class TextFraming(Framing):
    """Lines up to a terminator. Bytes before the first one may be half a line and are dropped."""

    def __init__(self, terminator: str, longest: int, *, empty: bool = False) -> None:
        """``longest`` is in characters, without terminator; ``empty`` lines may say something."""
        super().__init__(terminator)
        self._empty, self._longest = empty, longest

    def feed(self, data: bytes) -> list[Piece]:
        """Lines that are whole now."""
        self._buffer += data
        found = []
        while (end := self._buffer.find(self._end)) >= 0:
            size = end + len(self._end)
            line = bytes(self._buffer[:end]).strip(b"\r\n")
            del self._buffer[:size]
            if self._inside and (line or self._empty) and end <= self._longest:
                found.append(Piece(line, len(self._buffer), size))
            else:
                self.resynchronised += size
            self._inside = True
        self._shorten()
        return found

    def _shorten(self) -> None:
        """Keep of what cannot become a line only what may be half a terminator."""
        keep = len(self._end) - 1
        self._inside &= len(self._buffer) <= self._longest + keep
        if not self._inside:
            dropped = max(0, len(self._buffer) - keep)
            del self._buffer[:dropped]
            self.resynchronised += dropped


class BinaryFraming(Framing):
    """One frame of a fixed number of bytes after each :meth:`begin`; all else is dropped."""

    def __init__(self, length: int, terminator: str) -> None:
        """``length`` is in bytes, without the terminator that must follow."""
        super().__init__(terminator)
        self._length = length

    def feed(self, data: bytes) -> list[Piece]:
        """The frame, when it is whole now."""
        if not self._inside:
            self.resynchronised += len(data)
            return []
        self._buffer += data
        size = self._length + len(self._end)
        if len(self._buffer) < size:
            return []
        frame, rest = bytes(self._buffer[:size]), len(self._buffer) - size
        self._buffer.clear()
        self._inside = False
        self.resynchronised += rest
        broken = frame[self._length :] != self._end
        return [Piece(frame[: self._length], rest, size, broken)]


def framing_of(spec: StreamSpec) -> Framing:
    """How the frames of a device are cut."""
    if spec.binary is not None:
        return BinaryFraming(spec.binary.length, spec.terminator)
    empty = any("" in asked.answer for asked in spec.command.values())
    return TextFraming(spec.terminator, spec.longest, empty=empty)


@dataclass(slots=True)
class ParserCounts:
    """What came so far. Bytes fed = framed + spoilt + resynchronised + those still pending."""

    framed: int = 0
    """Bytes of frames that said something."""
    spoilt: int = 0
    """Bytes of frames with a wrong check sum or that were malformed."""
    resynchronised: int = 0
    """Bytes that belonged to no frame."""
    bad_checksums: int = 0
    malformed: int = 0
    words: int = 0
    """Frames that said why there is no value."""


class StreamFrame(NamedTuple):
    """A frame with content."""

    frame: ParsedFrame
    behind: int
    """Bytes of the same chunk that came after it."""
    size: int
    """Its bytes on the wire."""


class StreamParser:
    """Reads what one device sends. Never raises, whatever comes."""

    def __init__(self, device: DeviceSpec, address: int | None = None) -> None:
        """Raise FileError where the device file contradicts itself."""
        self.spec = spec = stream_of(device)
        self.counts = ParserCounts()
        self.decoder = StreamDecoder(spec, device.path, address=address, frames=spec.frame)
        self._framing = framing_of(spec)
        self._before = 0

    @property
    def pending(self) -> int:
        """Bytes of a frame that is not whole yet."""
        return self._framing.pending

    def begin(self, *, sure: bool = True) -> None:
        """Forget what is half; ``sure`` where a frame begins next, as after a request."""
        self._framing.begin(sure=sure)
        self._count_skipped()

    def feed(self, data: bytes) -> list[StreamFrame]:
        """Frames that are whole now and say something, in order."""
        found = []
        for piece in self._framing.feed(data):
            if piece.broken:
                frame = ParsedFrame(FrameType.MALFORMED, piece.data.hex())
            elif self.spec.binary is not None:
                frame = self.decoder.binary(piece.data)
            else:
                frame = self.decoder.line(piece.data)
            if self._count(frame, piece.size):
                found.append(StreamFrame(frame, piece.behind, piece.size - frame.before))
        self._count_skipped()
        return found

    def _count(self, frame: ParsedFrame, size: int) -> bool:
        """Whether the frame says something."""
        counts = self.counts
        if frame.meaning in (FrameType.MALFORMED, FrameType.BAD_CHECKSUM):
            counts.spoilt += size
            counts.malformed += frame.meaning is FrameType.MALFORMED
            counts.bad_checksums += frame.meaning is FrameType.BAD_CHECKSUM
            return False
        self._before += frame.before
        counts.framed += size - frame.before
        counts.words += frame.decoded is not None and not frame.decoded.quality.usable
        return True

    def _count_skipped(self) -> None:
        self.counts.resynchronised = self._framing.resynchronised + self._before


def stream_of(device: DeviceSpec) -> StreamSpec:
    """The table [stream] of a device file; raises FileError where there is none."""
    if device.stream is None:
        raise FileError(Fault("is no instrument on a serial line", device.path))
    return device.stream


def asking_whether_fresh(device: DeviceSpec) -> DeviceSpec:
    """The device as it answers the question whether there is a new value."""
    spec = stream_of(device)
    assert spec.fresh is not None, "asked of devices that have the question"
    return replace(device, stream=replace(spec, frame=(spec.fresh.frame,), binary=None))


def talking(device: DeviceSpec) -> DeviceSpec:
    """The device as it answers commands: in lines, also where its frames are binary."""
    spec = stream_of(device)
    return device if spec.binary is None else replace(device, stream=replace(spec, binary=None))

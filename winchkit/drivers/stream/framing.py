"""Cuts the bytes of a serial line into frames; bytes outside a frame are counted and dropped.

The cuts depend on the bytes alone, never on the chunks in which they came.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

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

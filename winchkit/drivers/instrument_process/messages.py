"""Messages between a bench and its instrument process: a kind, a length, and the content.

A reading is a fixed record of binary numbers, everything else is JSON. The times are of the
computer's monotonic clock, which is the same in both processes.
"""

from __future__ import annotations

import json
import struct
from enum import IntEnum
from typing import Any, NamedTuple

from winchkit.drivers.counters import COUNTED
from winchkit.drivers.publisher import Sampled
from winchkit.drivers.reading import Quality

_HEAD = struct.Struct("<BI")
_READING = struct.Struct("<H3dI4d")

COUNTS = tuple(name for name in COUNTED if name not in ("readings", "duplicates"))
"""What is counted on the line; readings and duplicates are counted where they are judged."""


class Kind(IntEnum):
    """Type of a message."""

    READY = 1
    """The lines are being served."""
    READING = 2
    STATE = 3
    """What else an instrument shows, where it has changed."""
    REPLY = 4
    """Answer to a request."""
    FAILURE = 5
    """What ended the serving, or kept it from beginning."""
    ALIVE = 6
    """Nothing new: the process runs."""
    REQUEST = 7
    """From the bench; the only one in this direction."""


class RawReading(NamedTuple):
    """Raw values of one answer of an instrument, before any test of them; SI."""

    instrument: int
    """Its number among those of the process."""
    value: float
    gross: float
    counts: float
    quality: Quality
    when: Sampled


class InstrumentState(NamedTuple):
    """State of an instrument beside its readings."""

    problem: tuple[str, str] | None
    """Class and message of the error that keeps readings from coming."""
    tared: bool | None
    period: float
    """s."""
    max_age: float
    """s."""
    counts: tuple[int, ...]
    """Those of ``COUNTS``."""


def message(kind: Kind, content: bytes = b"") -> bytes:
    """A message as it is sent."""
    return _HEAD.pack(kind, len(content)) + content


def json_message(kind: Kind, content: Any) -> bytes:
    """A message with a content of plain values."""
    return message(kind, json.dumps(content).encode())


def reading_message(said: RawReading) -> bytes:
    """A message of one reading."""
    content = _READING.pack(*said[:4], said.quality.value, *_times(said.when))
    return message(Kind.READING, content)


def raw_reading_of(content: bytes) -> RawReading:
    """The reading in the content of a message."""
    instrument, value, gross, counts, flags, *times = _READING.unpack(content)
    return RawReading(instrument, value, gross, counts, Quality(flags), Sampled(*times))


class MessageCutter:
    """Cuts what arrives into messages."""

    def __init__(self) -> None:
        self._left = b""

    def feed(self, data: bytes) -> list[tuple[Kind, bytes]]:
        """The messages that are complete now, as kind and content."""
        data = self._left + data
        found, at = [], 0
        while len(data) - at >= _HEAD.size:
            kind, size = _HEAD.unpack_from(data, at)
            begin = at + _HEAD.size
            if len(data) - begin < size:
                break
            at = begin + size
            found.append((Kind(kind), data[begin:at]))
        self._left = data[at:]
        return found


def _times(when: Sampled) -> tuple[float, float, float, float]:
    return when.t_request, when.t_receive, when.earliest, when.latest

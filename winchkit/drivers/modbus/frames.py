"""Lets only the exact answer to a request through, and says what everything else was.

A Modbus RTU answer names neither the address it was read from nor its request. What can be checked
is checked here: unit, function, length and check sum. For TCP see ``tcp_frames``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

Framing = Literal["rtu", "tcp"]
Kind = Literal["crc", "malformed", "late", "resynchronised"]
_READS = (3, 4)
_REFUSED = 0x80
"""Added to the function code in an exception response (Modbus application protocol, section 7)."""
_LONGEST, _KEPT = 1024, 300
"""Bytes of babble on a line, and how many of them are kept: more than the longest frame."""
_HEAD = {"rtu": 0, "tcp": 6}
"""Bytes before the unit."""
_TAIL = {"rtu": 2, "tcp": 0}
"""Bytes of the check sum."""


@dataclass(frozen=True, slots=True)
class LineEvent:
    """Something on the line that was not the answer asked for."""

    unit: int
    kind: Kind
    count: int = 1
    registers: int = 0
    """That a whole answer of the unit held; 0 where there was none."""


@dataclass(frozen=True, slots=True)
class Request:
    """A request, and the form of its answer from the unit to the end of the PDU."""

    packet: bytes
    unit: int
    wanted: bytes
    """The first bytes of the answer."""
    refusal: bytes
    size: int
    """Of the whole answer, frame and all."""
    reads: bool


class AnswerGate:
    """Fed with what is sent and received on one serial line, one request at a time."""

    broken = False
    """Every frame of a serial line has its check sum: one that is damaged spoils no other."""

    def __init__(self) -> None:
        self._request: Request | None = None
        self._unit = 0
        self._buffer = b""
        self._echoes = False
        self._last: dict[int, Request] = {}
        self._events: list[LineEvent] = []

    def sent(self, packet: bytes) -> None:
        """A request is sent; earlier bytes are no answer to it."""
        self.expire()
        self._request = request_of(packet, "rtu")
        self._unit = self._request.unit

    def received(self, data: bytes) -> bytes:
        """The whole answer once it is there, else nothing."""
        self._buffer += data
        if len(self._buffer) > _LONGEST:
            self._note(self._unit, "resynchronised", len(self._buffer) - _KEPT)
            self._buffer = self._buffer[-_KEPT:]
        request = self._request
        if request is None:
            return b""
        for at, frame in self._answers(request):
            self._judge(self._buffer[:at], request, answered=True)
            self._buffer = self._buffer[at + len(frame) :]
            self._request, self._last[request.unit] = None, request
            return frame
        return b""

    def expire(self) -> bool:
        """The time for an answer is over; returns whether anything at all had come."""
        waiting, self._request = self._request, None
        left, self._buffer = self._buffer, b""
        if left:
            self._judge(left, waiting, answered=False)
        if waiting is not None:
            self._last[waiting.unit] = waiting
        return bool(left)

    def events(self) -> list[LineEvent]:
        """Events since the last call."""
        if self._request is None:
            self.expire()
        events, self._events = self._events, []
        return events

    def _answers(self, request: Request) -> Iterator[tuple[int, bytes]]:
        """Whole answers to the request, wherever in the buffer they begin."""
        echo = self._echoes
        for at in range(len(self._buffer)):
            if self._buffer.startswith(request.wanted, at):
                size = request.size
            elif self._buffer.startswith(request.refusal, at):
                size = 3 + _TAIL["rtu"]
            else:
                continue
            frame = self._buffer[at : at + size]
            if len(frame) < size or crc16(frame[:-2]) != frame[-2:]:
                continue
            if frame == request.packet and echo:
                # On a line that echoes, the first copy of a written register is our own.
                echo = False
                continue
            yield at, frame

    def _judge(self, junk: bytes, request: Request | None, *, answered: bool) -> None:
        """Say what came beside an answer, instead of one, or while nothing was asked."""
        noise = 0
        while junk:
            if request is not None and junk.startswith(request.packet):
                self._echoes |= request.reads
                self._note(request.unit, "malformed")
                junk = junk[len(request.packet) :]
                continue
            frame = junk[: _rtu_size(junk)]
            if frame:
                registers = frame[2] // 2 if frame[1] in _READS else 0
                self._note(frame[0], self._kind(frame, request), registers=registers)
            else:
                noise += 1
            junk = junk[len(frame) or 1 :]
        if not noise:
            return
        if request is None or answered:
            self._note(self._unit, "resynchronised", noise)
        else:
            self._note(request.unit, "crc" if noise >= request.size else "malformed")

    def _kind(self, frame: bytes, request: Request | None) -> Kind:
        """Whether a good frame is an old answer or one that was never asked for."""
        if request is None:
            return "late"
        old = self._last.get(frame[0])
        same = old is not None and frame.startswith(old.wanted) and len(frame) == old.size
        return "late" if same else "malformed"

    def _note(self, unit: int, kind: Kind, count: int = 1, registers: int = 0) -> None:
        self._events.append(LineEvent(unit, kind, count, registers))


def crc16(data: bytes) -> bytes:
    """CRC-16/MODBUS of a frame, low byte first."""
    register = 0xFFFF
    for byte in data:
        register = register >> 8 ^ _TABLE[(register ^ byte) & 0xFF]
    return register.to_bytes(2, "little")


def _table_entry(byte: int) -> int:
    for _ in range(8):
        byte = byte >> 1 ^ (0xA001 if byte & 1 else 0)
    return byte


_TABLE = tuple(_table_entry(byte) for byte in range(256))


def request_of(packet: bytes, framing: Framing) -> Request:
    """Content of a request, read from the request itself."""
    body = packet[_HEAD[framing] : len(packet) - _TAIL[framing]]
    unit, function = body[0], body[1]
    reads = function in _READS
    if reads:
        size = 2 * int.from_bytes(body[4:6], "big")
        wanted, rest = bytes((unit, function, size)), size
    else:
        wanted, rest = body[:6], 0
    whole = _HEAD[framing] + len(wanted) + rest + _TAIL[framing]
    return Request(packet, unit, wanted, bytes((unit, function | _REFUSED)), whole, reads)


def _rtu_size(data: bytes) -> int:
    """Size of a whole and valid answer at the beginning of serial data, else 0."""
    if len(data) < 5:
        return 0
    function = data[1]
    if function & _REFUSED:
        size = 5
    elif function in _READS:
        size = 5 + data[2]
    elif function in (6, 16):
        size = 8
    else:
        return 0
    return size if size <= len(data) and crc16(data[: size - 2]) == data[size - 2 : size] else 0

"""Modbus TCP frames of one connection: the answer to the request, or none.

A Modbus TCP frame has no check sum: a reply that was cut and the bytes after it join to a frame
whose head is right and whose registers are not. A frame is therefore taken only where it begins
exactly where the frame before it ended, its transaction, protocol, length, unit, function and byte
count agree, nothing follows it, and no head of another frame stands within it. Whatever else comes
makes the connection ``broken``: the client opens a new one (MODBUS Messaging on TCP/IP
Implementation Guide V1.0b, 3.1.3 and 4.2). Of an accepted deviation (``deviations``) the frame is
taken as the one that is due.
"""

from __future__ import annotations

from collections import deque

from winchkit.drivers.modbus.deviations import Deviations
from winchkit.drivers.modbus.frames import Kind, LineEvent, Request, request_of
from winchkit.drivers.modbus.transactions import Transactions

_HEAD = 6
"""Bytes of transaction, protocol and length."""
_LONGEST = 254
"""Unit and PDU at most, bytes."""
_SHORTEST = 3
"""Unit, function and exception code."""
_BODY = _HEAD + 2
"""Place in an answer behind unit and function."""
_BLOCK = slice(_HEAD, _HEAD + 4)
"""Unit, function and start address of a request."""
_REMEMBERED = 8
"""Requests whose transactions are looked for within a frame."""
_TWICE = "sends its answers twice"
_SIGNATURE = 5
"""Bytes of a head that are the same in every reply to a transaction: all but the lower length."""


class TcpAnswerGate:
    """Fed with what is sent and received on one connection, one request at a time."""

    def __init__(
        self, before: TcpAnswerGate | None = None, deviations: Deviations | None = None
    ) -> None:
        """``before`` is the one of the connection before this one."""
        self._deviations = deviations or Deviations("", ())
        self._answered: deque[bytes] = deque(maxlen=_REMEMBERED)
        """The newest answers as they came."""
        self.broken = False
        """Whether something came that was not the answer; the connection is not used again."""
        self.transactions: deque[bytes] = deque(maxlen=_REMEMBERED)
        """Of the last requests, also on the connections before this one."""
        self.numbers = Transactions()
        if before is not None:
            self.transactions.extend(before.transactions)
            self.numbers = before.numbers
        self.lost = False
        """Whether it is unknown where the next frame begins: no answer can be taken any more."""
        self._request: Request | None = None
        self._unit = 0
        self._buffer = b""
        self._joints: list[int] = []
        """Where in the buffer a piece began that came later than the one before."""
        self._events: list[LineEvent] = []

    def sent(self, packet: bytes) -> None:
        """A request goes out."""
        self.expire()
        self._request = request_of(packet, "tcp")
        self._unit = self._request.unit
        self.transactions.append(packet[:2])

    def received(self, data: bytes) -> bytes:
        """The whole answer once it is there, else nothing."""
        if self._buffer:
            self._joints.append(len(self._buffer))
        self._buffer += data
        while not self.lost and (size := self._size()):
            frame, self._buffer = self._buffer[:size], self._buffer[size:]
            joints, self._joints = self._joints, []
            if self._is_accepted_copy(frame):
                continue
            answer = self._as_due(frame)
            if self._answers(answer, joints, frame):
                self._request = None
                self._answered.append(frame)
                return answer
        if self._request is None and self._buffer and not self._begins_copy():
            self._lose()
        return b""

    def expire(self) -> bool:
        """The time for an answer is over; returns whether anything at all had come."""
        waiting, self._request = self._request, None
        came = bool(self._buffer) or self.broken
        if self._buffer and not self.lost and not self._begins_copy():
            self._lose()
        # An answer that was not heard may still come: never on this connection.
        self.broken |= waiting is not None
        return came

    def events(self) -> list[LineEvent]:
        """Events since the last call."""
        events, self._events = self._events, []
        return events

    def _size(self) -> int:
        """Size of the whole frame that the buffer begins with, else 0."""
        if len(self._buffer) < _HEAD:
            return 0
        length = int.from_bytes(self._buffer[4:6], "big")
        if self._buffer[2:4] != b"\0\0" or not _SHORTEST <= length <= _LONGEST:
            self._lose()
            return 0
        return _HEAD + length if len(self._buffer) >= _HEAD + length else 0

    def _as_due(self, frame: bytes) -> bytes:
        """A frame as it would be without its accepted deviations; as it is where it has others."""
        request = self._request
        if request is None:
            return frame
        body = frame[_HEAD:]
        answers = body[1:].startswith(request.wanted[1:]) and len(frame) == request.size
        refuses = body[1:2] == request.refusal[1:] and len(body) == len(request.refusal) + 1
        zero = frame[:2] == b"\0\0" != request.packet[:2]
        if not (answers or refuses) or not (zero or frame[:2] == request.packet[:2]):
            return frame
        note, accepted = self._deviations.note, True
        if zero:
            accepted &= note(
                "transaction-0", "answers with transaction 0 in place of the request's"
            )
        if body[0] != request.unit:
            words = f"answers as unit {body[0]} in place of {request.unit}"
            accepted &= note("other-unit", words)
        if not accepted:
            return frame
        return request.packet[:2] + frame[2:_HEAD] + bytes((request.unit,)) + body[1:]

    def _is_accepted_copy(self, frame: bytes) -> bool:
        """Whether a frame is one of the newest answers a second time, and that is accepted."""
        request, numbered = self._request, frame[:2] != b"\0\0"
        again = request is None or frame[:2] != request.packet[:2]
        if not (numbered and again and frame in self._answered):
            return False
        return self._deviations.note("answers-twice", _TWICE)

    def _begins_copy(self, came: bytes = b"") -> bool:
        """Whether what is left begins an accepted second copy of an answer, or of ``came``."""
        left = self._buffer
        for answer in (came, *self._answered):
            if left and answer.startswith(left[: len(answer)]):
                if left == answer:
                    self._deviations.note("answers-twice", _TWICE)
                numbered = answer[:2] != b"\0\0"
                return numbered and "answers-twice" in self._deviations.accepted
        return False

    def _answers(self, frame: bytes, joints: list[int], came: bytes) -> bool:
        """Whether a frame is the answer; one that is not makes the connection broken.

        ``came`` is the frame before accepted deviations were taken out.
        """
        request = self._request
        if request is None or frame[:2] != request.packet[:2]:
            # A whole frame of another transaction: the next one begins where it ends.
            self.broken = True
            kind: Kind = "late" if frame[:2] in self.transactions else "malformed"
            self._events.append(LineEvent(frame[_HEAD], kind))
            return False
        body, refusal = frame[_HEAD:], request.refusal
        refused = body.startswith(refusal) and len(body) == len(refusal) + 1
        agrees = body.startswith(request.wanted) and len(frame) == request.size
        # The answer to a write repeats the request: none of its bytes can be of another frame.
        doubtful = request.reads and self._holds_a_head(frame, joints)
        more = bool(self._buffer) and not self._begins_copy(came)
        if not (agrees or refused) or more or doubtful:
            self._lose()
            return False
        if agrees:
            self.numbers.note(request.packet[_BLOCK], frame[_BODY:])
        return True

    def _holds_a_head(self, frame: bytes, joints: list[int]) -> bool:
        """Whether the registers end with, or hold, the beginning of another frame's head."""
        for transaction in tuple(self.transactions):
            head = transaction + b"\0\0\0"
            for at in range(_BODY, len(frame)):
                left = frame[at : at + _SIGNATURE]
                # A single byte alike is chance, except where a piece of its own begins with it.
                if (len(left) > 1 or at in joints) and head.startswith(left):
                    # The connection ends with it. A value that looks like it, and stays, must
                    # not be refused on the next one for ever.
                    self.transactions.remove(transaction)
                    return True
        return False

    def _lose(self) -> None:
        """Where the next frame begins is not known any more."""
        self.broken = self.lost = True
        self._buffer, self._joints = b"", []
        self._events.append(LineEvent(self._unit, "malformed"))

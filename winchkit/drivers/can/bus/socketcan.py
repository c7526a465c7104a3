"""A raw CAN socket of Linux, read and written with many frames in one system call.

``sendmmsg`` sends the frames of a cycle, ``recvmmsg`` takes all that wait, each with its control
messages: the kernel's time stamp, and how many frames the socket had no room for. python-can's own
reader does not report the latter: with SO_RXQ_OVFL set, it takes the count for a protocol error.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
import struct
from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import can

from winchkit.drivers.can.bus.health import BusState

_FRAME = struct.Struct("=IB3x8s")
_SIZE = _FRAME.size
_EXTENDED, _REMOTE, _ERROR = 1 << 31, 1 << 30, 1 << 29
_STAMP = struct.Struct("@ll")
_INTERVAL = struct.Struct("@ll")
_DROPS = struct.Struct("=I")
_SOL_SOCKET, _SO_TIMESTAMPNS, _SO_RXQ_OVFL = socket.SOL_SOCKET, 35, 40
_CONTROL = struct.Struct("@Nii0N")
"""``struct cmsghdr``: length with this header, level, kind; its content follows."""
_STAMPED = struct.Struct("@Nii0Nll")
"""The control message of a time stamp."""
_WORD = struct.calcsize("@N")
"""To which the length of a control message is rounded up."""
_VECTOR = struct.Struct("@PN")
"""``struct iovec``: address, size."""
_MESSAGE = struct.Struct("@PIPNPNi0PI0P")
"""``struct mmsghdr``: name and its size, vectors and their number, control messages and their
size, flags, bytes of the message."""
_HEADER = struct.calcsize("@PIPNP")
_OUTCOME = struct.Struct(f"@{_HEADER}xNi0PI0P")
"""What a call has set of it: size of the control messages, flags, bytes of the message."""
_MOST, _ANCILLARY = 64, 128
"""Frames of one system call, and bytes of control messages of each."""
_CONFIRM = 0x800
"""Flag of a frame that this very socket has sent (MSG_CONFIRM of Linux)."""
_WAIT_FOR_ONE = 0x10000
"""Flag of ``recvmmsg``: wait for the first frame only."""
_QUEUE = 1 << 20
"""Bytes of the socket's queue; the usual one keeps 278 frames."""
_new = tuple.__new__


class ReceivedFrame(NamedTuple):
    """A frame of 11 bits with data, or an error frame; a named tuple: thousands come a second."""

    identifier: int
    data: bytes
    stamp: float = 0.0
    """By the interface's clock, s; 0 where it has none of its own."""
    error: bool = False


class SocketCan:
    """A raw CAN socket that python-can has opened."""

    def __init__(self, bus: Any) -> None:
        self.library = bus
        self.dropped = 0
        self._socket: socket.socket = bus.socket
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _QUEUE)
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        self._socket.setblocking(True)
        self._timeout = -1.0
        self._incoming, self._outgoing = _Messages(_ANCILLARY), _Messages(0)
        calls = ctypes.CDLL(None, use_errno=True)
        self._recvmmsg, self._sendmmsg = calls.recvmmsg, calls.sendmmsg
        number, address = ctypes.c_int, ctypes.c_void_p
        self._recvmmsg.argtypes = [number, address, ctypes.c_uint, number, address]
        self._sendmmsg.argtypes = [number, address, ctypes.c_uint, number]

    def receive(self, timeout: float) -> Sequence[ReceivedFrame]:
        """Take all frames that wait, or the first within ``timeout`` (s)."""
        if timeout != self._timeout:
            self._set_timeout(timeout)
        incoming, descriptor = self._incoming, self._socket.fileno()
        incoming.empty()
        count = self._recvmmsg(descriptor, incoming.place, _MOST, _WAIT_FOR_ONE, None)
        if count < 0:
            number = ctypes.get_errno()
            if number in (errno.EAGAIN, errno.EINTR):
                return ()
            raise OSError(number, os.strerror(number))
        frames, drops = incoming.taken(count)
        if drops is not None:
            self.dropped = drops
        return frames

    def send(self, identifier: int, data: bytes) -> None:
        """Send a data frame."""
        self._socket.send(_FRAME.pack(identifier, len(data), data))

    def send_together(self, frames: Sequence[tuple[int, bytes]]) -> int:
        """Send data frames by one system call; how many of the first of them it took."""
        count = min(len(frames), _MOST)
        outgoing, descriptor = self._outgoing, self._socket.fileno()
        outgoing.fill(frames[:count])
        return max(0, int(self._sendmmsg(descriptor, outgoing.place, count, 0)))

    def send_remote(self, identifier: int) -> None:
        """Send a remote frame for one byte."""
        self._socket.send(_FRAME.pack(identifier | _REMOTE, 1, b""))

    def state(self) -> BusState | None:
        """None: the state is in error frames."""
        return None

    def close(self) -> None:
        """Close it."""
        with suppress(can.CanError, OSError):
            self.library.shutdown()

    def _set_timeout(self, timeout: float) -> None:
        """Let the kernel wait: one call for the frames, where ``select`` would be another."""
        seconds = int(timeout)
        microseconds = max(1, round((timeout - seconds) * 1e6))
        interval = _INTERVAL.pack(seconds, microseconds)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, interval)
        self._timeout = timeout


class _Messages:
    """Memory for messages of one frame each, laid out as ``recvmmsg`` and ``sendmmsg`` want it."""

    def __init__(self, ancillary: int) -> None:
        """Room for so many bytes of control messages with each of them."""
        self._frames, frames = _memory(_MOST * _FRAME.size)
        self._control, control = _memory(_MOST * ancillary)
        self._vectors, vectors = _memory(_MOST * _VECTOR.size)
        headers, self.place = _memory(_MOST * _MESSAGE.size)
        """Address of the messages."""
        for k in range(_MOST):
            _VECTOR.pack_into(
                self._vectors, k * _VECTOR.size, frames + k * _FRAME.size, _FRAME.size
            )
            vector, room = vectors + k * _VECTOR.size, control + k * ancillary
            fields = (0, 0, vector, 1, room, ancillary, 0, 0)
            _MESSAGE.pack_into(headers, k * _MESSAGE.size, *fields)
        self._headers, self._empty, self._ancillary = headers, bytes(headers), ancillary

    def empty(self) -> None:
        """Make them ready to receive."""
        self._headers[:] = self._empty

    def taken(self, count: int) -> tuple[list[ReceivedFrame], int | None]:
        """Frames of the first ``count``, which were received, and the newest count of drops."""
        taken: list[ReceivedFrame] = []
        dropped, at, place = None, 0, 0
        outcomes = _OUTCOME.iter_unpack(self._headers[: count * _MESSAGE.size])
        contents = _FRAME.iter_unpack(self._frames[: count * _FRAME.size])
        for (used, flags, size), (word, length, payload) in zip(outcomes, contents, strict=True):
            frame: ReceivedFrame | None
            drops = None
            if size == _SIZE and word < _ERROR:
                stamp = 0.0
                if used:
                    stamp, drops = self._told(place, used)
                # What Frame(...) makes, without the call of its constructor.
                frame = _new(ReceivedFrame, (word, payload[:length], stamp, False))
            else:
                control = self._control[place : place + used]
                frame, drops = parse_socketcan(self._frames[at : at + size], control)
            if drops is not None:
                dropped = drops
            if frame is not None and not flags & _CONFIRM:
                taken.append(frame)
            at += _SIZE
            place += self._ancillary
        return taken, dropped

    def _told(self, place: int, used: int) -> tuple[float, int | None]:
        """Time stamp and count of drops; nearly always there is the stamp alone."""
        if used == _STAMPED.size:
            length, level, kind, seconds, nanoseconds = _STAMPED.unpack_from(self._control, place)
            if length == used and kind == _SO_TIMESTAMPNS and level == _SOL_SOCKET:
                return seconds + nanoseconds * 1e-9, None
        return _told(self._control, place, place + used)

    def fill(self, frames: Iterable[tuple[int, bytes]]) -> None:
        """Write data frames into the first of them."""
        at = 0
        for identifier, data in frames:
            _FRAME.pack_into(self._frames, at, identifier, len(data), data)
            at += _FRAME.size


def _memory(size: int) -> tuple[bytearray, int]:
    """Bytes that stay where they are, and their address."""
    memory = bytearray(max(1, size))
    return memory, ctypes.addressof(ctypes.c_char.from_buffer(memory))


def parse_socketcan(
    data: bytes | bytearray, control: bytes | bytearray
) -> tuple[ReceivedFrame | None, int | None]:
    """A frame of 11 bits with data, or None, and the count of drops, or None where it has none."""
    stamp, drops = _told(control, 0, len(control))
    if len(data) < _FRAME.size:
        return None, drops
    identifier, size, payload = _FRAME.unpack_from(data)
    error = bool(identifier & _ERROR)
    if not error and identifier & (_EXTENDED | _REMOTE):
        return None, drops
    return ReceivedFrame(identifier & (_ERROR - 1), payload[:size], stamp, error), drops


def _told(control: bytes | bytearray, at: int, last: int) -> tuple[float, int | None]:
    """Time stamp and count of drops that the control messages between two places have."""
    stamp, drops = 0.0, None
    while at + _CONTROL.size <= last:
        length, level, kind = _CONTROL.unpack_from(control, at)
        content, end = at + _CONTROL.size, at + length
        if length < _CONTROL.size or end > last:
            break
        if level == _SOL_SOCKET:
            if kind == _SO_TIMESTAMPNS and end - content >= _STAMP.size:
                seconds, nanoseconds = _STAMP.unpack_from(control, content)
                stamp = seconds + nanoseconds * 1e-9
            elif kind == _SO_RXQ_OVFL and end - content >= _DROPS.size:
                (drops,) = _DROPS.unpack_from(control, content)
        at += -(-length // _WORD) * _WORD
    return stamp, drops

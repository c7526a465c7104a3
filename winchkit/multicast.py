"""CAN frames by UDP multicast, as python-can's interface ``udp_multicast`` sends them.

Eight drives at 250 Hz and their master exchange 6000 frames a second. python-can takes 0.1 ms for
each, and hands every frame back to its sender; here one system call sends or receives a frame, and
what was sent here is not received.
"""

from __future__ import annotations

import ctypes
import selectors
import socket
import struct
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from ipaddress import ip_address
from typing import Any

_QUEUE = 1 << 20
"""Bytes of the socket's queue."""
_LONGEST = 4096
"""Bytes: more than a CAN frame in python-can's encoding, some hundred."""
_SO_ATTACH_FILTER, _SO_TIMESTAMPNS = 26, 35
_STAMP = struct.Struct("@ll")
_ANCILLARY = 64
"""Bytes: one control message with a time stamp of two longs has 32."""
_INSTRUCTION = struct.Struct("=HBBI")
_LOAD_WORD, _LOAD_HALF, _JUMP_EQUAL, _RETURN = 0x20, 0x28, 0x15, 0x06
"""Classic BPF; a datagram begins with the sender's port."""
_SENDER = 0xFFF00000 + 12
"""Place of the sender's address in an IPv4 header."""


class MulticastPort:
    """An open group; raises OSError, ImportError without msgpack, ValueError for no address."""

    def __init__(self, group: str, port: int) -> None:
        import msgpack

        self._pack, self._unpack = msgpack.packb, msgpack.unpackb
        self._group = group, port
        address = ip_address(group.partition("%")[0])
        family = socket.AF_INET if address.version == 4 else socket.AF_INET6
        with ExitStack() as opened:
            self._input, self._output = (
                opened.enter_context(socket.socket(family, socket.SOCK_DGRAM)) for _ in range(2)
            )
            # Not bound to an address: that of a source would choose the interface, where those who
            # listen have joined by the route to the group.
            self._output.bind(("", 0))
            self._own = self._source()
            shared = ("SO_REUSEADDR", "SO_REUSEPORT")
            for option in (getattr(socket, name) for name in shared if hasattr(socket, name)):
                self._input.setsockopt(socket.SOL_SOCKET, option, 1)
            self._input.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _QUEUE)
            if family == socket.AF_INET:
                _drop_from(self._input, *self._own)
            self._input.bind(("", port))
            self._input.setblocking(False)
            if family == socket.AF_INET:
                member = address.packed + bytes(4)
                self._input.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
            else:
                member = address.packed + struct.pack("@I", 0)
                self._input.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_JOIN_GROUP, member)
            if sys.platform == "linux":
                self._input.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            self._arrival = opened.enter_context(selectors.DefaultSelector())
            self._arrival.register(self._input, selectors.EVENT_READ)
            self._opened = opened.pop_all()
        self.arrived = 0.0
        """Arrival of the last frame by the kernel, s since the epoch; 0 where it does not say."""

    def send(self, identifier: int, data: bytes, *, remote: bool = False) -> None:
        """Send a data frame of 11 bits, or a remote frame for one byte; raises OSError."""
        frame = {
            "timestamp": 0.0,
            "arbitration_id": identifier,
            "is_extended_id": False,
            "is_remote_frame": remote,
            "is_error_frame": False,
            "channel": None,
            "dlc": 1 if remote else len(data),
            "data": data,
            "is_fd": False,
            "bitrate_switch": False,
            "error_state_indicator": False,
        }
        self._output.sendto(self._pack(frame), self._group)

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Next data frame of 11 bits within ``timeout`` s; OSError, ValueError for no frame."""
        try:
            datagram, ancillary, sender = self._taken()
        except BlockingIOError:
            if timeout > 0 and self._arrival.select(timeout):
                return self.receive(0.0)
            return None
        if sender[1] == self._own[1] and sender[:2] in (self._own, self._source()):
            # Frames of its own pass the kernel's filter once this computer's address has changed.
            return self.receive(0.0)
        self.arrived = _stamp(ancillary)
        frame: Any = self._unpack(datagram)
        try:
            other = frame["is_extended_id"] or frame["is_remote_frame"] or frame["is_error_frame"]
            return None if other else (frame["arbitration_id"], bytes(frame["data"]))
        except (KeyError, TypeError) as error:
            raise ValueError(f"a datagram is no CAN frame: {error!r}") from error

    def _taken(self) -> tuple[bytes, Sequence[tuple[int, int, bytes]], tuple[str, int]]:
        """A datagram, its control messages and sender; raises OSError."""
        if sys.platform == "win32":  # has no recvmsg
            datagram, sender = self._input.recvfrom(_LONGEST)
            return datagram, (), sender
        datagram, ancillary, _, sender = self._input.recvmsg(_LONGEST, _ANCILLARY)
        return datagram, ancillary, sender

    def _source(self) -> tuple[str, int]:
        """Address of this computer on the way to the group, and the port of what is sent here."""
        with socket.socket(self._output.family, socket.SOCK_DGRAM) as probe:
            probe.connect(self._group)
            return probe.getsockname()[0], self._output.getsockname()[1]

    def close(self) -> None:
        """Leave the group."""
        self._opened.close()


def _stamp(ancillary: Sequence[tuple[int, int, bytes]]) -> float:
    """Time stamp of the kernel, s since the epoch; 0 without one."""
    for level, kind, content in ancillary:
        if (level, kind) == (socket.SOL_SOCKET, _SO_TIMESTAMPNS) and len(content) >= _STAMP.size:
            seconds, nanoseconds = _STAMP.unpack_from(content)
            return float(seconds + nanoseconds * 1e-9)
    return 0.0


def _drop_from(taker: socket.socket, address: str, port: int) -> None:
    """Let the kernel of Linux drop datagrams from an address and UDP port."""
    if sys.platform != "linux":
        return
    rows = (
        (_LOAD_HALF, 0, 0, 0),
        (_JUMP_EQUAL, 0, 3, port),
        (_LOAD_WORD, 0, 0, _SENDER),
        (_JUMP_EQUAL, 0, 1, int(ip_address(address))),
        (_RETURN, 0, 0, 0),
        (_RETURN, 0, 0, 0xFFFFFFFF),
    )
    code = ctypes.create_string_buffer(b"".join(_INSTRUCTION.pack(*row) for row in rows))
    program = struct.pack("HP", len(rows), ctypes.addressof(code))
    taker.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, program)

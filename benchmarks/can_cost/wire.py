"""What carries frames between a bench and its drives: python-can's `virtual` bus, or a socket.

The socket is a pair whose packets are Linux's ``struct can_frame``; the bench reads and writes it
by winchkit's own SocketCAN code, and the drives may be in another process.
"""

from __future__ import annotations

import select
import socket
import struct
import time
from typing import Any, Protocol

import can

_FRAME = struct.Struct("=IB3x8s")


class Wire(Protocol):
    """The drives' end."""

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Next frame."""

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame."""

    def close(self) -> None:
        """Let it go."""


class VirtualWire:
    """On python-can's `virtual` interface, within this process."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(interface="virtual", channel=channel)

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Next frame."""
        message = self._bus.recv(timeout)
        return None if message is None else (message.arbitration_id, bytes(message.data))

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame."""
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def close(self) -> None:
        """Let it go."""
        self._bus.shutdown()


class SocketWire:
    """On one end of a pair of sockets."""

    def __init__(self, end: socket.socket) -> None:
        self._socket = end

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Next frame."""
        if not select.select([self._socket], [], [], timeout)[0]:
            return None
        packet = self._socket.recv(_FRAME.size)
        if not packet:
            time.sleep(timeout)
            return None
        identifier, size, data = _FRAME.unpack(packet)
        return identifier, data[:size]

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame."""
        self._socket.send(_FRAME.pack(identifier, len(data), data))

    def close(self) -> None:
        """Let it go."""
        self._socket.close()


class PairLibrary:
    """The bench's end as python-can's SocketCAN bus would be: a socket, and ``send`` for SDO."""

    def __init__(self, end: socket.socket) -> None:
        self.socket = end

    def send(self, message: Any, timeout: float | None = None) -> None:
        """Send a message of canopen's."""
        data = bytes(message.data)
        self.socket.send(_FRAME.pack(message.arbitration_id, len(data), data))

    def shutdown(self) -> None:
        """Let it go."""
        self.socket.close()

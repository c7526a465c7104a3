"""A ``virtual`` CAN bus on a TCP port: frames as lines ``ID#DATA``, both ways, one guest."""

from __future__ import annotations

import socket
import threading
from typing import TextIO

import can


class Bridge:
    """Serves one connection until closed; ``port`` is where."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(interface="virtual", channel=channel)
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._server.getsockname()[1])
        self._guest: socket.socket | None = None
        self._stopping = threading.Event()
        self._in = threading.Thread(target=self._to_bus, name="bridge-in", daemon=True)
        self._out = threading.Thread(target=self._from_bus, name="bridge-out", daemon=True)

    def admit(self) -> None:
        """Wait for the guest, and begin."""
        self._server.settimeout(20.0)
        self._guest, _ = self._server.accept()
        self._guest.settimeout(None)
        self._guest.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._in.start()
        self._out.start()

    def close(self) -> None:
        """Send nothing more, then let the guest go."""
        self._stopping.set()
        self._server.close()
        if self._guest is not None:
            self._out.join(5.0)
            self._guest.shutdown(socket.SHUT_RDWR)
            self._in.join(5.0)
            self._guest.close()
        self._bus.shutdown()

    def _to_bus(self) -> None:
        with self._guest.makefile("r", encoding="ascii") as lines:
            while line := self._line(lines):
                identifier, _, data = line.strip().partition("#")
                message = can.Message(
                    arbitration_id=int(identifier, 16),
                    data=bytes.fromhex(data),
                    is_extended_id=False,
                )
                self._bus.send(message)

    def _line(self, lines: TextIO) -> str:
        """Next line of the guest; empty at its end.

        After ``close`` the guest may answer a frame that it had already read: TCP replies to
        that with a reset, which is then the end of the connection like any other.
        """
        try:
            return lines.readline()
        except ConnectionResetError:
            if not self._stopping.is_set():
                raise
            return ""

    def _from_bus(self) -> None:
        assert self._guest is not None
        while not self._stopping.is_set():
            message = self._bus.recv(0.05)
            if message is not None:
                line = f"{message.arbitration_id:x}#{bytes(message.data).hex()}\n"
                self._guest.sendall(line.encode())

"""Where live pictures of a bench can go besides a file: JSON lines, and UDP for PlotJuggler."""

from __future__ import annotations

import json
import math
import socket
from collections.abc import Callable, Mapping
from typing import Any, Protocol, TextIO

from winchkit.errors import ConnectionLost, UsageError

_LARGEST = 65_000
"""Bytes: a datagram of UDP over IPv4 has 65 507 at most."""


class LiveSink(Protocol):
    """Takes pictures as ``bench.snapshot.to_dict`` makes them."""

    def __call__(self, status: Mapping[str, Any]) -> None:
        """Show one."""


class JsonLines:
    """One JSON object a line; null is no value."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __call__(self, status: Mapping[str, Any]) -> None:
        """Write a line, at once readable at the other end of a pipe."""
        self._stream.write(json.dumps(status) + "\n")
        self._stream.flush()


class UdpJson:
    """One datagram a picture: JSON with ``timestamp`` (UTC, s) and the winches' numbers.

    This is what PlotJuggler's UDP server reads with the protocol JSON: it names a number after the
    keys that lead to it (``/A/tension``), and leaves the time stamps of a stream for good once one
    datagram has none. The time is that of the picture, not of its sending: the bench's clock,
    brought to UTC by the first picture. A receiver is not needed; a picture that cannot be sent is
    counted in ``dropped``.
    """

    def __init__(self, target: str, utc: Callable[[], float]) -> None:
        """``target`` is ``HOST:PORT``. Raises UsageError; ConnectionLost for an unknown host."""
        host, _, port = target.rpartition(":")
        if not host or not port.isdigit() or not 0 < int(port) < 65_536:
            raise UsageError(f"'{target}' is no HOST:PORT; write e.g. localhost:9870")
        try:
            found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_DGRAM)
        except OSError as error:
            raise ConnectionLost(f"'{target}' cannot be reached: {error}") from None
        # localhost is ::1 first on many machines, and PlotJuggler listens at 127.0.0.1.
        family, kind, protocol, _, address = min(found, key=_version_six)
        self._address: tuple[Any, ...] = address
        self._socket = socket.socket(family, kind, protocol)
        self._socket.setblocking(False)
        self._utc, self._offset = utc, math.nan
        self.dropped = 0

    def __call__(self, status: Mapping[str, Any]) -> None:
        """Send one picture; never waits."""
        if math.isnan(self._offset):
            self._offset = self._utc() - status["time"]
        winches = {name: _numbers(winch) for name, winch in status["winch"].items()}
        stamp = status["time"] + self._offset
        picture = {**winches, "cycle": status["cycle"], "timestamp": stamp}
        data = json.dumps(picture, separators=(",", ":")).encode()
        try:
            if len(data) > _LARGEST:
                raise BlockingIOError
            self._socket.sendto(data, self._address)
        except OSError:
            self.dropped += 1

    def close(self) -> None:
        """Let the socket go."""
        self._socket.close()


def _version_six(found: tuple[Any, ...]) -> bool:
    return bool(found[0] == socket.AF_INET6)


def _numbers(winch: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a snapshot, which can be plotted."""
    return {
        key: value
        for key, value in winch.items()
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    }

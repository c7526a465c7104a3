"""The interface under a bus: python-can's, and on SocketCAN the socket itself.

python-can's own reader does not report how many frames a full socket dropped: with SO_RXQ_OVFL
set, it takes the count for a protocol error. So the socket is read here.
"""

from __future__ import annotations

import errno
import socket
import struct
from contextlib import suppress
from typing import Any, NamedTuple, Protocol

import can

from winchkit.drivers.can.bus.health import BusState
from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import Scheduler
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec

__all__ = [
    "Frame",
    "Interface",
    "hands_back",
    "open_interface",
    "parse_socketcan",
    "queue_full",
    "sends_remote",
    "simulated_interface",
]

_STAMPED = {"pcan", "kvaser", "ixxat", "vector", "neovi", "nican"}
"""Interfaces whose time stamps are the hardware's or its driver's."""
_NO_BITRATE = ("virtual", "udp_multicast")
_HAND_BACK = ("udp_multicast",)
"""Interfaces that hand back what is sent through them, like frames of others."""
_NO_REMOTE = ("socketcand", "neousys")
"""Interfaces for which python-can sends a remote frame as a data frame, or not at all."""

_FRAME = struct.Struct("=IB3x8s")
_EXTENDED, _REMOTE, _ERROR = 1 << 31, 1 << 30, 1 << 29
_STAMP = struct.Struct("@qq")
_INTERVAL = struct.Struct("@ll")
_DROPS = struct.Struct("=I")
_SO_TIMESTAMPNS, _SO_RXQ_OVFL = 35, 40
_ANCILLARY = 128
_CONFIRM = 0x800
"""Flag of a frame that this very socket has sent (MSG_CONFIRM of Linux)."""
_QUEUE = 1 << 20
"""Bytes of the socket's queue; the usual one keeps 278 frames."""

_STATES = {
    can.BusState.ACTIVE: BusState.ACTIVE,
    can.BusState.PASSIVE: BusState.PASSIVE,
    can.BusState.ERROR: BusState.OFF,
}


class Frame(NamedTuple):
    """A frame as received: of 11 bits and with data, or an error frame.

    A named tuple, since thousands of them are made a second.
    """

    identifier: int
    data: bytes
    stamp: float = 0.0
    """By the interface's clock, s; 0 where it has none of its own."""
    error: bool = False


class Interface(Protocol):
    """An open interface."""

    library: Any
    """python-can's bus, for canopen."""
    dropped: int
    """Frames that its queue had no room for."""

    def receive(self, timeout: float) -> Frame | None:
        """Take the next frame; raises can.CanError or OSError.

        A confirmation of what was sent here, where the interface marks it as one, is no frame.
        """

    def send(self, identifier: int, data: bytes) -> None:
        """Send a data frame of 11 bits; raises can.CanError or OSError."""

    def send_remote(self, identifier: int) -> None:
        """Send a remote frame of 11 bits for one byte; raises can.CanError or OSError."""

    def state(self) -> BusState | None:
        """What the controller says of itself; None where only error frames do."""

    def close(self) -> None:
        """Let it go; does not fail."""


class _Library:
    """Any interface of python-can."""

    def __init__(self, bus: Any, stamped: bool) -> None:
        self.library = bus
        self.dropped = 0
        self._stamped = stamped
        self._tells = type(bus).state is not can.BusABC.state

    def receive(self, timeout: float) -> Frame | None:
        message = self.library.recv(timeout)
        if message is None or message.is_remote_frame or not message.is_rx:
            return None
        if message.is_extended_id and not message.is_error_frame:
            return None
        stamp = message.timestamp if self._stamped else 0.0
        data = bytes(message.data)
        return Frame(message.arbitration_id, data, stamp, message.is_error_frame)

    def send(self, identifier: int, data: bytes) -> None:
        self.library.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def send_remote(self, identifier: int) -> None:
        self.library.send(_remote_frame(identifier))

    def state(self) -> BusState | None:
        return _STATES.get(self.library.state) if self._tells else None

    def close(self) -> None:
        with suppress(can.CanError, OSError):
            self.library.shutdown()


class _SocketCan:
    """A raw CAN socket of Linux, opened by python-can."""

    def __init__(self, bus: Any) -> None:
        self.library = bus
        self.dropped = 0
        self._socket: socket.socket = bus.socket
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _QUEUE)
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
        self._socket.setblocking(True)
        self._timeout = -1.0

    def receive(self, timeout: float) -> Frame | None:
        if timeout != self._timeout:
            self._set_timeout(timeout)
        try:
            data, ancillary, flags, _ = self._socket.recvmsg(_FRAME.size, _ANCILLARY)
        except BlockingIOError:
            return None
        frame, drops = parse_socketcan(data, ancillary)
        if drops is not None:
            self.dropped = drops
        return None if flags & _CONFIRM else frame

    def send(self, identifier: int, data: bytes) -> None:
        self._socket.send(_FRAME.pack(identifier, len(data), data))

    def send_remote(self, identifier: int) -> None:
        self._socket.send(_FRAME.pack(identifier | _REMOTE, 1, b""))

    def state(self) -> BusState | None:
        return None

    def _set_timeout(self, timeout: float) -> None:
        """Let the kernel wait: one call a frame, where ``select`` would be another."""
        seconds = int(timeout)
        microseconds = max(1, round((timeout - seconds) * 1e6))
        interval = _INTERVAL.pack(seconds, microseconds)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, interval)
        self._timeout = timeout

    def close(self) -> None:
        with suppress(can.CanError, OSError):
            self.library.shutdown()


class _Simulated:
    """A port of a simulated bus in this process, in simulated time."""

    def __init__(self, port: Any) -> None:
        self.library = port
        self.dropped = 0

    def receive(self, timeout: float) -> Frame | None:
        received = self.library.receive(timeout)
        return None if received is None else Frame(*received)

    def send(self, identifier: int, data: bytes) -> None:
        self.library.transmit(identifier, data)

    def send_remote(self, identifier: int) -> None:
        self.library.send(_remote_frame(identifier))

    def state(self) -> BusState | None:
        return None

    def close(self) -> None:
        self.library.close()


def _remote_frame(identifier: int) -> can.Message:
    return can.Message(arbitration_id=identifier, is_remote_frame=True, dlc=1, is_extended_id=False)


def parse_socketcan(
    data: bytes, ancillary: list[tuple[int, int, bytes]]
) -> tuple[Frame | None, int | None]:
    """A ``struct can_frame`` with its control messages: the frame, and the count of drops.

    None in place of a frame of 29 bits, a remote frame or a fragment; None in place of a count
    that the kernel did not send.
    """
    stamp, drops = 0.0, None
    for level, kind, content in ancillary:
        if level != socket.SOL_SOCKET:
            continue
        if kind == _SO_TIMESTAMPNS and len(content) >= _STAMP.size:
            seconds, nanoseconds = _STAMP.unpack_from(content)
            stamp = seconds + nanoseconds * 1e-9
        elif kind == _SO_RXQ_OVFL and len(content) >= _DROPS.size:
            (drops,) = _DROPS.unpack_from(content)
    if len(data) < _FRAME.size:
        return None, drops
    identifier, size, payload = _FRAME.unpack_from(data)
    error = bool(identifier & _ERROR)
    if not error and identifier & (_EXTENDED | _REMOTE):
        return None, drops
    return Frame(identifier & (_ERROR - 1), payload[:size], stamp, error), drops


def queue_full(error: BaseException) -> bool:
    """Whether a frame could not be sent because the interface's queue is full for now."""
    number = getattr(error, "error_code", None) or getattr(error, "errno", None)
    return number in (errno.ENOBUFS, errno.EAGAIN)


def sends_remote(spec: BusSpec) -> bool:
    """Whether remote frames can be sent through this interface, as far as that is known."""
    return spec.interface not in _NO_REMOTE


def hands_back(spec: BusSpec) -> bool:
    """Whether what is sent through this interface comes back, unmarked."""
    return spec.interface in _HAND_BACK


def simulated_interface(spec: BusSpec, clock: Clock) -> Interface | None:
    """The bus that a clock of simulated time has under this channel; None where it has none."""
    port = clock.can_port(spec.channel or "") if isinstance(clock, Scheduler) else None
    return None if port is None else _Simulated(port)


def open_interface(spec: BusSpec, name: str) -> Interface:
    """Open what a bench file names; raises ConnectionLost saying what was tried."""
    options: dict[str, Any] = {"interface": spec.interface, "channel": spec.channel}
    if spec.interface not in _NO_BITRATE:
        options["bitrate"] = spec.bitrate
    if spec.port is not None:
        options["port"] = int(spec.port) if spec.interface == "udp_multicast" else spec.port
    try:
        if spec.interface == "socketcan" and spec.channel:
            # python-can leaves its socket open where it cannot be bound.
            socket.if_nametoindex(spec.channel)
        bus = can.Bus(**options)
        if spec.interface == "socketcan":
            return _SocketCan(bus)
    except (can.CanError, OSError, ValueError, ImportError, NotImplementedError) as error:
        hint = ""
        if spec.interface == "udp_multicast" and isinstance(error, OSError):
            hint = "; a machine with only `lo` needs: ip route add 239.0.0.0/8 dev lo"
        raise ConnectionLost(
            f"bus '{name}': cannot open {spec.interface} channel '{spec.channel}': {error}{hint}"
        ) from error
    return _Library(bus, spec.interface in _STAMPED)

"""The interface under a bus: python-can's, the socket of SocketCAN, or a simulated bus."""

from __future__ import annotations

import errno
import socket
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Protocol

import can

from winchkit.drivers.can.bus.health import BusState
from winchkit.drivers.can.bus.socketcan import ReceivedFrame, SocketCan
from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import Scheduler
from winchkit.errors import ConnectionLost
from winchkit.multicast import MulticastPort
from winchkit.schema.bench import BusSpec

_STAMPED = {"pcan", "kvaser", "ixxat", "vector", "neovi", "nican"}
"""Interfaces whose time stamps are the hardware's or its driver's."""
_NO_BITRATE = ("virtual", "udp_multicast")
_NO_REMOTE = ("socketcand", "neousys")
"""Interfaces for which python-can sends a remote frame as a data frame, or not at all."""

_ON_SERIAL_PORT = "the package pyserial: pip install pyserial"
_LIBRARIES = {
    "canalystii": 'the package canalystii: pip install "python-can[canalystii]"',
    "cantact": 'the package cantact: pip install "python-can[cantact]"',
    "etas": "ETAS BOA, for Windows",
    "gs_usb": 'the package gs_usb: pip install "python-can[gs-usb]"',
    "iscan": "Thorsis isCAN, for Windows",
    "ixxat": "Ixxat's VCI driver, for Windows; on Linux use socketcan",
    "kvaser": "Kvaser's CANlib (kvaser.com, downloads); on Linux socketcan needs none",
    "neousys": "Neousys' WDT_DIO driver",
    "neovi": 'the package python-ics: pip install "python-can[neovi]"',
    "nican": "the NI-CAN driver, for Windows",
    "nixnet": 'NI-XNET, for Windows, and the package nixnet: pip install "python-can[nixnet]"',
    "pcan": "PEAK's PCAN-Basic (peak-system.com, downloads); on Linux socketcan needs none",
    "robotell": _ON_SERIAL_PORT,
    "seeedstudio": _ON_SERIAL_PORT,
    "serial": _ON_SERIAL_PORT,
    "slcan": _ON_SERIAL_PORT,
    "systec": "SYS TEC's USB-CANmodul driver, for Windows",
    "usb2can": "8devices' usb2can driver and the package pywin32, for Windows",
    "vector": "Vector's XL Driver Library, for Windows",
}
"""What python-can's interfaces need besides, in its version 4.6."""

_GROUP, _PORT = "239.74.163.2", 43113
"""Default of python-can for ``udp_multicast``."""

_STATES = {
    can.BusState.ACTIVE: BusState.ACTIVE,
    can.BusState.PASSIVE: BusState.PASSIVE,
    can.BusState.ERROR: BusState.OFF,
}


class Interface(Protocol):
    """An open interface."""

    library: Any
    """python-can's bus, for canopen."""
    dropped: int = 0
    """Frames that its queue had no room for."""

    def receive(self, timeout: float) -> Sequence[ReceivedFrame]:
        """Take the frames that wait, at least one within ``timeout`` (s); empty if there is none.

        A confirmation of what was sent here, where the interface marks it as one, is no frame.
        Raises can.CanError or OSError.
        """

    def send(self, identifier: int, data: bytes) -> None:
        """Send a data frame of 11 bits; raises can.CanError or OSError."""

    def send_together(self, frames: Sequence[tuple[int, bytes]]) -> int:
        """Send the first of these frames in one call; returns how many, 0 without such a call."""
        return 0

    def send_remote(self, identifier: int) -> None:
        """Send a remote frame of 11 bits for one byte; raises can.CanError or OSError."""

    def state(self) -> BusState | None:
        """State of the controller; None where only error frames report it."""
        return None

    def close(self) -> None:
        """Close it; raises nothing."""


class _Library(Interface):
    """Any interface of python-can."""

    def __init__(self, bus: Any, stamped: bool) -> None:
        self.library = bus
        self._stamped = stamped
        self._tells = type(bus).state is not can.BusABC.state

    def receive(self, timeout: float) -> Sequence[ReceivedFrame]:
        message = self.library.recv(timeout)
        if message is None or message.is_remote_frame or not message.is_rx:
            return ()
        if message.is_extended_id and not message.is_error_frame:
            return ()
        stamp = message.timestamp if self._stamped else 0.0
        data = bytes(message.data)
        return (ReceivedFrame(message.arbitration_id, data, stamp, message.is_error_frame),)

    def send(self, identifier: int, data: bytes) -> None:
        self.library.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def send_remote(self, identifier: int) -> None:
        self.library.send(_remote_frame(identifier))

    def state(self) -> BusState | None:
        return _STATES.get(self.library.state) if self._tells else None

    def close(self) -> None:
        with suppress(can.CanError, OSError):
            self.library.shutdown()


class _Multicast(Interface):
    """A group of UDP multicast."""

    def __init__(self, port: MulticastPort) -> None:
        self.library = _Sender(port)
        self._port = port

    def receive(self, timeout: float) -> Sequence[ReceivedFrame]:
        received = self._port.receive(timeout)
        return () if received is None else (ReceivedFrame(*received),)

    def send(self, identifier: int, data: bytes) -> None:
        self._port.send(identifier, data)

    def send_remote(self, identifier: int) -> None:
        self._port.send(identifier, b"", remote=True)

    def close(self) -> None:
        self._port.close()


class _Sender:
    """Sends messages of python-can, for canopen's SDO clients."""

    def __init__(self, port: MulticastPort) -> None:
        self._port = port

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        self._port.send(message.arbitration_id, bytes(message.data), remote=message.is_remote_frame)


class _Simulated(Interface):
    """A port of a simulated bus in this process, in simulated time."""

    def __init__(self, port: Any) -> None:
        self.library = port

    def receive(self, timeout: float) -> Sequence[ReceivedFrame]:
        received = self.library.receive(timeout)
        return () if received is None else (ReceivedFrame(*received),)

    def send(self, identifier: int, data: bytes) -> None:
        self.library.transmit(identifier, data)

    def send_remote(self, identifier: int) -> None:
        self.library.send(_remote_frame(identifier))

    def close(self) -> None:
        self.library.close()


def _remote_frame(identifier: int) -> can.Message:
    return can.Message(arbitration_id=identifier, is_remote_frame=True, dlc=1, is_extended_id=False)


def queue_full(error: BaseException) -> bool:
    """Whether a frame could not be sent because the interface's queue is full for now."""
    number = getattr(error, "error_code", None) or getattr(error, "errno", None)
    return number in (errno.ENOBUFS, errno.EAGAIN)


def sends_remote(spec: BusSpec) -> bool:
    """Whether remote frames can be sent through this interface, as far as that is known."""
    return spec.interface not in _NO_REMOTE


def simulated_interface(spec: BusSpec, clock: Clock) -> Interface | None:
    """The bus that a clock of simulated time has under this channel; None where it has none."""
    port = clock.can_port(spec.channel or "") if isinstance(clock, Scheduler) else None
    return None if port is None else _Simulated(port)


def open_interface(spec: BusSpec, name: str) -> Interface:
    """Open the interface of a bench file; raises ConnectionLost."""
    options: dict[str, Any] = {"interface": spec.interface, "channel": spec.channel}
    if spec.interface not in _NO_BITRATE:
        options["bitrate"] = spec.bitrate
    options |= {key: value for key in ("host", "port") if (value := getattr(spec, key)) is not None}
    try:
        if spec.interface == "socketcan" and spec.channel:
            # python-can leaves its socket open where it cannot be bound.
            socket.if_nametoindex(spec.channel)
        if spec.interface == "udp_multicast":
            return _Multicast(MulticastPort(spec.channel or _GROUP, int(spec.port or _PORT)))
        bus = can.Bus(**options)
        if spec.interface == "socketcan":
            return SocketCan(bus)
    except Exception as error:
        # An interface whose library is missing raises whatever its first call into it does.
        raise ConnectionLost(
            f"bus '{name}': cannot open {spec.interface} channel '{spec.channel}': "
            f"{_cause(spec, error)}"
        ) from error
    return _Library(bus, spec.interface in _STAMPED)


def _cause(spec: BusSpec, error: Exception) -> str:
    """Why an interface could not be opened, and what to install or to give."""
    if spec.interface == "udp_multicast" and isinstance(error, OSError):
        return f"{error}; a machine with only `lo` needs: ip route add 239.0.0.0/8 dev lo"
    if spec.interface == "socketcand" and (spec.host is None or spec.port is None):
        return "it needs `host` and `port` of the daemon, in a bench file"
    if spec.interface == "socketcan" and sys.platform != "linux":
        return (
            "SocketCAN is part of Linux; here an adapter has an interface of its maker, such as "
            "pcan, kvaser, ixxat, gs_usb or slcan"
        )
    needed = _LIBRARIES.get(spec.interface or "")
    if needed is not None and _says_missing(error):
        return f"it needs {needed}"
    if isinstance(error, can.CanError | OSError | ValueError | ImportError | NotImplementedError):
        return str(error)
    return f"{type(error).__name__}: {error}; look into its keys, and what python-can needs for it"


def _says_missing(error: Exception) -> bool:
    """Whether an error comes of a library that is not there, and not of a port or its number."""
    if isinstance(
        error, NotImplementedError | ImportError | NameError | AttributeError | TypeError
    ):
        return True
    return isinstance(error, OSError) and error.errno is None

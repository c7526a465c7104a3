"""A CAN bus: python-can underneath, one receive thread, handlers by identifier."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Any

import can
import canopen

from winchkit.drivers.clock import Clock
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec

__all__ = ["CanBus", "Handler"]

Handler = Callable[[bytes, float], None]
"""Takes a frame's data and the time of its reception; runs on the receive thread."""

_SYNC = 0x080
_NMT = 0x000
_HEARTBEAT = 0x700
_SDO_REPLY = range(0x581, 0x600)
_WAIT = 0.05
_MAX_FAILURES = 5
_FAILURE_PAUSE = 0.01

for _library in ("canopen", "can"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


class CanBus:
    """An open bus. ``fault`` says why it died, once it has.

    Handlers check what they are given and raise nothing: they run on the receive thread.
    """

    def __init__(self, spec: BusSpec, name: str, clock: Clock) -> None:
        """Open the bus and start receiving; raises ConnectionLost."""
        self.name = name
        self.clock = clock
        self.received = 0
        self.error_frames = 0
        self.fault: str | None = None
        self.network = canopen.Network()
        self._handlers: dict[int, Handler] = {}
        self._bus = self.network.bus = _open(spec, name)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._receive, name=f"can-{name}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop receiving and let the interface go."""
        self._stopping.set()
        self._thread.join(timeout=2.0)
        self._bus.shutdown()
        self.network.bus = None

    def on(self, identifier: int, handler: Handler) -> None:
        """Call ``handler`` for every frame with this identifier."""
        self._handlers[identifier] = handler

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame; raises ConnectionLost."""
        try:
            self.network.send_message(identifier, data)
        except (can.CanError, OSError) as error:
            self.fault = f"cannot send: {error}"
            raise ConnectionLost(f"bus '{self.name}': {self.fault}; check the adapter") from error

    def sync(self) -> None:
        """Send SYNC."""
        self.send(_SYNC, b"")

    def nmt(self, command: int, node: int) -> None:
        """Send an NMT command: 1 start, 2 stop, 80h pre-operational, 81h reset."""
        self.send(_NMT, bytes((command, node)))

    def heartbeat(self, node: int, state: int) -> None:
        """Send the host's heartbeat."""
        self.send(_HEARTBEAT + node, bytes((state,)))

    def _receive(self) -> None:
        """Receive until closed; one unreadable frame is counted, many in a row end the bus."""
        failures = 0
        while not self._stopping.is_set():
            try:
                message = self._bus.recv(_WAIT)
            except (can.CanError, OSError) as error:
                self.error_frames += 1
                failures += 1
                if failures >= _MAX_FAILURES:
                    self.fault = f"cannot receive: {error}"
                    return
                self._stopping.wait(_FAILURE_PAUSE)
                continue
            failures = 0
            if message is not None:
                self._dispatch(message)

    def _dispatch(self, message: Any) -> None:
        if message.is_error_frame:
            self.error_frames += 1
            return
        self.received += 1
        identifier = message.arbitration_id
        handler = self._handlers.get(identifier)
        if handler is not None:
            handler(bytes(message.data), self.clock.now())
        elif identifier in _SDO_REPLY and len(message.data) == 8:
            self.network.notify(identifier, message.data, message.timestamp)


def _open(spec: BusSpec, name: str) -> Any:
    """Open python-can's interface; raises ConnectionLost saying what was tried."""
    options: dict[str, Any] = {"interface": spec.interface, "channel": spec.channel}
    if spec.interface not in ("virtual", "udp_multicast"):
        options["bitrate"] = spec.bitrate
    if spec.port is not None:
        options["port"] = int(spec.port) if spec.interface == "udp_multicast" else spec.port
    try:
        return can.Bus(**options)
    except (can.CanError, OSError, ValueError, ImportError, NotImplementedError) as error:
        hint = ""
        if spec.interface == "udp_multicast" and isinstance(error, OSError):
            hint = "; a machine with only `lo` needs: ip route add 239.0.0.0/8 dev lo"
        raise ConnectionLost(
            f"bus '{name}': cannot open {spec.interface} channel '{spec.channel}': {error}{hint}"
        ) from error

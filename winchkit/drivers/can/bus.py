"""A CAN bus: one receive thread, handlers by identifier, and counts of what goes wrong."""

from __future__ import annotations

import errno
import logging
import threading
from collections import Counter
from collections.abc import Callable

import can
import canopen

from winchkit.drivers.can.frame_time import FrameTime
from winchkit.drivers.can.health import BusHealth, BusState, ErrorTally
from winchkit.drivers.can.interface import Frame, Interface, open_interface
from winchkit.drivers.clock import Clock
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec

__all__ = ["CanBus", "Handler"]

Handler = Callable[[bytes, float], None]
"""Takes a frame's data and its time on the bench's clock; runs on the receive thread."""

_SYNC = 0x080
_NMT = 0x000
_HEARTBEAT = 0x700
_SDO_REPLY = range(0x581, 0x600)
_WAIT = 0.05
_MAX_FAILURES = 5
_FAILURE_PAUSE = 0.01
_GONE = (errno.ENETDOWN, errno.ENODEV, errno.ENXIO)
_SDO_SIZE = 8
_LAST_NODE = 127

for _library in ("canopen", "can"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


class CanBus:
    """An open bus. ``fault`` says why it died, once it has; :meth:`reopen` gives it new life.

    Handlers check what they are given and raise nothing: they run on the receive thread.
    """

    def __init__(self, spec: BusSpec, name: str, clock: Clock) -> None:
        """Open the bus and start receiving; raises ConnectionLost."""
        self.name = name
        self.clock = clock
        self.received = self.sent = self.unsent = self.reopened = 0
        self.fault: str | None = None
        self.beats: Counter[int] = Counter()
        """Heartbeats sent, by the node that they were sent for."""
        self.network = canopen.Network()
        self._spec = spec
        self._handlers: dict[int, Handler] = {}
        self._errors = ErrorTally()
        self._heard: set[int] = set()
        self._dropped = 0
        self._open()

    def close(self) -> None:
        """Stop receiving and let the interface go."""
        self._stopping.set()
        self._thread.join(timeout=2.0)
        self._dropped += self._port.dropped
        self._port.close()

    def reopen(self) -> None:
        """Open the interface anew after it went down; raises ConnectionLost.

        Nodes, handlers and counts stay. Nothing is sent: drives keep the state that they are in,
        and whoever wants to move them has to set them up again.
        """
        self.close()
        try:
            self._open()
        except ConnectionLost as error:
            self.fault = str(error)
            raise
        self.reopened += 1
        self._errors.enter(BusState.ACTIVE)
        self.fault = None

    @property
    def error_frames(self) -> int:
        """Error frames received."""
        return self._errors.frames

    @property
    def health(self) -> BusHealth:
        """What happened since it was opened first."""
        tally, down = self._errors, self.fault is not None and not self._thread.is_alive()
        return BusHealth(
            state=BusState.DOWN if down else tally.state,
            received=self.received,
            sent=self.sent,
            error_frames=tally.frames,
            bus_off=tally.bus_off,
            error_passive=tally.error_passive,
            overruns=tally.overruns,
            dropped=self._dropped + self._port.dropped,
            unsent=self.unsent,
            reopened=self.reopened,
            fault=self.fault or "",
        )

    @property
    def nodes(self) -> frozenset[int]:
        """Nodes that are known here, or whose heartbeat was heard."""
        known = (identifier - _HEARTBEAT for identifier in tuple(self._handlers))
        return frozenset(self._heard.union(node for node in known if 0 < node <= _LAST_NODE))

    def on(self, identifier: int, handler: Handler) -> None:
        """Call ``handler`` for every frame with this identifier."""
        self._handlers[identifier] = handler

    def off(self, identifier: int) -> None:
        """Let frames with this identifier pass again."""
        self._handlers.pop(identifier, None)

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame; raises ConnectionLost."""
        port = self._port
        try:
            with self.network.send_lock:
                port.send(identifier, data)
        except (can.CanError, OSError, ValueError) as error:
            self.unsent += 1
            reason = f"cannot send: {error}"
            if port is self._port:
                self.fault = reason
            raise ConnectionLost(f"bus '{self.name}': {reason}; check the adapter") from error
        self.sent += 1

    def sync(self) -> None:
        """Send SYNC."""
        self.send(_SYNC, b"")

    def nmt(self, command: int, node: int) -> None:
        """Send an NMT command: 1 start, 2 stop, 80h pre-operational, 81h reset."""
        self.send(_NMT, bytes((command, node)))

    def heartbeat(self, node: int, state: int) -> None:
        """Send the host's heartbeat."""
        self.send(_HEARTBEAT + node, bytes((state,)))
        self.beats[node] += 1

    def _open(self) -> None:
        self._port: Interface = open_interface(self._spec, self.name)
        self.network.bus = self._port.library
        self._times = FrameTime()
        self._stopping = threading.Event()
        self._thread = threading.Thread(
            target=self._receive, args=(self._port,), name=f"can-{self.name}", daemon=True
        )
        self._thread.start()

    def _receive(self, port: Interface) -> None:
        """Receive until closed; one unreadable frame is counted, many in a row end the bus."""
        failures, stopping = 0, self._stopping
        while not stopping.is_set():
            try:
                frame = port.receive(_WAIT)
            except (can.CanError, OSError, ValueError) as error:
                self._errors.frames += 1
                failures += 1
                # An interface that goes down says so once and is silent from then on.
                if failures >= _MAX_FAILURES or getattr(error, "errno", None) in _GONE:
                    self.fault = f"cannot receive: {error}"
                    return
                stopping.wait(_FAILURE_PAUSE)
                continue
            failures = 0
            if frame is not None:
                self._dispatch(frame)
            elif (state := port.state()) is not None:
                self._errors.enter(state)

    def _dispatch(self, frame: Frame) -> None:
        if frame.error:
            self._take_error(frame)
            return
        self.received += 1
        now = self.clock.now()
        if frame.identifier > _HEARTBEAT:
            self._heard.add(frame.identifier - _HEARTBEAT)
        handler = self._handlers.get(frame.identifier)
        if handler is not None:
            handler(frame.data, self._times.map(frame.stamp, now) if frame.stamp else now)
        elif frame.identifier in _SDO_REPLY and len(frame.data) == _SDO_SIZE:
            self.network.notify(frame.identifier, bytearray(frame.data), now)

    def _take_error(self, frame: Frame) -> None:
        """A bus-off is a fault: until the controller restarts nobody hears what is sent."""
        before = self._errors.state
        self._errors.take(frame.identifier, frame.data)
        state = self._errors.state
        if state is BusState.OFF and before is not BusState.OFF:
            self.fault = "the controller is bus off; check termination, bit rate and wiring"

"""A CAN bus: one receive thread, handlers by identifier, and counts of what goes wrong."""

from __future__ import annotations

import errno
import logging
import math
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial

import can
import canopen

from winchkit.drivers.can.bus.frame_tap import FrameTap
from winchkit.drivers.can.bus.health import BusHealth, BusState, ErrorTally
from winchkit.drivers.can.bus.interface import (
    Interface,
    open_interface,
    queue_full,
    sends_remote,
    simulated_interface,
)
from winchkit.drivers.can.bus.socketcan import ReceivedFrame
from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import event_of, thread_of
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec

_DRIFT = 2e-4
"""At most by how much two clocks run apart."""
_LATE = 0.02
"""Delay of reading from which a frame is not used for the offset, s."""
_SET = 0.25
"""When all frames of so long come late, one of the clocks was set, s."""
_OLDEST = 0.1
"""No frame is taken to be older, s."""


class FrameTime:
    """Offset between the interface's clock and the bench's, estimated from the frames.

    A frame is handed over some time after its stamp, and sometimes at once: the least difference
    is the offset, which may grow only as fast as clocks drift. The time of a frame is never later
    than its reception.
    """

    def __init__(self) -> None:
        self._offset = math.inf
        self._last = self._stamp = 0.0
        self._late_since: float | None = None

    def map(self, stamp: float, now: float) -> float:
        """Moment of a frame on the bench's clock, given its stamp and when it was received, s."""
        if stamp <= 0.0:
            return now
        seen, offset = now - stamp, self._offset
        before, self._stamp = self._stamp, stamp
        if seen < offset:
            self._late_since, offset = None, seen
        elif seen - offset <= _LATE:
            self._late_since = None
            # Not within a reception, whose frames have the same ``now``.
            if now > self._last:
                offset += min(seen - offset, _DRIFT * (now - self._last))
        elif stamp < before:
            # Frames come in their order: the clock of the stamps was set back (NTP), or wrapped.
            self._late_since, offset = None, seen
        elif self._late_since is None:
            self._late_since = stamp
        elif stamp - self._late_since >= _SET:
            self._late_since, offset = None, seen
        self._offset, self._last = offset, now
        time, oldest = stamp + offset, now - _OLDEST
        return time if time > oldest else oldest


Handler = Callable[[bytes, float], None]
"""Takes a frame's data and its time on the bench's clock; runs on the receive thread."""

_SYNC = 0x080
_NMT = 0x000
_HEARTBEAT = 0x700
"""COB-IDs of the predefined connection set (CiA 301): SYNC, NMT, and heartbeats, to which the node
id is added."""
_SDO_REPLY = range(0x581, 0x600)
_WAIT = 0.05
"""s: upper bound of the time that closing waits for the receive thread; a frame ends the wait at
once."""
_MAX_FAILURES = 5
"""In a row, without a frame in between: about 50 ms with the pause, in which a driver may report
one event several times (rule of thumb)."""
_FAILURE_PAUSE = 0.01
"""s: a failing call does not keep a core busy."""
_FULL_TIME = 0.1
"""For which the queue of the interface may be full before the bus counts as dead, s."""
_GONE = (errno.ENETDOWN, errno.ENODEV, errno.ENXIO)
SDO_SIZE = 8
"""Bytes: an SDO frame always has eight (CiA 301); others are of another protocol."""
_LAST_NODE = 127
"""Node ids are 1 to 127 (CiA 301)."""

for _library in ("canopen", "can"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


class CanBus:
    """An open bus. ``fault`` is the reason why it ended; :meth:`reopen` opens it again.

    Handlers check what they are given and raise nothing: they run on the receive thread. One that
    raises ends reception, and ``fault`` names its exception.
    """

    def __init__(self, spec: BusSpec, name: str, clock: Clock) -> None:
        """Open the bus and start receiving; raises ConnectionLost."""
        self.name = name
        self.clock = clock
        self.received = self.sent = self.unsent = self.reopened = 0
        self.thread_id = 0
        """Native id of the receive thread, once it runs."""
        self.fault: str | None = None
        self.beats: Counter[int] = Counter()
        """Heartbeats sent, by the node that they were sent for."""
        self.sdo_timeout = spec.sdo_timeout
        """For the answer to an SDO request, s."""
        self.sends_remote = sends_remote(spec)
        """Whether the interface sends remote frames, as far as that is known."""
        self.sync_held = self.heartbeat_held = False
        """Whether :meth:`sync` or :meth:`heartbeat` send nothing, while a drive is to miss them."""
        self.tap: FrameTap | None = None
        """Collector of the frames for a viewer; removed once it has expired."""
        self.network = _Network(self._show_sent)
        self._spec = spec
        self._foreign: dict[int, list[Handler]] = {}
        self._handlers: dict[int, Handler] = {}
        self._errors = ErrorTally()
        self._heard: dict[int, int] = {}
        """NMT state of the newest heartbeat, by node."""
        self._dropped = 0
        self.foreign_syncs = 0
        """SYNC frames on the bus that were not sent here."""
        self._full_since: float | None = None
        self._gathered: list[tuple[int, bytes]] | None = None
        self.on_foreign_sync: Callable[[str], None] = lambda _words: None
        """Called on the receive thread with each SYNC that was not sent here."""
        self.on(_SYNC, self._hear_sync)
        self._open()

    def close(self) -> None:
        """Stop receiving and close the interface."""
        self._stopping.set()
        self._thread.join(timeout=2.0)
        self._dropped += self._port.dropped
        self._port.close()

    def reopen(self) -> None:
        """Open the interface anew, with its handlers; sends nothing. Raises ConnectionLost."""
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
        """State and counts since the bus was first opened."""
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
            foreign_syncs=self.foreign_syncs,
            fault=self.fault or "",
        )

    @property
    def nodes(self) -> frozenset[int]:
        """Nodes that are known here, or whose heartbeat was received."""
        known = (identifier - _HEARTBEAT for identifier in tuple(self._handlers))
        heard = frozenset(tuple(self._heard))
        return heard.union(node for node in known if 0 < node <= _LAST_NODE)

    def nmt_state(self, node: int) -> int | None:
        """State in the newest heartbeat of a node; None before the first."""
        return self._heard.get(node)

    @property
    def foreign_sync(self) -> str:
        """Report of a second SYNC producer; empty without one."""
        count = self.foreign_syncs
        if not count:
            return ""
        return (
            f"bus '{self.name}': {count} SYNC frames that were not sent here; a second master, or "
            "a drive whose 1005h has bit 30 set, sends SYNC too: cyclic modes need one producer"
        )

    def _hear_sync(self, _data: bytes, _now: float) -> None:
        self.foreign_syncs += 1
        if words := self.foreign_sync:
            self.on_foreign_sync(words)

    def on(self, identifier: int, handler: Handler) -> None:
        """Call ``handler`` for every frame with this identifier."""
        self._handlers[identifier] = handler

    def on_foreign(self, identifier: int, handler: Handler) -> None:
        """Call ``handler`` too for every frame with this identifier that was not sent here."""
        handlers = self._foreign.setdefault(identifier, [])
        if handler not in handlers:
            handlers.append(handler)

        def receive(data: bytes, now: float) -> None:
            for each in handlers:
                each(data, now)

        self.on(identifier, receive)

    def off(self, identifier: int) -> None:
        """Remove the handler of an identifier."""
        self._handlers.pop(identifier, None)

    def pass_on(self, identifier: int, data: bytes, now: float) -> None:
        """Give an SDO reply that no handler claims to the confirmed SDO client."""
        self.network.notify(identifier, bytearray(data), now)

    def send(self, identifier: int, data: bytes) -> bool:
        """Send one frame; raises ConnectionLost.

        A full queue of the interface is no dead bus: the frame is left out and counted (False is
        returned), and only a queue that stays full is a fault.
        """
        port = self._port
        try:
            with self.network.send_lock:
                port.send(identifier, data)
        except (can.CanError, OSError, ValueError) as error:
            if self._queue_full(error):
                return False
            raise self._unsendable(port, error) from error
        self.sent += 1
        if self.tap is not None:
            self._show_sent(identifier, data)
        if self._full_since is not None:
            self._full_since = None
        return True

    def gather(self) -> None:
        """Queue the frames of :meth:`post` until :meth:`send_gathered`; for the control loop."""
        self._gathered = []

    def post(self, identifier: int, data: bytes) -> None:
        """Send a frame, with others of the cycle while they are gathered; as :meth:`send`."""
        if self._gathered is None:
            self.send(identifier, data)
        else:
            self._gathered.append((identifier, data))

    def withdraw(self, identifier: int) -> None:
        """Remove queued frames with this identifier: no target may follow a stop."""
        waiting = self._gathered
        if waiting:
            waiting[:] = [frame for frame in waiting if frame[0] != identifier]

    def send_gathered(self) -> None:
        """Send the gathered frames, by one call where the interface has one.

        A frame that cannot be sent keeps none of the others from being tried; then it raises
        ConnectionLost. A full queue is dealt with as in :meth:`send`.
        """
        frames, self._gathered = self._gathered or [], None
        lost: ConnectionLost | None = None
        for frame in frames[self._sent_together(frames) :]:
            try:
                self.send(*frame)
            except ConnectionLost as error:
                lost = error
        if lost is not None:
            raise lost

    def _sent_together(self, frames: Sequence[tuple[int, bytes]]) -> int:
        """Number of the first of these frames that one call has sent."""
        if not frames:
            return 0
        with self.network.send_lock:
            count = self._port.send_together(frames)
        self.sent += count
        if self.tap is not None:
            for frame in frames[:count]:
                self._show_sent(*frame)
        if count:
            self._full_since = None
        return count

    def remote(self, identifier: int) -> None:
        """Send a remote frame, to which a node answers with one byte; as :meth:`send`."""
        port = self._port
        try:
            with self.network.send_lock:
                port.send_remote(identifier)
        except (can.CanError, OSError, ValueError) as error:
            if self._queue_full(error):
                return
            raise self._unsendable(port, error) from error
        self.sent += 1
        self._full_since = None

    def sync(self) -> None:
        """Send SYNC."""
        if not self.sync_held:
            self.send(_SYNC, b"")

    def nmt(self, command: int, node: int) -> None:
        """Send an NMT command: 1 start, 2 stop, 80h pre-operational, 81h reset."""
        self.send(_NMT, bytes((command, node)))

    def heartbeat(self, node: int, state: int) -> None:
        """Send the host's heartbeat."""
        if self.heartbeat_held:
            return
        if self.send(_HEARTBEAT + node, bytes((state,))):
            self.beats[node] += 1

    def _queue_full(self, error: Exception) -> bool:
        """Whether a frame may be left out: the queue is full, and has not been for long."""
        if not queue_full(error):
            return False
        now = self.clock.now()
        if self._full_since is None:
            self._full_since = now
        lasting = now - self._full_since > _FULL_TIME
        self.unsent += not lasting
        return not lasting

    def _unsendable(self, port: Interface, error: Exception) -> ConnectionLost:
        self.unsent += 1
        reason = f"cannot send: {error}"
        if port is self._port:
            self.fault = reason
        return ConnectionLost(f"bus '{self.name}': {reason}; check the adapter")

    def _open(self) -> None:
        simulated = simulated_interface(self._spec, self.clock)
        self._port: Interface = simulated or open_interface(self._spec, self.name)
        self.network.bus = self._port.library
        self._times = FrameTime()
        self._stopping = event_of(self.clock)
        receive = partial(self._receive, self._port)
        self._thread = thread_of(self.clock, receive, f"can-{self.name}")
        self._thread.start()

    def _receive(self, port: Interface) -> None:
        """Receive until closed; one unreadable frame is counted, many in a row end the bus."""
        self.thread_id = threading.get_native_id()
        failures, stopping = 0, self._stopping
        while not stopping.is_set():
            try:
                frames = port.receive(_WAIT)
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
            if not frames and (state := port.state()) is not None:
                self._errors.enter(state)
            now = self.clock.now()
            if not self._dispatch(frames, now):
                return

    def _dispatch(self, frames: Sequence[ReceivedFrame], now: float) -> bool:
        """Hand frames to their handlers; False where one has raised, which is a defect."""
        handler_of, stamp_to_clock = self._handlers.get, self._times.map
        for identifier, data, stamp, error in frames:
            try:
                if error:
                    self._take_error(identifier, data)
                    continue
                self.received += 1
                if self.tap is not None:
                    self._show(now, identifier, data)
                if identifier > _HEARTBEAT:
                    self._heard[identifier - _HEARTBEAT] = data[0] & 0x7F if data else 0
                handler = handler_of(identifier)
                if handler is not None:
                    handler(data, stamp_to_clock(stamp, now) if stamp else now)
                elif identifier in _SDO_REPLY and len(data) == SDO_SIZE:
                    self.network.notify(identifier, bytearray(data), now)
            except Exception as raised:  # noqa: BLE001 - a defect: it is named, the bench stops
                self.fault = (
                    f"internal error in the receive thread at frame {identifier:03X}h: "
                    f"{type(raised).__name__}: {raised}"
                )
                return False
        return True

    def _show_sent(self, identifier: int, data: bytes) -> None:
        """Show a frame that was sent here; no interface hands it back."""
        self._show(self.clock.now(), identifier, data)

    def _show(self, now: float, identifier: int, data: bytes) -> None:
        tap = self.tap
        if tap is None:
            return
        if now < tap.expires:
            tap.take(now, identifier, bytes(data))
        else:
            self.tap = None

    def _take_error(self, identifier: int, data: bytes) -> None:
        """A bus-off is a fault: until the controller restarts no frame is sent."""
        before = self._errors.state
        self._errors.take(identifier, data)
        state = self._errors.state
        if state is BusState.OFF and before is not BusState.OFF:
            self.fault = "the controller is bus off; check termination, bit rate and wiring"


class _Network(canopen.Network):
    """The canopen library's network; frames of its SDO clients are shown to the tap."""

    def __init__(self, show: Callable[[int, bytes], None]) -> None:
        super().__init__()
        self._show = show

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        super().send_message(can_id, data, remote)
        if not remote:
            self._show(can_id, bytes(data))

"""CAN buses of a simulated bench, within the process or between processes."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable, Container
from contextlib import suppress
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from itertools import count
from random import Random
from time import time as wall_clock
from typing import Any, Literal

import can

from winchkit.errors import ConnectionLost, UsageError
from winchkit.multicast import MulticastPort
from winchkit.schema.bench import BusSpec


@dataclass(frozen=True, slots=True)
class Carried:
    """A frame between the simulated drives and the other nodes."""

    time: float
    """Time on the simulation's clock, s."""
    identifier: int
    data: bytes
    from_drive: bool
    lost: bool = False
    """Whether it was lost."""


@dataclass(frozen=True)
class _Trouble:
    identifiers: Container[int]
    share: float
    delay: float | None
    """Delay, s; None for a lost frame."""


class BusWire:
    """Connection between the simulated drives and the other nodes of one bus.

    ``taps`` are called with every frame, in the order of their arrival at the other end. Safe to
    use from several threads.
    """

    def __init__(self, clock: Callable[[], float], *, seed: int | str = 0) -> None:
        self.taps: list[Callable[[Carried], None]] = []
        self._clock, self._random = clock, Random(f"wire/{seed}")
        self._lock = threading.Lock()
        self._troubles: list[_Trouble] = []
        self._late: dict[bool, list[tuple[float, int, int, bytes]]] = {False: [], True: []}
        self._order = count()

    def disturb(
        self, identifiers: Container[int], *, share: float = 1.0, delay: float | None = None
    ) -> Callable[[], None]:
        """Lose a share of these frames, or delay it by ``delay`` s; returns what ends it."""
        if not 0 < share <= 1 or not (delay is None or delay > 0):
            raise UsageError(
                f"a wire cannot disturb a share of {share:g} of its frames by {delay} s; "
                "a share is above 0 and at most 1, a delay above 0 s"
            )
        trouble = _Trouble(identifiers, share, delay)
        with self._lock:
            self._troubles.append(trouble)

        def end() -> None:
            with self._lock:
                self._troubles = [one for one in self._troubles if one is not trouble]

        return end

    def carry(self, identifier: int, data: bytes, *, from_drive: bool) -> bool:
        """Take a frame; True where it passes at once, else it is lost or delayed (:meth:`due`)."""
        with self._lock:
            if not self.taps and not self._troubles:
                return True
            now = self._clock()
            trouble = self._trouble_of(identifier)
            if trouble is not None and trouble.delay is not None:
                late = (now + trouble.delay, next(self._order), identifier, data)
                heappush(self._late[from_drive], late)
                return False
            self._tell(Carried(now, identifier, data, from_drive, trouble is not None))
            return trouble is None

    def due(self, *, from_drive: bool) -> tuple[int, bytes] | None:
        """Next delayed frame of one direction that is due."""
        with self._lock:
            late = self._late[from_drive]
            if not late:
                return None
            now = self._clock()
            if late[0][0] > now:
                return None
            _, _, identifier, data = heappop(late)
            self._tell(Carried(now, identifier, data, from_drive))
            return identifier, data

    def _trouble_of(self, identifier: int) -> _Trouble | None:
        for trouble in self._troubles:
            if identifier in trouble.identifiers and self._random.random() < trouble.share:
                return trouble
        return None

    def _tell(self, carried: Carried) -> None:
        for tap in self.taps:
            tap(carried)


Interface = Literal["udp_multicast", "virtual"]

_GROUP = "239.74.163.2"
"""The default group of python-can."""
_BETWEEN_PROCESSES = 0.2
"""Least heartbeat period of a bench that is served to other processes, s: its drives run in a
program of normal priority, which may be suspended for up to 0.25 s."""
_PROBE = 0x7FF, b""
"""An empty frame with the lowest priority, which no CANopen device uses (CiA 301: 701h to 77Fh are
heartbeats)."""
_ROUTE = (
    "this machine has no route for multicast; add one with: ip route add 239.0.0.0/8 dev lo "
    "(as root), or keep to one process with the interface 'virtual'"
)


def wired(spec: BusSpec, name: str, interface: Interface) -> BusSpec:
    """Bus as the simulation opens it: a channel that no other simulation uses."""
    if interface == "virtual":
        return replace(
            spec,
            interface="virtual",
            channel=f"{name}-{os.getpid()}-{os.urandom(4).hex()}",
            port=None,
        )
    return replace(
        spec,
        interface="udp_multicast",
        channel=_GROUP,
        port=_free_udp_port(),
        heartbeat=max(spec.heartbeat, _BETWEEN_PROCESSES),
    )


class _AnyInterface:
    """Any interface of python-can."""

    def __init__(self, spec: BusSpec) -> None:
        options: dict[str, Any] = {"interface": spec.interface, "channel": spec.channel}
        if spec.interface != "virtual":
            options["bitrate"] = spec.bitrate
        self._bus = can.Bus(**options)
        self.close = self._bus.shutdown

    def send(self, identifier: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        message = self._bus.recv(timeout)
        if message is None or message.is_error_frame or message.is_extended_id:
            return None
        return message.arbitration_id, bytes(message.data)


class CanPort:
    """An open CAN bus behind a ``wire``; raises ConnectionLost."""

    def __init__(self, spec: BusSpec, wire: BusWire) -> None:
        self.wire = wire
        self.waited = 0.0
        """How long the last frame waited for being received, s; 0 without time stamps."""
        self._name = f"{spec.interface} channel '{spec.channel}'"
        try:
            if spec.interface == "udp_multicast":
                self._bus: MulticastPort | _AnyInterface = MulticastPort(
                    str(spec.channel), int(spec.port or 0)
                )
            else:
                self._bus = _AnyInterface(spec)
        except (can.CanError, OSError, ValueError, ImportError) as error:
            raise ConnectionLost(self._trouble(spec, error)) from error
        if spec.interface == "udp_multicast":
            self._try_sending(spec)

    def _try_sending(self, spec: BusSpec) -> None:
        try:
            self._bus.send(*_PROBE)
        except OSError as error:
            self._bus.close()
            raise ConnectionLost(self._trouble(spec, error)) from error

    def _trouble(self, spec: BusSpec, error: Exception) -> str:
        hint = f"; {_ROUTE}" if spec.interface == "udp_multicast" else ""
        return f"cannot open {self._name} for the simulated drives: {error}{hint}"

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame with an 11-bit identifier; raises ConnectionLost."""
        if self.wire.carry(identifier, data, from_drive=True):
            self._put(identifier, data)

    def _put(self, identifier: int, data: bytes) -> None:
        try:
            self._bus.send(identifier, data)
        except (can.CanError, OSError) as error:
            raise ConnectionLost(f"{self._name}: cannot send: {error}") from error

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Take the next frame, waiting at most ``timeout`` s; raises ConnectionLost."""
        while (late := self.wire.due(from_drive=True)) is not None:
            self._put(*late)
        self.waited = 0.0
        arrived = self.wire.due(from_drive=False)
        if arrived is not None:
            return arrived
        try:
            frame = self._bus.receive(timeout)
        except (can.CanError, OSError, ValueError) as error:
            raise ConnectionLost(f"{self._name}: cannot receive: {error}") from error
        if frame is None:
            return None
        if isinstance(self._bus, MulticastPort) and self._bus.arrived:
            self.waited = max(0.0, wall_clock() - self._bus.arrived)
        return frame if self.wire.carry(*frame, from_drive=False) else None

    def close(self) -> None:
        """Close the bus."""
        with suppress(can.CanError, OSError):
            self._bus.close()


def _free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])


TICK = 2e-3
"""Period at which the timers of simulated devices are evaluated, s."""


def serve(
    port: CanPort,
    clock: Callable[[], float],
    stopped: Callable[[], bool],
    *,
    deliver: Callable[[int, bytes, float], None],
    tick: Callable[[bool, float], None],
    late: Callable[[float], None],
) -> None:
    """Deliver frames when they arrive and tick every two milliseconds, until ``stopped``.

    A frame acts at the instant at which it arrived, however long it waited here for its turn: else
    a busy computer would change the motion. So ``deliver`` and ``tick`` take how long ago their
    instant was, s. ``tick`` takes besides whether no frame waits: before, a stall of this process
    would be taken for a loss of the master. ``late`` is called with each tick's lateness, s.
    """
    due = clock()
    while not stopped():
        frame = port.receive(max(0.0, due - clock()))
        waited = 0.0 if frame is None else port.waited
        received = clock()
        if frame is not None:
            deliver(*frame, waited)
        lateness = clock() - due
        if lateness >= 0:
            tick(frame is None, 0.0 if frame is None else waited + clock() - received)
            due = max(due + TICK, clock())
            late(lateness)

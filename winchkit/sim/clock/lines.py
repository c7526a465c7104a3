"""Lines in simulated time: a CAN bus with arbitration, and a serial line."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from heapq import heappop, heappush
from itertools import count
from typing import Any

from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.instruments.stream import SerialCable, SimulatedStreamInstrument
from winchkit.sim.live.buses import BusWire

_TICK = 2e-3
"""s, as of the line in real time."""
_TIMEOUT = 0.1
"""Time-out of a read, s."""


class SimulatedSerialLine(SerialCable):
    """One line with its instruments, reached at :attr:`port` through the clock."""

    def __init__(
        self,
        instruments: Sequence[SimulatedStreamInstrument],
        up_to_date: Callable[[], AbstractContextManager[None]],
        clock: SimulatedClock,
    ) -> None:
        self.port = f"simulated-{os.urandom(4).hex()}"
        super().__init__(instruments, up_to_date, clock.now)
        self._clock = clock
        self._end: _SerialEnd | None = None
        self._plugged, self._stopped = True, False

    def start(self) -> None:
        """Start serving."""
        self._clock.serve_serial(self.port, self._connect)
        self._tick()

    def stop(self) -> None:
        """Remove the port."""
        self._stopped = True
        self._unplug()

    def write(self, data: bytes) -> None:
        """Take bytes from the host."""
        self._send(data)

    def _connect(self) -> _SerialEnd:
        if not self._plugged:
            raise FileNotFoundError(2, "the simulated adapter is unplugged", self.port)
        self._end = _SerialEnd(self, self._clock)
        return self._end

    def _plug_in(self) -> None:
        self._plugged = True

    def _unplug(self) -> None:
        self._plugged = False
        if self._end is not None:
            self._end.close()
            self._end = None

    def _tick(self) -> None:
        if self._stopped:
            return
        self._obey_the_cable()
        self._send(b"")
        self._clock.call_at(self._clock.now() + _TICK, self._tick)

    def _send(self, received: bytes) -> None:
        said = self._serve(received)
        if said and self._end is not None:
            self._end.take(said)


class _SerialEnd:
    """The used part of the interface of ``serial.Serial``."""

    def __init__(self, line: SimulatedSerialLine, clock: SimulatedClock) -> None:
        self._line, self._arrived = line, clock.event()
        self._bytes = b""
        self._lost = False

    @property
    def in_waiting(self) -> int:
        """Number of bytes that have arrived."""
        return len(self._bytes)

    def read(self, size: int = 1) -> bytes:
        """At most ``size`` bytes, waiting a tenth of a second for the first; raises OSError."""
        if not self._bytes and not self._lost:
            self._arrived.clear()
            self._arrived.wait(_TIMEOUT)
        self._check()
        data, self._bytes = self._bytes[:size], self._bytes[size:]
        return data

    def write(self, data: bytes) -> int:
        """Send bytes; raises OSError."""
        self._check()
        self._line.write(data)
        return len(data)

    def close(self) -> None:
        """Close the port, or disconnect it as if the adapter were unplugged."""
        self._lost = True
        self._arrived.set()

    def take(self, data: bytes) -> None:
        """Take bytes that have arrived."""
        self._bytes += data
        self._arrived.set()

    def _check(self) -> None:
        if self._lost:
            raise OSError(5, "the simulated adapter is unplugged")


_FRAME_BITS = 47
"""Bits of a data frame of an 11-bit identifier without its data, interframe space included."""
_STUFFED_BITS = 34
"""Bits of these that are subject to bit stuffing."""
_STUFF_SHARE = 0.1
"""Share of stuff bits in typical data; at most 0.25."""
_ALL = range(0x800)


class SimulatedCanBus:
    """One bus: its devices at one side of ``wire``, any number of ports at the other."""

    def __init__(
        self,
        clock: SimulatedClock,
        wire: BusWire,
        bitrate: int,
        deliver: Callable[[int, bytes], None],
    ) -> None:
        self.ports: list[SimulatedCanPort] = []
        self.wire = wire
        self._clock, self._bitrate, self._deliver = clock, bitrate, deliver
        self._pending: list[tuple[int, int, bytes, SimulatedCanPort | None]] = []
        self._order = count()
        self._busy = False

    def connect(self) -> SimulatedCanPort:
        """A new port at the host's side."""
        port = SimulatedCanPort(self, self._clock)
        self.ports.append(port)
        return port

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame from a device."""
        self.transmit(identifier, data, None)

    def inject(self, identifier: int, data: bytes) -> None:
        """Send a frame of an unknown node at the host's side: host and devices receive it."""
        self.transmit(identifier, data, SimulatedCanPort(self, self._clock))

    def transmit(self, identifier: int, data: bytes, sender: SimulatedCanPort | None) -> None:
        """Queue a frame for arbitration; ``sender`` is the port, None a device."""
        heappush(self._pending, (identifier, next(self._order), data, sender))
        if not self._busy:
            self._begin()

    def tick(self) -> None:
        """Deliver the delayed frames that are due."""
        while (late := self.wire.due(from_drive=True)) is not None:
            self._to_ports(*late, None)
        while (late := self.wire.due(from_drive=False)) is not None:
            self._deliver(*late)

    def _begin(self) -> None:
        """Start the frame of the highest priority."""
        identifier, _, data, sender = heappop(self._pending)
        self._busy = True
        bits = _FRAME_BITS + 8 * len(data)
        bits += int(_STUFF_SHARE * (_STUFFED_BITS + 8 * len(data)))
        end = self._clock.now() + bits / self._bitrate
        self._clock.call_at(end, lambda: self._end(identifier, data, sender))

    def _end(self, identifier: int, data: bytes, sender: SimulatedCanPort | None) -> None:
        self._busy = False
        if self._pending:
            self._begin()
        through = self.wire.carry(identifier, data, from_drive=sender is None)
        if sender is not None:
            self._to_ports(identifier, data, sender)
        if not through:
            return
        if sender is None:
            self._to_ports(identifier, data, None)
        else:
            self._deliver(identifier, data)

    def _to_ports(self, identifier: int, data: bytes, sender: SimulatedCanPort | None) -> None:
        for port in self.ports:
            if port is not sender:
                port.take(identifier, data)


class SimulatedCanPort:
    """A port of the host, with the methods of a python-can bus that the canopen library needs."""

    def __init__(self, bus: SimulatedCanBus, clock: SimulatedClock) -> None:
        self._bus, self._clock = bus, clock
        self._received: deque[tuple[int, bytes]] = deque()
        self._arrived = clock.event()
        self.refusal: OSError | None = None
        """Error that sending and receiving raise, e.g. for a disconnected adapter."""

    def take(self, identifier: int, data: bytes) -> None:
        """Take a frame that has arrived."""
        self._received.append((identifier, data))
        self._arrived.set()

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Next frame, waiting at most ``timeout`` s; raises OSError."""
        if not self._received:
            self._arrived.clear()
            self._arrived.wait(timeout)
        self._check()
        return self._received.popleft() if self._received else None

    def transmit(self, identifier: int, data: bytes) -> None:
        """Send a frame; raises OSError."""
        self._check()
        self._bus.transmit(identifier, data, self)

    def send(self, message: Any, timeout: float | None = None) -> None:
        """Send a message of python-can; raises OSError."""
        if message.is_remote_frame:
            raise OSError("simulated drives are not guarded: their bus carries no remote frames")
        self.transmit(message.arbitration_id, bytes(message.data))

    def close(self) -> None:
        """Close the port."""
        if self in self._bus.ports:
            self._bus.ports.remove(self)
        self._arrived.set()

    def _check(self) -> None:
        if self.refusal is not None:
            raise self.refusal

"""A serial line in simulated time: instruments at one end, a port like pyserial's at the other."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager

from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.instruments.stream import SerialCable, SimulatedStreamInstrument

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

"""A serial port as the line sees it: bytes with the moment at which they came.

A thread reads, because that works for every port that pyserial knows on every system.
"""

from __future__ import annotations

import asyncio
from collections import deque
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, cast

from winchkit.drivers.clock import Clock
from winchkit.drivers.scheduling import Scheduler, event_of, thread_of
from winchkit.drivers.unplugged import UNPLUGGED
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec

if TYPE_CHECKING:
    import serial

_LATENCY_TIMERS = Path("/sys/bus/usb-serial/devices")
_HOST_LATENCY = 1e-3
"""Of a port without a timer of its own, s."""
_POLL = 0.1
"""The reading thread looks this often whether it is to end, s."""


class Chunk(NamedTuple):
    """Bytes, and when the last of them came (the bench's clock, s)."""

    data: bytes
    time: float


async def open_serial(spec: BusSpec, name: str, clock: Clock) -> SerialPort:
    """Open a port of the machine, or any URL of pyserial; raises ConnectionLost.

    It is opened on another thread: a network port that does not answer must not stop the others.
    """
    where = f"bus '{name}' ({spec.port})"
    opened = await asyncio.to_thread(_opened, spec, where, clock)
    return SerialPort(opened, str(spec.port), where, clock)


class SerialPort:
    """An open port of pyserial, read by a thread of its own."""

    def __init__(self, opened: serial.Serial, port: str, where: str, clock: Clock) -> None:
        """Begin to read; made within the loop that reads."""
        self.where = where
        self.latency, self.note = set_latency(port)
        """How late bytes may be handed over, s, and a remark on the port; empty without one."""
        self._serial = opened
        self._clock = clock
        self._loop = asyncio.get_running_loop()
        self._chunks: deque[Chunk] = deque()
        self._wanted: asyncio.Future[None] | None = None
        self._failure: Exception | None = None
        self._closing = event_of(clock)
        self._thread = thread_of(clock, self._receive, f"serial {port}")
        self._thread.start()

    async def read(self, until: float) -> Chunk | None:
        """Return the next bytes, None when there are none ``until`` then; raises ConnectionLost."""
        while not self._chunks:
            if self._failure is not None:
                raise ConnectionLost(
                    f"{self.where}: connection lost: {self._failure}; it is opened again by itself"
                )
            left = until - self._clock.now()
            if left <= 0.0:
                return None
            self._wanted = self._loop.create_future()
            alarm = self._loop.call_later(left, self._wake)
            try:
                await self._wanted
            finally:
                alarm.cancel()
                self._wanted = None
        return self._chunks.popleft()

    def write(self, data: bytes) -> None:
        """Send bytes; raises ConnectionLost."""
        try:
            self._serial.write(data)
        except UNPLUGGED as error:
            raise ConnectionLost(f"{self.where}: cannot send: {error}") from error

    def close(self) -> None:
        """Close the port."""
        self._closing.set()
        self._thread.join(timeout=3 * _POLL)
        self._serial.close()

    def _receive(self) -> None:
        """Read until closed or unplugged; on the thread of this port."""
        while not self._closing.is_set():
            try:
                data = self._serial.read(1)
                if data:
                    data += self._serial.read(self._serial.in_waiting)
            except UNPLUGGED as error:
                self._deliver(Chunk(b"", self._clock.now()), error)
                return
            if data:
                self._deliver(Chunk(data, self._clock.now()))

    def _deliver(self, chunk: Chunk, failure: Exception | None = None) -> None:
        if not self._closing.is_set() and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._arrived, chunk, failure)

    def _arrived(self, chunk: Chunk, failure: Exception | None) -> None:
        if failure is not None:
            self._failure = failure
        else:
            self._chunks.append(chunk)
        self._wake()

    def _wake(self) -> None:
        if self._wanted is not None and not self._wanted.done():
            self._wanted.set_result(None)


def _opened(spec: BusSpec, where: str, clock: Clock) -> serial.Serial:
    import serial

    try:
        if isinstance(clock, Scheduler) and (line := clock.serial_port(str(spec.port))):
            return cast("serial.Serial", line)
        return serial.serial_for_url(
            str(spec.port),
            baudrate=spec.baudrate,
            bytesize=spec.bytesize,
            parity=spec.parity,
            stopbits=spec.stopbits,
            timeout=_POLL,
            write_timeout=spec.timeout,
            exclusive=True,  # two readers of one port would share the bytes between them
        )
    except (OSError, ValueError) as error:
        raise ConnectionLost(
            f"{where}: cannot be opened: {error}; check the cable and the port's name, and that "
            "no other program has it open"
        ) from error


def set_latency(port: str, timers: Path = _LATENCY_TIMERS) -> tuple[float, str]:
    """Set an adapter's latency timer to 1 ms; the latency that holds now (s), and what to say.

    FTDI adapters wait 16 ms for more bytes before they hand over what came.
    """
    timer = timers / Path(port).resolve().name / "latency_timer"
    if not timer.is_file():
        return _HOST_LATENCY, ""
    try:
        timer.write_text("1")
    except OSError as error:
        advice = f"cannot be set ({error.strerror}); write 1 into it, e.g. by a udev rule"
    else:
        advice = "does not take 1"
    try:
        latency = int(timer.read_text()) * 1e-3
    except (OSError, ValueError) as error:
        return _HOST_LATENCY, f"{timer}: cannot be read: {error}"
    if latency <= _HOST_LATENCY:
        return latency, ""
    return latency, f"{timer} {advice}: bytes are handed over {latency * 1e3:g} ms late"

"""A serial line in simulated time: the simulated instrument, a wire that spoils bytes, our line."""

from __future__ import annotations

import asyncio
import weakref
from collections.abc import Callable
from dataclasses import replace
from functools import cache

from winchkit.catalog import find
from winchkit.drivers.reading import InstrumentReading
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.drivers.stream.line import StreamLine
from winchkit.drivers.stream.port import Chunk
from winchkit.errors import ConnectionLost, WinchkitError
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.stream import StreamSpec
from winchkit.schema.read import read_device
from winchkit.sim.instruments.stream import SimulatedStreamInstrument as SimInstrument
from winchkit.sim.instruments.stream import shown_by

DEVICES = (
    "laumas-tlb-ascii",
    "mantracourt-dsc-ascii",
    "hbm-aed-ascii",
    "hbm-aed-binary",
    "flintec-ldu",
    "and-ad-4406",
    "mettler-mt-sics",
    "sartorius-sbi",
    "hx711-line",
    "generic-line",
    "toledo-continuous",
)
TIMEOUT = 0.2


def device(name: str, **changes: object) -> DeviceSpec:
    """A shipped device, some keys of its [stream] changed."""
    found = _shipped(name)
    assert found.stream is not None
    return replace(found, stream=replace(found.stream, **changes))  # type: ignore[arg-type]


@cache
def _shipped(name: str) -> DeviceSpec:
    return read_device(find("devices", name))


def stream(name: str) -> StreamSpec:
    found = device(name).stream
    assert found is not None
    return found


class Time:
    """A clock that moves when it is set."""

    def __init__(self) -> None:
        self.time = 100.0

    def now(self) -> float:
        return self.time

    def sleep(self, duration: float) -> None:
        self.time += max(0.0, duration)


class SimPort:
    """A port whose other end is simulated; reading moves the clock."""

    latency = 0.0
    note = ""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.open = True

    async def read(self, until: float) -> Chunk | None:
        await asyncio.sleep(0)
        rig = self.rig
        while True:
            if not rig.plugged or not self.open:
                self.open = False
                raise ConnectionLost("unplugged")
            data = rig.output()
            if data:
                return Chunk(data, rig.clock.time)
            if rig.clock.time >= until:
                return None
            rig.step(until)

    def write(self, data: bytes) -> None:
        if not self.rig.plugged:
            raise ConnectionLost("unplugged")
        self.rig.sent.append(data)
        if self.rig.echo:
            self.rig.echoed += data
        for one in self.rig.simulated:
            one.receive(data, self.rig.clock.time)

    def close(self) -> None:
        self.open = False


class Rig:
    """Our line at one end, simulated instruments at the other, no real time.

    ``truth`` gives what is measured (SI) at a time; ``wire`` may spoil what comes.
    """

    def __init__(
        self,
        *devices: DeviceSpec,
        truth: Callable[[float], float] = lambda _: 12.0,
        wire: Callable[[bytes], bytes] = lambda data: data,
        addresses: tuple[int | None, ...] = (1, 2, 3),
    ) -> None:
        self.clock = Time()
        self.truth, self.wire = truth, wire
        self.plugged = True
        self.echo = False
        self.echoed = b""
        self.sent: list[bytes] = []
        self.events: list[tuple[float, Callable[[], None]]] = []
        self.end = self.clock.time
        self.loop = asyncio.new_event_loop()
        weakref.finalize(self, self.loop.close)
        self.simulated = [
            self._simulated(one, address) for one, address in zip(devices, addresses, strict=False)
        ]
        self.instruments = tuple(
            StreamInstrument(one.name, one, address, self.clock, rate=100.0, timeout=TIMEOUT)
            for one, address in zip(devices, addresses, strict=False)
        )
        self.readings: list[InstrumentReading] = []
        self.instrument.listeners.append(self.readings.append)
        spec = BusSpec("serial", port="simulated", timeout=TIMEOUT)
        self.line = StreamLine(
            "cells", spec, self.instruments, self.clock, opener=self._opened, pause=self._pause
        )

    @property
    def instrument(self) -> StreamInstrument:
        return self.instruments[0]

    @property
    def sim(self) -> SimInstrument:
        return self.simulated[0]

    def _simulated(self, one: DeviceSpec, address: int | None) -> SimInstrument:
        spec = one.stream
        assert spec is not None
        measure = shown_by(spec, lambda: self.truth(self.clock.time))
        return SimInstrument(spec, measure, now=self.clock.time, address=address)

    async def _opened(self, *_: object) -> SimPort:
        if not self.plugged:
            raise ConnectionLost("there is no such port")
        return SimPort(self)

    async def _pause(self, duration: float) -> None:
        end = self.clock.time + duration
        while self.clock.time < end:
            self.step(end)
        await asyncio.sleep(0)

    def output(self) -> bytes:
        """What is on the line now."""
        data = b"".join(one.take_output(self.clock.time) for one in self.simulated)
        data, self.echoed = self.echoed + data, b""
        return self.wire(data) if data else b""

    def step(self, until: float) -> None:
        """Move to the next conversion, or to ``until``, and do what is due."""
        due = min(one.next_conversion for one in self.simulated)
        # A late answer is on its way between two conversions.
        self.clock.time = min(until, max(self.clock.time, due), self.clock.time + 1e-3)
        for one in self.simulated:
            while one.next_conversion <= self.clock.time:
                one.convert()
            one.show(self.clock.time)
        while self.events and self.events[0][0] <= self.clock.time:
            self.events.pop(0)[1]()
        if not self.plugged:
            for one in self.simulated:
                one.take_output(self.clock.time)
        if self.clock.time >= self.end:
            self.line._closing = True

    def at(self, after: float, action: Callable[[], None]) -> None:
        """Do something so many seconds after now."""
        self.events.append((self.clock.time + after, action))
        self.events.sort(key=lambda event: event[0])

    def run(self, duration: float) -> list[InstrumentReading]:
        """Serve for a time; the readings of the first instrument in it."""
        first = len(self.readings)
        self.end = self.clock.time + duration
        self.line._closing = False
        self.loop.run_until_complete(self.line.serve())
        return self.readings[first:]

    def command(self, name: str, serve: float = 3.0) -> None:
        """Send a command while the line is served; raises what it raises."""

        async def both() -> WinchkitError | None:
            self.end = self.clock.time + serve
            self.line._closing = False
            serving = asyncio.create_task(self.line.serve())
            await asyncio.sleep(0)
            failure = None
            try:
                await self.line.command(self.instrument, name)
            except WinchkitError as error:
                failure = error
            await serving
            return failure

        failure = self.loop.run_until_complete(both())
        if failure is not None:
            raise failure

"""The bench's side of the instrument process: starts it, takes its messages, sends requests.

What a device says is judged here: calibration, tare and the test for frozen counts stay in the
bench, and only the lines are in the other process. When that process ends or stands still, no
reading comes, and the supervisor trips by the age of the last one; ``trouble`` names the reason.
"""

from __future__ import annotations

import asyncio
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass
from math import inf
from typing import Any

from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.instrument_process.messages import (
    COUNTS,
    InstrumentState,
    Kind,
    MessageCutter,
    json_message,
    message,
    raw_reading_of,
)
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.publisher import InstrumentReadings
from winchkit.drivers.reading import Sensor
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.drivers.stream.line import StreamLine
from winchkit.errors import ConnectionLost, WinchkitError, error_of
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.device import DeviceSpec

_LOOK = 0.1
"""Between two looks at whether the process still responds to a request, s."""
_TIMEOUT = 1.0
"""A process may be silent for so long before a request to it is given up, s."""
_SILENCE = 0.1
"""The process sends at least every 0.04 s: one that was silent for longer does not respond, s."""


class SeparateInstrument(InstrumentReadings):
    """An instrument whose line another process serves."""

    def __init__(
        self, made: Instrument | StreamInstrument, serving: InstrumentProcess, clock: Clock
    ) -> None:
        """Take over name, publisher and period of one that was ``made`` here for that."""
        self.name = made.name
        self.period = made.period
        self.max_age = made.max_age
        """A reading older than this is stale, s."""
        self.publisher = made.publisher
        self.tared: bool | None = made.tared
        """Whether the device says that it shows a net value; None where it does not say."""
        self.may_store = False
        """Whether commands that write the device's EEPROM are let through."""
        self._clock = clock
        self._serving = serving
        self._problem: ConnectionLost | None = None

    @property
    def problem(self) -> ConnectionLost | None:
        """Why there is no new reading, while there is none."""
        # Before the reading is stale, so that the trip has its reason.
        return self._serving.trouble(min(_SILENCE, self.max_age / 2)) or self._problem

    def show(self, state: InstrumentState) -> None:
        """Take what it shows beside its readings."""
        error = None if state.problem is None else error_of(*state.problem)
        self._problem = error if isinstance(error, ConnectionLost) else None
        self.tared, self.period, self.max_age = state.tared, state.period, state.max_age
        for name, count in zip(COUNTS, state.counts, strict=True):
            setattr(self.publisher.tally, name, count)


class SeparateLine:
    """A line of :class:`~winchkit.drivers.slow.SlowDevices` that another process serves."""

    def __init__(
        self,
        name: str,
        instruments: tuple[SeparateInstrument, ...],
        serving: InstrumentProcess,
        number: int,
    ) -> None:
        """``number`` is that of the line among those of the process."""
        self.name = name
        self.sensors: Sequence[Sensor] = instruments
        self._serving = serving
        self._number = number

    async def serve(self) -> None:
        """Wait until cancelled: what comes is received on a thread of its own."""
        await asyncio.get_running_loop().create_future()

    async def command(self, sensor: Sensor, name: str) -> None:
        """Send a command of the device file, and wait for the device's answer."""
        may_store = isinstance(sensor, SeparateInstrument) and sensor.may_store
        await self._answer(sensor, "command", name, may_store)

    async def identify(self, sensor: Sensor) -> dict[str, float]:
        """Ask one of its instruments for its serial number and the like."""
        found: dict[str, float] = await self._answer(sensor, "identify")
        return found

    def room_for(self, sensor: Sensor) -> float:
        """Rate that the line has room for, whatever rate the instrument wants, 1/s."""
        return float(self._ask(sensor, "room_for"))

    def time_of(self, sensor: Sensor) -> float:
        """How long a reading of an instrument keeps the line busy, s."""
        return float(self._ask(sensor, "time_of"))

    @property
    def note(self) -> str:
        """Remark on the port, e.g. on its adapter; empty where there is none."""
        return str(self._ask(self.sensors[0], "note"))

    def close(self) -> None:
        """The process closes the line at its end."""

    async def _answer(self, sensor: Sensor, operation: str, *given: Any) -> Any:
        """The answer to a request; raises what was raised there, or why there is none."""
        answer = asyncio.wrap_future(self._request(sensor, operation, *given))
        try:
            while not answer.done():
                await asyncio.wait((answer,), timeout=_LOOK)
                self._require_life(answered=answer.done())
            return answer.result()
        finally:
            answer.cancel()

    def _ask(self, sensor: Sensor, operation: str) -> Any:
        """The answer to a question about the line; raises why there is none."""
        answer = self._request(sensor, operation)
        while not answer.done():
            wait((answer,), timeout=_LOOK)
            self._require_life(answered=answer.done())
        return answer.result()

    def _require_life(self, *, answered: bool) -> None:
        """Raise why an answer that is outstanding cannot come."""
        trouble = None if answered else self._serving.trouble(_TIMEOUT)
        if trouble is not None:
            raise trouble

    def _request(self, sensor: Sensor, operation: str, *given: Any) -> Future[Any]:
        number = next(k for k, item in enumerate(self.sensors) if item is sensor)
        return self._serving.request((self._number, number), operation, *given)


Line = ModbusLine | StreamLine


@dataclass(frozen=True)
class LineInstrument:
    """An instrument on a line."""

    label: str
    """Name in messages."""
    device: DeviceSpec
    unit: int | None
    """Address on the line, None where the line needs none."""
    rate: float | None
    """Most readings a second that are wanted; None for those of the device."""


@dataclass(frozen=True)
class ProcessLineSpec:
    """A Modbus or serial line and its instruments."""

    bus: str
    """Name of the bus."""
    spec: BusSpec
    instruments: tuple[LineInstrument, ...]


def line_of(line: ProcessLineSpec, clock: Clock) -> Line:
    """Make a line with its instruments, not opened yet; raises FileError for a wrong device."""
    bus = line.spec
    if bus.kind == "serial":
        streams = tuple(
            StreamInstrument(
                one.label, one.device, one.unit, clock, timeout=bus.timeout, rate=one.rate or inf
            )
            for one in line.instruments
        )
        return StreamLine(line.bus, bus, streams, clock)
    registers = tuple(
        Instrument(
            one.label, one.device, one.unit or 1, clock, timeout=bus.timeout, rate=one.rate or inf
        )
        for one in line.instruments
    )
    return ModbusLine(line.bus, bus, registers, clock)


_MODULE = "winchkit.drivers.instrument_process.child"
_CHUNK = 1 << 16
"""Bytes: capacity of a pipe on Linux."""
_START = 30.0
"""The interpreter and its imports take 1 s, on a computer under load several times as long, s."""
_END = 5.0
"""It closes its lines within 4 s, s."""
_STOPPED = 1.0
"""A process that was silent for so long is not waited for at the end, s."""


class InstrumentProcess:
    """Lines that another process serves; with the machine's clock only."""

    def __init__(self, clock: MonotonicClock) -> None:
        """Take lines by :meth:`adopt`, then :meth:`start`."""
        self._clock = clock
        self._specs: list[ProcessLineSpec] = []
        self._instruments: list[SeparateInstrument] = []
        self._process: subprocess.Popen[bytes] | None = None
        self._reader: threading.Thread | None = None
        self._lock = threading.Lock()
        self._waiting: dict[int, Future[Any]] = {}
        self._count = 0
        self._heard = clock.now()
        self._started = threading.Event()
        self._ended: ConnectionLost | None = None
        self._silent = ConnectionLost("")
        self._failure: WinchkitError | None = None

    @property
    def pid(self) -> int | None:
        """Number of the process; None before its start, or where there is no line to serve."""
        return None if self._process is None else self._process.pid

    def adopt(self, spec: ProcessLineSpec, line: Line) -> SeparateLine:
        """Serve a line that was made here; returns it as the bench sees it, same publishers."""
        instruments = tuple(SeparateInstrument(item, self, self._clock) for item in line.sensors)
        found = SeparateLine(spec.bus, instruments, self, len(self._specs))
        self._specs.append(spec)
        self._instruments += instruments
        return found

    def start(self) -> None:
        """Start the process, where it has a line; raises ConnectionLost where it cannot be."""
        if not self._specs:
            return
        command = [sys.executable, "-P", "-m", _MODULE]
        try:
            # A session of its own: what ends the bench from a terminal lets it ramp down first.
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                bufsize=0,
                start_new_session=True,
            )
        except OSError as error:
            raise ConnectionLost(
                f"the instrument process cannot be started: {' '.join(command)}: {error}; "
                "open_bench(..., realtime=False) reads the instruments without it"
            ) from error
        self._silent = ConnectionLost(
            f"{self._name} does not respond: it should send something every 0.04 s; "
            "close the bench and open it again"
        )
        self._reader = threading.Thread(target=self._receive, name="instruments", daemon=True)
        self._reader.start()
        self._send(message(Kind.REQUEST, pickle.dumps(tuple(self._specs))))

    def await_start(self) -> None:
        """Return when the lines are being served; raises what kept the process from it."""
        if self._process is None:
            return
        if not self._started.wait(_START):
            raise ConnectionLost(f"{self._name} did not start within {_START:g} s")
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise failure
        if self._ended is not None:
            raise self._ended

    def trouble(self, silence: float) -> ConnectionLost | None:
        """Why nothing can come: it has ended, or has sent nothing for more than ``silence`` s."""
        if self._ended is not None:
            return self._ended
        if self._clock.now() - self._heard <= silence or not self._started.is_set():
            return None
        return self._silent

    def request(self, place: tuple[int, int], operation: str, *given: Any) -> Future[Any]:
        """Ask the instrument at ``place`` (line, number on it); the future has the answer."""
        future: Future[Any] = Future()
        with self._lock:
            self._count += 1
            number, ended = self._count, self._ended
            if ended is None:
                self._waiting[number] = future
        if ended is not None:
            future.set_exception(ended)
            return future
        content = (number, place, operation, *given)
        self._send(json_message(Kind.REQUEST, content))
        return future

    def close(self) -> None:
        """End the process; raises what ended its serving before, if anything."""
        process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin is not None, "it is a pipe"
        assert process.stdout is not None, "it is a pipe"
        stopped = self._clock.now() - self._heard > _STOPPED
        with suppress(OSError):
            process.stdin.close()
        try:
            process.wait(0.0 if stopped else _END)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._reader is not None:
            self._reader.join(_END)
        process.stdout.close()
        if self._failure is not None:
            raise self._failure

    @property
    def _name(self) -> str:
        return f"the instrument process (number {self.pid})"

    def _send(self, data: bytes) -> None:
        process = self._process
        if process is None or process.stdin is None:
            return
        with self._lock, suppress(OSError):  # it has ended: the reader says so
            while data:
                data = data[process.stdin.write(data) or 0 :]

    def _receive(self) -> None:
        """Take what the process sends until it ends."""
        process, messages = self._process, MessageCutter()
        assert process is not None, "it was started"
        assert process.stdout is not None, "it is a pipe"
        name = self._name
        while data := os.read(process.stdout.fileno(), _CHUNK):
            self._heard = self._clock.now()
            for kind, content in messages.feed(data):
                self._take(kind, content)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END)
        self._ended = ConnectionLost(
            f"{name} has ended ({_end_of(process.returncode)}): no instrument on a Modbus or "
            "serial line is read; close the bench and open it again"
        )
        self._started.set()
        with self._lock:
            waiting, self._waiting = self._waiting, {}
        for future in waiting.values():
            _settle(future, self._ended)

    def _take(self, kind: Kind, content: bytes) -> None:
        if kind is Kind.READING:
            said = raw_reading_of(content)
            self._instruments[said.instrument].publisher.publish(*said[1:])
        elif kind is Kind.STATE:
            number, *state = json.loads(content)
            self._instruments[number].show(InstrumentState(*state))
        elif kind is Kind.REPLY:
            number, value, words = json.loads(content)
            with self._lock:
                future = self._waiting.pop(number, None)
            if future is not None:
                _settle(future, error_of(*words) if words else None, value)
        elif kind is Kind.FAILURE:
            self._failure = error_of(*json.loads(content))
        elif kind is Kind.READY:
            self._started.set()


def _settle(future: Future[Any], error: WinchkitError | None, value: Any = None) -> None:
    """Give a future its result, unless whoever waited has gone."""
    if not future.set_running_or_notify_cancel():
        return
    if error is not None:
        future.set_exception(error)
    else:
        future.set_result(value)


def _end_of(code: int | None) -> str:
    """How a process ended, in words."""
    if code is None:
        return "it closed its pipe"
    if code < 0:
        return f"signal {signal.Signals(-code).name}"
    return f"exit code {code}"

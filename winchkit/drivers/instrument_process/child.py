"""The instrument process: serves lines for the process that started it, and ends with it.

``python -m winchkit.drivers.instrument_process.child``, started by
:class:`~winchkit.drivers.instrument_process.process.InstrumentProcess`. The declarations of the
lines and then requests come on stdin, readings and answers go to stdout. The end of stdin ends it.
"""

from __future__ import annotations

import asyncio
import json
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any, NoReturn

from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.instrument_process.messages import (
    COUNTS,
    InstrumentState,
    Kind,
    MessageCutter,
    RawReading,
    json_message,
    message,
    reading_message,
)
from winchkit.drivers.instrument_process.process import Line, line_of
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.publisher import Publisher, Sampled
from winchkit.drivers.reading import InstrumentReading, Quality, Sensor
from winchkit.drivers.slow import SlowDevices
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.errors import ConnectionLost, WinchkitError, class_name

_BATCH = 1e-3
"""Readings that come within it are sent together, s: it adds to their age, and each message wakes a
thread beside the control loop."""
_TICK = 0.02
"""Between two reports of what has changed beside the readings, s; a message goes out at least every
second time, so that a silent process is known within a fraction of the age limit of a reading."""
_CHUNK = 1 << 16
"""Bytes: capacity of a pipe on Linux."""
_END = 4.0
"""Closing the lines takes at most so long, s; then the process ends all the same."""


class _Outbox:
    """Messages to the bench, in their order; for the thread of the lines."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._waiting: list[bytes] = []
        self._sent = True
        """Whether anything was sent since the last tick."""

    def add(self, data: bytes) -> None:
        """Send a message within ``_BATCH``."""
        if not self._waiting:
            asyncio.get_running_loop().call_later(_BATCH, self.flush)
        self._waiting.append(data)

    def flush(self) -> None:
        """Send what waits."""
        data, self._waiting = b"".join(self._waiting), []
        self._sent = True
        while data:
            try:
                data = data[os.write(self._descriptor, data) :]
            except OSError:
                return  # the bench has ended, and stdin with it

    def tick(self) -> None:
        """Say that the process runs, where nothing else was sent."""
        if not self._sent and not self._waiting:
            self.add(message(Kind.ALIVE))
        self._sent = False


class _Forwarding(Publisher):
    """Forwards the raw data of a device; the bench evaluates them."""

    def __init__(self, rate: float, forward: Callable[..., None]) -> None:
        super().__init__(rate)
        self._forward = forward

    def publish(
        self, value: float, gross: float, counts: float, quality: Quality, when: Sampled
    ) -> InstrumentReading:
        """Send it, and keep a reading for the line's own use."""
        self._forward(value, gross, counts, quality, when)
        return super().publish(value, gross, counts, quality, when)


class _Reporter:
    """Reports what the instruments show; a line without instruments, beside the others."""

    name = "reporter"
    sensors: Sequence[Sensor] = ()

    def __init__(self, instruments: Sequence[Instrument | StreamInstrument], out: _Outbox) -> None:
        self._instruments, self._out = instruments, out
        self._serving = threading.Event()
        self._loop: asyncio.AbstractEventLoop
        self._known: list[InstrumentState | None] = [None] * len(instruments)
        self._bench = os.getppid()
        for number, instrument in enumerate(instruments):
            instrument.publisher = _Forwarding(
                instrument.publisher.rate, self._forwarding(number, instrument)
            )

    async def serve(self) -> None:
        """Report what has changed, and that the process runs."""
        self._loop = asyncio.get_running_loop()
        self._serving.set()
        self._out.add(message(Kind.READY))
        while True:
            self.report()
            self._out.tick()
            if os.getppid() != self._bench:
                os._exit(1)  # the bench has ended, though another process holds its pipe
            await asyncio.sleep(_TICK)

    async def command(self, sensor: Sensor, name: str) -> None:
        """There is no instrument to command."""
        raise NotImplementedError

    def close(self) -> None:
        """Nothing is open."""

    def report(self) -> None:
        """Send what has changed beside the readings."""
        for number, instrument in enumerate(self._instruments):
            self._state(number, instrument)

    def reply(self, content: Sequence[Any]) -> None:
        """Send the answer to a request after all that came before it; on any thread."""
        self._serving.wait()
        self._loop.call_soon_threadsafe(self._reply, content)

    def _reply(self, content: Sequence[Any]) -> None:
        self.report()
        self._out.add(json_message(Kind.REPLY, content))

    def _forwarding(
        self, number: int, instrument: Instrument | StreamInstrument
    ) -> Callable[..., None]:
        def forward(*said: Any) -> None:
            self._state(number, instrument)
            self._out.add(reading_message(RawReading(number, *said)))

        return forward

    def _state(self, number: int, instrument: Instrument | StreamInstrument) -> None:
        problem = instrument.problem
        state = InstrumentState(
            None if problem is None else _words(problem),
            instrument.tared,
            instrument.period,
            instrument.max_age,
            tuple(getattr(instrument.tally, name) for name in COUNTS),
        )
        if state == self._known[number]:
            return
        self._known[number] = state
        self._out.add(json_message(Kind.STATE, (number, *state)))


def main() -> NoReturn:
    """Serve the lines that stdin declares until its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal: the bench ends first
    out, requests = os.dup(sys.stdout.fileno()), _requests(sys.stdin.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    outbox = _Outbox(out)
    try:
        _serve(requests, outbox)
    except Exception as error:  # noqa: BLE001  whatever it is, the bench reports it
        with suppress(OSError):
            os.write(out, json_message(Kind.FAILURE, _words(error)))
        os._exit(1)
    os._exit(0)


def _serve(requests: Iterator[bytes], outbox: _Outbox) -> None:
    clock, declared = MonotonicClock(), next(requests, None)
    if declared is None:
        return
    # By the process that has started this one.
    lines = tuple(line_of(one, clock) for one in pickle.loads(declared))
    reporter = _Reporter([item for line in lines for item in line.sensors], outbox)
    slow = SlowDevices((*lines, reporter), clock)
    desk = _RequestHandler(slow, lines, reporter)
    for content in requests:
        # One thread each, as every caller in the bench has one.
        threading.Thread(target=desk.answer, args=json.loads(content), daemon=True).start()
    threading.Thread(target=_end_at_the_latest, daemon=True).start()
    slow.close()


def _requests(descriptor: int) -> Iterator[bytes]:
    """Contents of the messages from the bench, until it closes the pipe."""
    messages = MessageCutter()
    while data := os.read(descriptor, _CHUNK):
        for _, content in messages.feed(data):
            yield content


class _RequestHandler:
    """Answers requests."""

    def __init__(self, slow: SlowDevices, lines: Sequence[Line], reporter: _Reporter) -> None:
        self._slow, self._lines, self._reporter = slow, lines, reporter

    def answer(self, number: int, place: tuple[int, int], operation: str, *given: Any) -> None:
        """Execute a request and send the result; ``place`` are line and instrument."""
        line = self._lines[place[0]]
        try:
            value = self._done(line, line.sensors[place[1]], operation, *given)
        except Exception as error:  # noqa: BLE001  the bench raises it
            self._reporter.reply((number, None, _words(error)))
        else:
            self._reporter.reply((number, value, None))

    def _done(
        self, line: Line, sensor: Instrument | StreamInstrument, operation: str, *given: Any
    ) -> Any:
        if operation == "identify":
            return self._slow.identify(sensor)
        if operation == "room_for":
            return line.room_for(sensor)
        if operation == "time_of":
            return line.time_of(sensor)
        if operation == "note":
            return line.note
        name, may_store = given
        if not isinstance(sensor, Instrument) or not may_store:
            return self._slow.command(sensor, name)
        sensor.may_store = True
        try:
            return self._slow.command(sensor, name)
        finally:
            sensor.may_store = False


def _end_at_the_latest() -> None:
    time.sleep(_END)
    os._exit(1)


def _words(error: Exception) -> tuple[str, str]:
    """Class and message of an error."""
    if isinstance(error, WinchkitError):
        return class_name(error), str(error)
    kind = ConnectionLost if isinstance(error, OSError) else WinchkitError
    return kind.__name__, f"{type(error).__name__}: {error}"


if __name__ == "__main__":
    main()

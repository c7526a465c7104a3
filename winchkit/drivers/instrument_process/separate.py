"""Lines and instruments of another process as the bench sees them."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from concurrent.futures import Future, wait
from typing import Any, Protocol

from winchkit.drivers.clock import Clock
from winchkit.drivers.instrument_process.messages import COUNTS, InstrumentState
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.publisher import InstrumentReadings
from winchkit.drivers.reading import Sensor
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.errors import ConnectionLost, error_of

_LOOK = 0.1
"""Between two looks at whether the process still responds to a request, s."""
_TIMEOUT = 1.0
"""A process may be silent for so long before a request to it is given up, s."""
_SILENCE = 0.1
"""The process sends at least every 0.04 s: one that was silent for longer does not respond, s."""


class Serving(Protocol):
    """What serves the lines."""

    def trouble(self, silence: float) -> ConnectionLost | None:
        """Why nothing can come: it has ended, or has sent nothing for more than ``silence`` s."""

    def request(self, place: tuple[int, int], operation: str, *given: Any) -> Future[Any]:
        """Ask the instrument at ``place`` (line, number on it); the future has the answer."""


class SeparateInstrument(InstrumentReadings):
    """An instrument whose line another process serves."""

    def __init__(self, made: Instrument | StreamInstrument, serving: Serving, clock: Clock) -> None:
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
        self, name: str, instruments: tuple[SeparateInstrument, ...], serving: Serving, number: int
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

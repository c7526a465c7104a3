"""One serial line: polls its instruments in turn, or listens to the one that sends by itself."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.drivers.sharing import RECONNECT, RETRY, LineShare, SharedLine, next_of
from winchkit.drivers.stream.conversation import Conversation, exchange_time
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.drivers.stream.port import SerialPort, open_serial
from winchkit.errors import ConnectionLost, DeviceRefused, FileError, NoReply
from winchkit.schema.bench import BusSpec

_LISTEN = 0.05
"""A command waits at most this long for a line that listens, s."""

Opener = Callable[[BusSpec, str, Clock], Awaitable[SerialPort]]


class StreamLine(SharedLine):
    """A line of :class:`~winchkit.drivers.slow.SlowDevices`."""

    def __init__(
        self,
        name: str,
        spec: BusSpec,
        instruments: tuple[StreamInstrument, ...],
        clock: Clock,
        *,
        opener: Opener = open_serial,
        pause: Callable[[float], Awaitable[None]] = asyncio.sleep,
    ) -> None:
        """Take the instruments of a line; ``pause`` waits while there is no port."""
        self.name = name
        self.sensors: tuple[StreamInstrument, ...] = instruments
        self._spec = spec
        self._clock = clock
        self._opener = opener
        self._pause = pause
        self._lock = asyncio.Lock()
        self._closing = False
        self._talk: Conversation | None = None
        self._heard_at = clock.now()
        self._share = LineShare(
            [one.wanted_rate for one in instruments],
            [exchange_time(one, spec) for one in instruments],
        )
        talkers = [one for one in instruments if one.spec.mode == "continuous"]
        if talkers and len(instruments) > 1:
            raise FileError(
                f"bus '{name}': {talkers[0].name} sends by itself and must be alone on its line, "
                f"which has {len(instruments)} devices; give it a line of its own"
            )
        self._share_out()

    @property
    def note(self) -> str:
        """Remark on the port, e.g. on its adapter; empty where there is none."""
        return self._talk.port.note if self._talk else ""

    def _share_out(self) -> None:
        """Give every polled instrument the rate that is to be expected."""
        for one, rate in zip(self.sensors, self._share.rates, strict=True):
            if one.spec.mode == "polled":
                one.on_line(1.0 / rate)

    async def serve(self) -> None:
        """Keep the readings new until closed."""
        while not self._closing:
            talk = self._talk or await self._open()
            if talk is None:
                await self._pause(RECONNECT)
                continue
            try:
                if self.sensors[0].spec.mode == "continuous":
                    await self._listen(talk, self.sensors[0])
                else:
                    now = self._clock.now()
                    await self._poll(talk, next_of(self.sensors, now, lambda one: one.due))
            except ConnectionLost as error:
                self._lost(error)
                await self._pause(RECONNECT)

    async def command(self, sensor: Sensor, name: str) -> None:
        """Send a command to one of its instruments between two readings."""
        instrument = next(item for item in self.sensors if item is sensor)
        async with self._lock:
            if self._talk is None:
                raise instrument.problem or ConnectionLost(
                    f"bus '{self.name}' ({self._spec.port}): the line is closed; try again"
                )
            await self._talk.command(instrument, name)

    def close(self) -> None:
        """Close the line and read no more."""
        self._closing = True
        if self._talk is not None:
            self._talk.close(self.sensors)
            self._talk = None

    async def _open(self) -> Conversation | None:
        try:
            port = await self._opener(self._spec, self.name, self._clock)
        except ConnectionLost as error:
            for instrument in self.sensors:
                instrument.problem = error
            return None
        if self._closing:
            port.close()
            return None
        self._heard_at = self._clock.now()
        for instrument in self.sensors:
            instrument.started = False
        self._talk = Conversation(port, self._spec, self.name, self._clock)
        return self._talk

    def _lost(self, error: ConnectionLost) -> None:
        for instrument in self.sensors:
            instrument.problem = error
            instrument.publisher.tally.reconnects += 1
        if self._talk is not None:
            self._talk.close()
            self._talk = None

    async def _poll(self, talk: Conversation, instrument: StreamInstrument) -> None:
        """Take one reading of an instrument when it is due."""
        async with self._lock:
            now = self._clock.now()
            if now < instrument.due:
                if await talk.idle(min(instrument.due, now + _LISTEN), instrument):
                    instrument.overheard()
                return
            instrument.asked = start = self._clock.now()
            instrument.due = max(instrument.due + 1 / instrument.wanted_rate, start)
            before = instrument.publisher.tally.readings
            try:
                await talk.poll(instrument)
            except DeviceRefused as error:
                instrument.refused(error)
            except NoReply as error:
                instrument.failed(error, timeout=talk.was_silent)
                if talk.came_late:
                    instrument.overheard()
            if instrument.publisher.tally.readings > before:
                took = self._clock.now() - start
                if self._share.took(self._place(instrument), took):
                    self._share_out()

    async def _listen(self, talk: Conversation, instrument: StreamInstrument) -> None:
        """Receive what the instrument sends in the next moments."""
        async with self._lock:
            try:
                if not instrument.started:
                    await talk.start(instrument)
                    self._heard_at = self._clock.now()
                if await talk.receive(instrument, self._clock.now() + _LISTEN):
                    self._heard_at = self._clock.now()
                elif self._clock.now() - self._heard_at > instrument.max_age:
                    self._heard_at = self._clock.now()
                    raise talk.silent(instrument)
            except DeviceRefused as error:
                instrument.refused(error)
                await talk.idle(self._clock.now() + RETRY, instrument)
            except NoReply as error:
                instrument.failed(error, timeout=True)
                instrument.started = False

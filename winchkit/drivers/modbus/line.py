"""One Modbus line: polls its instruments in turn, the one that is due first."""

from __future__ import annotations

import asyncio

from winchkit.drivers.clock import Clock
from winchkit.drivers.device_command import confirm, permitted_command
from winchkit.drivers.modbus.client import ModbusClient
from winchkit.drivers.modbus.decoder import number_of, words_of
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.timing import exchange, silence_of, wire_times
from winchkit.drivers.reading import Sensor
from winchkit.drivers.sharing import RECONNECT, LineShare, SharedLine, next_of
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.modbus import REGISTERS, CommandSpec, ReadBlock

_OPENING, _POLL = 1.0, 0.01
"""s that a command waits for a line that is being opened, a few attempts to connect; and between
two looks."""
_LEAST = {"modbus-rtu": 1e-4, "modbus-tcp": 1e-3}
"""What a reading is reckoned with at least, s: over TCP no line is in the way, but this process
has a control loop to run."""
_PROBE_SHARE = 4
"""A silent device costs the line a timeout: for each there are four times as long for the rest."""


class ModbusLine(SharedLine):
    """A line of :class:`~winchkit.drivers.slow.SlowDevices`."""

    def __init__(
        self, name: str, spec: BusSpec, instruments: tuple[Instrument, ...], clock: Clock
    ) -> None:
        """Take the instruments of a line, which ``serve`` opens."""
        self.name = name
        self.sensors: tuple[Instrument, ...] = instruments
        self._spec = spec
        self._clock = clock
        self._client = ModbusClient(spec, name)
        self._lock = asyncio.Lock()
        self._closing = False
        self._opened = False
        self._next_probe = clock.now()
        gap = max((item.decoder.spec.gap for item in instruments), default=0.0)
        self._silence = max(gap, silence_of(spec))
        self._share = LineShare(
            [item.wanted_rate for item in instruments],
            [exchange(item.decoder.spec, spec).time for item in instruments],
            _LEAST[spec.kind],
        )
        for item, limit in zip(instruments, self._share.limits, strict=True):
            item.pace = 1 / limit
        self._share_out()

    async def serve(self) -> None:
        """Poll until closed."""
        # A cancellation that meets an answer is lost in asyncio.wait_for (Python 3.11).
        while not self._closing:
            if not self._client.connected and not await self._connect():
                await asyncio.sleep(RECONNECT)
                continue
            instrument = next_of(self.sensors, self._clock.now(), self._due)
            await asyncio.sleep(max(0.0, self._due(instrument) - self._clock.now()))
            async with self._lock:
                await self._poll(instrument)

    async def command(self, sensor: Sensor, name: str) -> None:
        """Send a command to an instrument between two polls, and wait for its confirmation."""
        instrument = self._own(sensor)
        spec, status = instrument.decoder.spec, instrument.decoder.status
        command = permitted_command(
            instrument.name, spec.command, name, may_store=instrument.may_store
        )
        await self._wait_until_open()
        async with self._lock:
            await send(self._client, instrument, command)
            sent = self._clock.now()
        await confirm(
            instrument,
            name,
            command,
            lambda meaning: status.has(meaning, instrument.status),
            sent=sent,
            clock=self._clock,
        )

    async def identify(self, sensor: Sensor) -> dict[str, float]:
        """Ask one of its instruments for its serial number and the like."""
        await self._wait_until_open()
        async with self._lock:
            return await identity(self._client, self._own(sensor))

    @property
    def note(self) -> str:
        """What its device does otherwise than Modbus TCP has it; empty without a finding."""
        return self._client.deviations.words

    def close(self) -> None:
        """Close the line and poll no more."""
        self._closing = True
        self._client.close()

    async def _wait_until_open(self) -> None:
        """Give a line that is being opened its time; the client refuses where it stays shut."""
        deadline = self._clock.now() + _OPENING
        while not self._client.connected and self._clock.now() < deadline:
            await asyncio.sleep(_POLL)

    def _own(self, sensor: Sensor) -> Instrument:
        return next(item for item in self.sensors if item is sensor)

    def _due(self, instrument: Instrument) -> float:
        """When to ask it next; silent ones wait for each other too."""
        return max(instrument.due, self._next_probe) if instrument.dead else instrument.due

    async def _poll(self, instrument: Instrument) -> None:
        probe, start = instrument.dead, self._clock.now()
        answered = await instrument.poll(self._client)
        if probe:
            self._next_probe = self._clock.now() + _PROBE_SHARE * self._spec.timeout
        if self._silence:
            await asyncio.sleep(self._silence)
        if answered and self._share.took(self._place(instrument), self._clock.now() - start):
            self._share_out()

    async def _connect(self) -> bool:
        try:
            await self._client.connect()
        except ConnectionLost as error:
            for instrument in self.sensors:
                instrument.problem = error
            return False
        for instrument in self.sensors:
            if self._client.replaced:  # because something else than the answer came
                instrument.publisher.tally.reconnects += 1
            else:
                instrument.reconnected(again=self._opened)
        self._opened, self._client.replaced = True, False
        return True

    def _share_out(self) -> None:
        """Give every instrument the rate that is to be expected."""
        tagged = self._spec.kind == "modbus-tcp" and "transaction-0" not in self._spec.deviations
        for item, rate in zip(self.sensors, self._share.rates, strict=True):
            item.on_line(1 / rate, wire_times(item.decoder.spec, self._spec), tagged=tagged)


async def send(client: ModbusClient, instrument: Instrument, command: CommandSpec) -> None:
    """Unlock and write; raises NoReply, DeviceRefused, ConnectionLost."""
    many = command.writes_many
    for step in command.unlock:
        await client.write(instrument.unit, step.register, [step.value], many=many)
    words = words_of(command.type, command.order, command.value)
    await client.write(instrument.unit, command.register, words, many=many)


async def identity(client: ModbusClient, instrument: Instrument) -> dict[str, float]:
    """What a device says of itself, e.g. its serial number; raises as :func:`send`."""
    found: dict[str, float] = {}
    spec = instrument.decoder.spec
    for item in spec.identity:
        count = REGISTERS[item.type]
        block = ReadBlock(item.register, count, spec.read.function, fixed=True)
        words = await instrument.ask(client, block)
        number = number_of(
            item.type, item.order, dict(enumerate(words, item.register)), block.start
        )
        found[item.name] = number * item.scale
    return found

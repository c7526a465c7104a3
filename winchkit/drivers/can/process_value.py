"""The process value of a CANopen instrument and its status, as a value in SI or NaN with flags."""

from __future__ import annotations

import asyncio
import math
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.nmt import NmtCommand
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo import PdoCodec, parse_object
from winchkit.drivers.can.canopen.pdo_parameters import cob_id, codecs, set_up
from winchkit.drivers.clock import Clock
from winchkit.drivers.device_command import confirm, permitted_command
from winchkit.drivers.publisher import InstrumentReadings, Publisher, Sampled
from winchkit.drivers.reading import Quality, Sensor, StatusWord
from winchkit.drivers.sharing import RETRY
from winchkit.errors import ConnectionLost, DeviceRefused, Fault, FileError, NoReply
from winchkit.schema.devices.device import DeviceSpec
from winchkit.units import convert, dimension_of

_REAL32_BITS = 32
"""CiA 301, data type 0008h."""
_TINIEST = 1e-30
"""A float below it, but not zero, is no measurement: its bytes are of another type."""


class ProcessDecoder:
    """Decoder of the process value and status of one type of CANopen instrument (CiA 404)."""

    def __init__(self, device: DeviceSpec, node: SdoNode) -> None:
        """Raise FileError where the device file contradicts itself or its EDS."""
        if device.process is None:
            raise FileError(Fault("is no CANopen instrument", device.path))
        self.spec = spec = device.process
        item = node.mapped(*parse_object(spec.value))
        self._bits = item.bits
        if spec.type == "f32" and (item.bits, item.signed) != (_REAL32_BITS, False):
            raise FileError(
                Fault(f"{spec.value} is no REAL32 in the EDS", device.path, key="process.type")
            )
        self._dimension = dimension_of(spec.unit) or ""
        self.status = StatusWord(spec.bits)

    def decode(self, raw: int, status: int) -> tuple[float, float, Quality]:
        """Value (SI or NaN), counts, flags of a raw object and its status."""
        counts = float(raw)
        if self.spec.type == "f32":
            counts = float(struct.unpack("<f", struct.pack("<I", raw))[0])
        quality = self.status.quality(status)
        if not math.isfinite(counts):
            quality |= Quality.FAULT
        elif quality.usable and self._is_implausible(counts):
            quality |= Quality.MISMATCH
        if not quality.usable:
            return math.nan, counts, quality
        return convert(counts * self.spec.scale, self.spec.unit, self._dimension), counts, quality

    def _is_implausible(self, counts: float) -> bool:
        """Whether no intact device shows this number."""
        beyond = self.spec.limit is not None and abs(counts) > self.spec.limit
        return beyond or (self.spec.type == "f32" and 0 < abs(counts) < _TINIEST)


_SILENT_PERIODS = 10
"""A device that sends by an event timer may leave out readings, or have another rate than declared
by a factor of a few; ten periods are certain (rule of thumb)."""
_FRAME = 135 / 1e6
"""The longest frame with eight bytes at 1 Mbit/s, s: what a value is older for having been sent."""
_SERIAL = (0x1018, 4)


class ProcessInstrument(InstrumentReadings):
    """An instrument on an open CAN bus. ``latest`` is what other threads read."""

    def __init__(self, name: str, device: DeviceSpec, node: int, bus: CanBus, clock: Clock) -> None:
        """Attach to a node; nothing is sent yet. Raises FileError for an unusable device file."""
        if device.process is None:
            raise FileError(Fault("is no CANopen instrument", device.path))
        self.name = name
        self.spec = spec = device.process
        self.period = 1 / spec.rate
        self.max_age = _SILENT_PERIODS * self.period
        """A reading older than this is stale, s."""
        self.publisher = Publisher(spec.rate)
        self.problem: ConnectionLost | None = None
        """Why there is no new reading, while there is none."""
        self.may_store = False
        """Whether commands that write the device's EEPROM are let through."""
        self.status = 0
        self._bus, self._clock = bus, clock
        self._node = SdoNode(bus, node, Path(device.path).parent / spec.eds)
        self._decoder = ProcessDecoder(device, self._node)
        self._codecs = codecs(self._node, spec.tpdo)
        self._heard = clock.now()
        self._was_set_up = False

    @property
    def tared(self) -> bool | None:
        """Whether the device says that it shows a net value; None where it does not say."""
        return self._decoder.status.has("net", self.status) if "net" in self.spec.bits else None

    @property
    def sends(self) -> bool:
        """Whether it sends its values itself."""
        return bool(self._codecs)

    @property
    def silent(self) -> bool:
        """Whether nothing has come for too long."""
        return self._clock.now() - self._heard > self.max_age

    def set_up(self) -> None:
        """Map its TPDOs and start it; raises NoReply, DeviceRefused, ConnectionLost."""
        node = self._node
        if self.sends:
            self._bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node.node)
            set_up(node, "tpdo", self._codecs)
            for codec in self._codecs:
                identifier = cob_id("tpdo", codec.spec.number, node.node)
                self._bus.on(identifier, self._receiver(codec))
        self._bus.nmt(NmtCommand.START, node.node)
        self.publisher.tally.reconnects += self._was_set_up
        self._was_set_up, self._heard = True, self._clock.now()

    def ask(self) -> None:
        """Read status and value by SDO, in this order and the status again; raises as above."""
        t_request = self._clock.now()
        before = self._read(self.spec.status)
        raw = self._read(self.spec.value)
        after = self._read(self.spec.status)
        self._publish(raw, before | after, t_request, self._clock.now())

    def failed(self, error: ConnectionLost) -> None:
        """Keep and count a failure."""
        tally = self.publisher.tally
        tally.drops += 1
        tally.timeouts += isinstance(error, NoReply)
        tally.exceptions += isinstance(error, DeviceRefused)
        self.problem = error

    def fell_silent(self) -> NoReply:
        """Error of an instrument that sends nothing."""
        return NoReply(
            f"{self.name}: no process value for {self.max_age:g} s; check power, wiring, node id "
            "and that the node has not been stopped"
        )

    def command(self, name: str) -> None:
        """Send a command of the device file; raises NotPermitted, NoReply, DeviceRefused."""
        command = permitted_command(self.name, self.spec.command, name, may_store=self.may_store)
        self._node.write(*parse_object(command.object), command.value)

    async def confirm(self, name: str) -> None:
        """Wait for the status that a command must bring or end; raises DeviceRefused."""
        await confirm(
            self,
            name,
            self.spec.command[name],
            lambda meaning: self._decoder.status.has(meaning, self.status),
            sent=self._clock.now(),
            clock=self._clock,
        )

    def identify(self) -> dict[str, float]:
        """Its serial number, where it has one; raises NoReply."""
        serial = self._node.read_if_there(*_SERIAL)
        return {} if serial is None else {"serial number": float(serial)}

    def _read(self, place: str | None) -> int:
        return 0 if place is None else self._node.read(*parse_object(place))

    def _receiver(self, codec: PdoCodec) -> Callable[[bytes, float], None]:
        value = codec.position.get(parse_object(self.spec.value))
        at = self.spec.status
        status = None if at is None else codec.position.get(parse_object(at))

        def receive(data: bytes, now: float) -> None:
            numbers = codec.decode(data)
            if numbers is None:
                self.publisher.tally.malformed += 1
            elif value is not None:
                word = 0 if status is None else numbers[status]
                self._publish(numbers[value], word, now - _FRAME, now)

        return receive

    def _publish(self, raw: int, status: int, t_request: float, t_receive: float) -> None:
        value, counts, quality = self._decoder.decode(raw, status)
        delay = self.spec.filter_delay
        when = Sampled(t_request, t_receive, t_request - delay - self.period, t_receive - delay)
        self.problem, self.status, self._heard = None, status, t_receive
        self.publisher.publish(value, value, counts, quality, when)


class ProcessLine:
    """The instruments of one CAN bus; a line of :class:`~winchkit.drivers.slow.SlowDevices`."""

    def __init__(self, name: str, instruments: tuple[ProcessInstrument, ...], clock: Clock) -> None:
        """Take the instruments of a bus, which its owner opens and closes."""
        self.name = name
        self.sensors: Sequence[ProcessInstrument] = instruments
        self._clock = clock
        self._closing = False

    async def serve(self) -> None:
        """Keep the readings new until closed."""
        await asyncio.gather(*(self._serve(one) for one in self.sensors))

    async def command(self, sensor: Sensor, name: str) -> None:
        """Send a command to one of its instruments, and wait for its confirmation."""
        instrument = self._own(sensor)
        await asyncio.to_thread(instrument.command, name)
        await instrument.confirm(name)

    async def identify(self, sensor: Sensor) -> dict[str, float]:
        """Ask one of its instruments for its serial number."""
        return await asyncio.to_thread(self._own(sensor).identify)

    def close(self) -> None:
        """End the polling; the owner closes the bus."""
        self._closing = True

    def _own(self, sensor: Sensor) -> ProcessInstrument:
        return next(item for item in self.sensors if item is sensor)

    async def _serve(self, instrument: ProcessInstrument) -> None:
        """Set one instrument up, and again whenever it has fallen silent."""
        while not self._closing:
            try:
                await asyncio.to_thread(instrument.set_up)
                await self._watch(instrument)
            except ConnectionLost as error:
                instrument.failed(error)
                await asyncio.sleep(RETRY)

    async def _watch(self, instrument: ProcessInstrument) -> None:
        due = self._clock.now()
        while not self._closing:
            if not instrument.sends:
                await asyncio.to_thread(instrument.ask)
            elif instrument.silent:
                raise instrument.fell_silent()
            due = max(due + instrument.period, self._clock.now())
            await asyncio.sleep(due - self._clock.now())

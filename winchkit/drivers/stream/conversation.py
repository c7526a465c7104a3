"""Exchanges on an open serial line: requests, answers, and silence after a lost answer.

An answer that comes too late must never be taken for the next one. Before every request the input
is discarded; after a failure the line stays silent until no answer can come any more.
"""

from __future__ import annotations

from contextlib import suppress

from winchkit.drivers.clock import Clock
from winchkit.drivers.counters import Counters
from winchkit.drivers.device_command import declared_command
from winchkit.drivers.reading import Quality
from winchkit.drivers.stream.decoder import FrameType, ParsedFrame
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.drivers.stream.parser import StreamFrame, StreamParser
from winchkit.drivers.stream.port import Chunk, SerialPort
from winchkit.errors import ConnectionLost, DeviceRefused, NoReply
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.stream import AskSpec

_COMMAND_TIME = 2.0
"""A balance tares when it has come to rest, s."""
_STOP_TRIES = 3
"""Times in which an instrument may have come to an end after it was stopped."""
_FLOOD = 0.5
"""So long after its time a wait ends although bytes keep coming, s."""
_TURNAROUND = 2e-3
"""What a device and this machine are likely to take before an answer begins, s."""
_FRESH_TRIES = 4
"""Questions a conversion whether there is a new value."""


class Conversation:
    """One open line; its coroutines raise one of our errors."""

    def __init__(self, port: SerialPort, spec: BusSpec, name: str, clock: Clock) -> None:
        """``name`` is the bus's."""
        self.port = port
        self.was_silent = False
        """Whether nothing at all came in time for the last request."""
        self.came_late = False
        """Whether something came for the last request after its time."""
        self._spec = spec
        self._where = f"bus '{name}' ({spec.port})"
        self._clock = clock
        self._selected: StreamInstrument | None = None
        self.byte_time = _byte_time(spec)
        """Of one character with its start, parity and stop bits, s."""

    @property
    def latency(self) -> float:
        """How late the port hands bytes over, s."""
        return self.port.latency

    def close(self, instruments: tuple[StreamInstrument, ...] = ()) -> None:
        """Release the port; instruments that send by themselves get the command to stop."""
        for instrument in instruments:
            if instrument.started and instrument.spec.stop:
                # A line that is lost already takes no command, and needs none.
                with suppress(ConnectionLost):
                    self.port.write(instrument.text(instrument.spec.stop))
        self.port.close()

    async def idle(self, until: float, instrument: StreamInstrument) -> bool:
        """Wait; what comes unasked is counted as late and thrown away. Whether anything came."""
        came = False
        while (chunk := await self._next(until)) is not None:
            instrument.publisher.tally.late += 1
            instrument.parser.feed(chunk.data)
            instrument.parser.begin(sure=False)
            came = True
        return came

    async def _next(self, until: float) -> Chunk | None:
        """Return the next bytes; a line that never falls silent is not waited for for ever."""
        if self._clock.now() > until + _FLOOD:
            return None
        return await self.port.read(until)

    async def start(self, instrument: StreamInstrument) -> None:
        """Send the start command of an instrument."""
        await self._stop_sending(instrument)
        for ask in instrument.spec.start:
            await self._exchange(instrument, ask, self._spec.timeout)
        instrument.started = True

    async def receive(self, instrument: StreamInstrument, until: float) -> bool:
        """Publish what an instrument sends by itself; whether anything came."""
        chunk = await self.port.read(until)
        if chunk is None:
            return False
        found = instrument.parser.feed(chunk.data)
        readings = [item for item in found if item.frame.meaning is FrameType.READING]
        instrument.sent(readings, chunk.time, self)
        return bool(readings)

    async def poll(self, instrument: StreamInstrument) -> None:
        """Take one reading, or none while the device says that its value is old."""
        spec = instrument.spec
        if not instrument.started:
            await self.start(instrument)
        await self._select(instrument)
        if spec.fresh is not None and not await self._is_fresh(instrument):
            return
        t_request = self._clock.now()
        item, time = await self._ask(instrument, spec.poll, instrument.parser)
        if item.frame.meaning is not FrameType.READING:
            raise self._refusal(instrument, item.frame)
        instrument.answered(item, t_request, time, self)

    async def command(self, instrument: StreamInstrument, name: str) -> None:
        """Send a command of the device file, e.g. ``tare``, and wait for its answer."""
        command = declared_command(instrument.name, instrument.spec.command, name)
        await self._stop_sending(instrument)
        await self._select(instrument)
        await self._exchange(instrument, command, _COMMAND_TIME)

    def silent(self, instrument: StreamInstrument) -> NoReply:
        """Error of a device that does not answer."""
        spec, link = self._spec, instrument.spec.link
        ours = f"{spec.baudrate} {spec.bytesize}{spec.parity}{spec.stopbits}"
        theirs = f" (its maker's setting is {link})" if link and str(link) != ours else ""
        waited = spec.timeout if instrument.spec.poll else instrument.max_age
        return NoReply(
            f"{self._where}: nothing that {instrument.name} can say came within {waited:g} s at "
            f"{ours}{theirs}{_instead(instrument.counters)}; check power, wiring, baud rate "
            "and address"
        )

    async def _is_fresh(self, instrument: StreamInstrument) -> bool:
        """Whether there is a value that was not read before."""
        fresh, parser = instrument.spec.fresh, instrument.fresh
        assert fresh is not None, "asked of devices that have the question"
        assert parser is not None, "asked of devices that have the question"
        item, _ = await self._ask(instrument, fresh.send, parser)
        decoded = item.frame.decoded
        if decoded is None:
            raise self._refusal(instrument, item.frame)
        if decoded.quality & Quality.STALE:
            wait = 1.0 / instrument.spec.rate / _FRESH_TRIES
            instrument.due = self._clock.now() + wait
            return False
        instrument.took(decoded)
        return True

    async def _stop_sending(self, instrument: StreamInstrument) -> None:
        """Stop an instrument that sends by itself; it must be started again."""
        spec = instrument.spec
        if not spec.stop:
            return
        instrument.started = False
        self.port.write(instrument.text(spec.stop))
        for _ in range(_STOP_TRIES):
            if not await self.idle(self._clock.now() + spec.longest_reply, instrument):
                instrument.parser.begin()
                return

    async def _select(self, instrument: StreamInstrument) -> None:
        """Address the instrument where the line needs it."""
        select = instrument.spec.select
        if select is None or instrument.address is None or self._selected is instrument:
            return
        self._selected = None
        await self._exchange(instrument, select, self._spec.timeout)
        self._selected = instrument

    async def _exchange(self, instrument: StreamInstrument, ask: AskSpec, timeout: float) -> None:
        """Send something and wait for its answer; what comes by itself meanwhile is published."""
        by_itself = instrument.spec.mode == "continuous"
        parser = instrument.parser if by_itself else instrument.talk
        if not by_itself:
            await self.idle(self._clock.now(), instrument)
            parser.begin()
        start = self._clock.now()
        self.port.write(instrument.text(ask.send))
        while ask.answer:
            chunk = await self._next(start + timeout)
            if chunk is None:
                self.was_silent = True
                await self.idle(start + instrument.spec.longest_reply, instrument)
                raise self.silent(instrument)
            found = parser.feed(chunk.data)
            if by_itself:
                readings = [item for item in found if item.frame.meaning is FrameType.READING]
                instrument.sent(readings, chunk.time, self)
            for item in found:
                if item.frame.meaning is FrameType.ANSWER:
                    return
                if item.frame.meaning in (FrameType.BUSY, FrameType.REFUSED):
                    raise self._refusal(instrument, item.frame)

    async def _ask(
        self, instrument: StreamInstrument, send: str, parser: StreamParser
    ) -> tuple[StreamFrame, float]:
        """Send a request and wait for one frame and the moment at which it came."""
        await self.idle(self._clock.now(), instrument)
        parser.begin()
        spoilt = parser.counts.spoilt
        start = self._clock.now()
        self.port.write(instrument.text(send))
        self.was_silent = True
        while (chunk := await self._next(start + self._spec.timeout)) is not None:
            self.was_silent = False
            found = parser.feed(chunk.data)
            alone = instrument.spec.binary is None or not (found and found[0].behind)
            if len(found) == 1 and alone:
                return found[0], chunk.time
            if found or parser.counts.spoilt > spoilt:
                break
        self._selected = None
        self.came_late = await self.idle(start + instrument.spec.longest_reply, instrument)
        if self.was_silent:
            raise self.silent(instrument)
        raise NoReply(
            f"{self._where}: what {instrument.name} answers is no whole frame of its device file; "
            "check cable, baud rate and device file"
        )

    def _refusal(self, instrument: StreamInstrument, frame: ParsedFrame) -> DeviceRefused:
        said = frame.text.strip()
        why = "is busy" if frame.meaning is FrameType.BUSY else "refuses"
        return DeviceRefused(f"{self._where}: {instrument.name} {why}: it answers '{said}'")


def exchange_time(instrument: StreamInstrument, bus: BusSpec) -> float:
    """How long a reading of a polled instrument is likely to take on its line, s."""
    spec = instrument.spec
    answer = len(spec.example) // 2 if spec.binary else len(spec.example)
    size = len(instrument.text(spec.poll)) + answer + len(spec.terminator)
    return size * _byte_time(bus) + _TURNAROUND


def _instead(seen: Counters) -> str:
    """Bytes that came without an acceptable frame, in words."""
    came = {
        "answers with a wrong check sum": seen.crc,
        "answers of another form": seen.malformed,
        "bytes that begin no frame": seen.resynchronised,
    }
    counts = [f"{count} {what}" for what, count in came.items() if count]
    return f"; there were {', '.join(counts)}" if counts else ""


def _byte_time(bus: BusSpec) -> float:
    return (1 + bus.bytesize + (bus.parity != "N") + bus.stopbits) / bus.baudrate

"""One instrument on a Modbus line: polls it, makes readings, counts what goes wrong."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from math import inf, nan

from winchkit.drivers.clock import Clock
from winchkit.drivers.modbus.client import ModbusClient
from winchkit.drivers.modbus.consistency import Consistency
from winchkit.drivers.modbus.decoder import RegisterContent, RegisterDecoder
from winchkit.drivers.modbus.late_replies import LISTENING, LateReplies
from winchkit.drivers.publisher import InstrumentReadings, Publisher, Sampled
from winchkit.drivers.reading import Quality
from winchkit.drivers.sharing import LATE, QUICK_RETRIES, RETRY, STALE_TIMEOUTS
from winchkit.errors import ConnectionLost, DeviceRefused, NoReply
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.modbus import ReadBlock

_STALLED = 0.01
"""By which this process may be late with an answer that came just in time, s."""
_FRESH = 0.06
"""No overload comes and goes within it, s: a status so old still says what is before a value."""
_TOO_LONG = (2, 3)
"""Exceptions with which a device refuses a block longer than its own: address, value."""


class _Withheld(NoReply):
    """An outstanding reply could not be distinguished from the answer: nothing is asked."""


class Instrument(InstrumentReadings):
    """A Modbus instrument. ``latest`` is what other threads read."""

    def __init__(
        self,
        name: str,
        device: DeviceSpec,
        unit: int,
        clock: Clock,
        *,
        timeout: float,
        rate: float = inf,
    ) -> None:
        """Poll as often as the device converts, at most ``rate`` (1/s); ``timeout`` in s."""
        self.name = name
        self.unit = unit
        self.decoder = RegisterDecoder(device)
        self.device = device
        self.wanted_rate = min(rate, self.decoder.spec.rate)
        self.problem: ConnectionLost | None = None
        """Why there is no new reading, while there is none."""
        self.status = 0
        self.due = self.asked = clock.now()
        self.pace = 1 / self.wanted_rate
        """Between two requests at least, s."""
        self.may_store = False
        """Whether commands that write the device's EEPROM are let through."""
        self.publisher = Publisher(self.decoder.spec.rate)
        self._clock = clock
        self._timeout = timeout
        self._wire = (0.0, 0.0)
        self._failures = 0
        spec = self.decoder.spec
        self._late = LateReplies(spec.longest_reply, spec.max_registers)
        self._consistency = Consistency(floats=self.decoder.field.type == "f32")
        self._status_before: Sequence[int] | None = None
        self._status_at = -inf
        self.on_line(1 / self.wanted_rate, (0.0, 0.0), tagged=False)

    def on_line(self, period: float, wire: tuple[float, float], *, tagged: bool) -> None:
        """Take the period that is to be expected, and the times of request and answer on it, s.

        On a ``tagged`` line (TCP) every answer names its request, so none can be mistaken.
        """
        self.period = period
        self._late.tagged = tagged
        self._wire = wire
        self.max_age = max(STALE_TIMEOUTS * self._timeout, 5 * period)
        """A reading older than this is stale, s."""

    @property
    def tared(self) -> bool | None:
        """Whether the device says that it shows a net value; None where it does not say."""
        if "net" not in self.decoder.spec.status:
            return None
        return self.decoder.status.has("net", self.status)

    @property
    def dead(self) -> bool:
        """Whether it has failed so often that it is to be asked less often."""
        return self._failures > QUICK_RETRIES

    def reconnected(self, *, again: bool) -> None:
        """Note that the line was opened: nothing of an old one can come any more."""
        self.publisher.tally.reconnects += again
        self._late.clear()
        self._failures = 0
        self.due = self._clock.now()

    async def poll(self, client: ModbusClient) -> bool:
        """Take one reading, and say whether there is one.

        A failure is counted, kept as ``problem`` and retried. An instrument that fails again and
        again is asked less often, so that the others on its line keep their rates.
        """
        t_request = self._clock.now()
        self.due, self.asked = max(self.due + self.pace, t_request), t_request
        self._take_events(client)
        if self._late.silent(t_request):
            self.due = self._late.until
            return False
        try:
            registers, t_receive = await self._ask_value(client)
            status = await self._ask_status(client)
        except _Withheld:
            self._status_before = None
            self.due = self._late.until
        except ConnectionLost as error:
            self.publisher.tally.exceptions += isinstance(error, DeviceRefused)
            self._failed(error)
        else:
            self._take_events(client)
            if self._late.alike(self.decoder.spec.read):
                # A second copy of this answer must not be taken for the next one.
                self._late.until = max(self._late.until, self._clock.now() + LISTENING)
            self._publish(registers, status, (t_request, t_receive))
            return True
        return False

    async def ask(self, client: ModbusClient, block: ReadBlock) -> list[int]:
        """Registers of a block, in an answer that can be none to an earlier request.

        Raises NoReply, DeviceRefused, ConnectionLost.
        """
        count = self._late.count(block, self._clock.now())
        if not count:
            wait = self._late.until - self._clock.now()
            raise _Withheld(
                f"{self.name}: an outstanding reply could not be distinguished from the next "
                f"answer; nothing is asked for {wait:.1f} s"
            )
        asked = self._clock.now()
        try:
            registers = await client.read(self.unit, block, count)
        except DeviceRefused:
            lengths_left = self._late.refused(block, count, self._clock.now())
            if client.refusal in _TOO_LONG and lengths_left:
                return await self.ask(client, block)
            raise
        except NoReply:
            self._unanswered(count, self._take_events(client))
            raise
        self._late.answered(block, count)
        if (took := self._clock.now() - asked) > self._timeout + _STALLED:
            # This computer stood still: the age of the answer is unknown.
            self.publisher.tally.late += 1
            raise NoReply(
                f"{self.name}: an answer was taken {took:.2f} s after its request, later than its "
                f"time-out of {self._timeout:g} s; this computer was busy"
            )
        return registers[: block.count]

    async def _ask_value(self, client: ModbusClient) -> tuple[list[int], float]:
        """Registers of the value's block, and when they came."""
        if self.decoder.spec.status_read is not None and not self._status_is_fresh:
            self._status_before = await self._read_status(client)
            await self._listen()
        registers = await self.ask(client, self.decoder.spec.read)
        return registers, self._clock.now()

    async def _ask_status(self, client: ModbusClient) -> Sequence[int]:
        """Registers of the status block, where there is one of its own."""
        if self.decoder.spec.status_read is None:
            return ()
        await self._listen()
        return await self._read_status(client)

    @property
    def _status_is_fresh(self) -> bool:
        """Whether what the last reading's status said can still be what it says before this one."""
        age = self._clock.now() - self._status_at
        return self._status_before is not None and age < _FRESH

    async def _listen(self) -> None:
        """Let a second copy of an answer come before the next query, which it would answer."""
        spec = self.decoder.spec
        if any(block and self._late.alike(block) for block in (spec.read, spec.status_read)):
            await asyncio.sleep(LISTENING)

    async def _read_status(self, client: ModbusClient) -> Sequence[int]:
        block = self.decoder.spec.status_read
        assert block is not None, "asked for only where the device has a status block"
        return await self.ask(client, block)

    def _take_events(self, client: ModbusClient) -> set[str]:
        """Count what came from this unit beside good answers; returns what kinds of it."""
        kinds, tally = set[str](), self.publisher.tally
        for event in client.events(self.unit):
            setattr(tally, event.kind, getattr(tally, event.kind) + event.count)
            kinds.add(event.kind)
            if event.kind == "late" or event.registers:
                self._late.came(event.registers, self._clock.now())
        return kinds

    def _unanswered(self, count: int, kinds: set[str]) -> None:
        """No answer of ``count`` registers came in time, only what is of these ``kinds``."""
        self.publisher.tally.timeouts += not kinds & {"crc", "malformed"}
        if kinds == {"crc"} and not self._late.outstanding:
            # It did answer, with a frame of the right length that was damaged on the way.
            count = 0
        self._late.unanswered(count, self._clock.now())

    def _failed(self, error: ConnectionLost) -> None:
        self.problem = error
        self._failures += 1
        self.publisher.tally.drops += 1
        self._status_before = None
        pause = max(RETRY, 4 * self._timeout) if self.dead else 0.0
        self.due = max(self._clock.now() + pause, self._late.until)

    def _publish(
        self, registers: Sequence[int], status: Sequence[int], times: tuple[float, float]
    ) -> None:
        decoded = self.decoder.decode(registers, status)
        quality = decoded.quality | self._before(registers, decoded)
        self._status_before, self._status_at = status or None, times[1]
        t_request, t_receive = times
        spec, (there, back) = self.decoder.spec, self._wire
        if t_receive - t_request > LATE + there + back:
            quality |= Quality.LATE
        sampled = Sampled(
            t_request,
            t_receive,
            min(t_request + there, t_receive) - spec.filter_delay - 1 / spec.rate,
            max(t_receive - back, t_request) - spec.filter_delay,
        )
        self.problem, self._failures, self.status = None, 0, decoded.status
        if self._late.discards():
            self.publisher.publish(nan, nan, nan, quality | Quality.AMBIGUOUS, sampled)
            return
        order = True if self._consistency.order_known else None
        if order is None and decoded.quality.usable:
            order = self.decoder.word_order(registers)
        accepted = self._consistency.take(not quality & Quality.MISMATCH, order)
        if accepted is None:
            return
        if not accepted:
            quality |= Quality.MISMATCH
        self.publisher.publish(decoded.value, decoded.gross, decoded.counts, quality, sampled)

    def _before(self, registers: Sequence[int], decoded: RegisterContent) -> Quality:
        """Flags of the status that was read before the value."""
        if self._status_before is None or self.decoder.spec.status_read is None:
            return Quality.GOOD
        before = self.decoder.decode(registers, self._status_before)
        if before.value != decoded.value and before.quality.usable and decoded.quality.usable:
            return Quality.MISMATCH
        return before.quality

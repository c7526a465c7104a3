"""The one module that knows pymodbus: a client for one line that lets exact answers through only.

pymodbus takes whatever decodes as an answer. Its trace hook sees every byte first; the gate that
stands there passes the one frame that answers the request and counts all else. A TCP connection
on which anything else came, or on which an answer did not come in time, is replaced by a new one,
at once where no answer can be recognised any more.
"""

from __future__ import annotations

import asyncio
import logging
from collections import defaultdict, deque
from collections.abc import Awaitable, Sequence
from functools import partial
from random import Random
from typing import Any

from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ExceptionResponse

from winchkit.drivers.modbus import transactions
from winchkit.drivers.modbus.deviations import Deviations
from winchkit.drivers.modbus.frames import AnswerGate, LineEvent
from winchkit.drivers.modbus.tcp_frames import TcpAnswerGate
from winchkit.drivers.unplugged import UNPLUGGED
from winchkit.errors import ConnectionLost, DeviceRefused, NoReply
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.modbus import ReadBlock

_CLOSES = 3
"""Connections in a row that end after one answer: a line that fails does not do so thrice."""
_NEVER = 1 << 30
"""The library closes a connection after so many unanswered requests: here one silent unit does not
close the line of others."""
_KEPT = 256
"""Events kept of a unit that is not read, e.g. of another master's devices."""
_ACKNOWLEDGE, _BUSY = 5, 6
"""Exception codes 05 and 06 of the Modbus application protocol."""
_EXCEPTIONS = {
    1: "illegal function",
    2: "illegal address",
    3: "illegal value",
    4: "device failure",
    _ACKNOWLEDGE: "acknowledge",
    _BUSY: "device busy",
    10: "gateway path unavailable",
    11: "gateway target silent",
}

_PORT_ERRORS: tuple[type[Exception], ...] = (ModbusException, ValueError, *UNPLUGGED)

logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class ModbusClient:
    """One line, one request at a time; a coroutine's method raises one of our errors."""

    def __init__(self, spec: BusSpec, name: str) -> None:
        """Remember where the line is; ``connect`` opens it."""
        self.name = name
        self._spec = spec
        self._client: AsyncModbusTcpClient | AsyncModbusSerialClient | None = None
        self.deviations = Deviations(name, spec.deviations)
        """What the device does otherwise than Modbus TCP has it."""
        self._closes = "closes" in spec.deviations
        self._reached = False
        """Of a device that closes each connection: whether the newest could be opened."""
        self._answers = self._closed_early = 0
        """Good answers on this connection; connections in a row that ended after the first."""
        self._gate: AnswerGate | TcpAnswerGate = AnswerGate()
        self._known = 0
        self._lost: asyncio.Future[None] | None = None
        """Of the exchange under way: done once no answer to it can be taken."""
        self.replaced = False
        """Whether the connection was closed here because something else than the answer came."""
        self.refusal = 0
        """Exception code of the newest refusal."""
        self._events: defaultdict[int, deque[LineEvent]] = defaultdict(lambda: deque(maxlen=_KEPT))

    @property
    def where(self) -> str:
        """The line for messages."""
        place = f"{self._spec.host}:{self._spec.port}" if self._spec.host else self._spec.port
        return f"bus '{self.name}' ({place})"

    @property
    def connected(self) -> bool:
        """Whether the line is open and fit to be used."""
        if self._gate.broken and self._client is not None:
            self.replaced = True
            self.close()
        return self._reached if self._closes else self._is_open

    async def connect(self) -> None:
        """Open the line anew, so that nothing of an old one remains; raises ConnectionLost."""
        self._look_at_end()
        self.close()
        self._reached = False
        self._answers = 0
        self._gate = self._new_gate()
        self._known = 0
        try:
            self._client = client = self._make()
            client.set_max_no_responses(_NEVER)
            open_now = await client.connect()
        except _PORT_ERRORS as error:
            raise ConnectionLost(f"{self.where}: cannot be opened: {error}") from error
        if not open_now:
            raise ConnectionLost(f"{self.where}: cannot be opened; check address and power")
        # Transactions of one connection are not those of the one before: a reply to an old
        # request that a gateway hands over on the new connection answers nothing. The loop's time
        # is the seed, so that a bench in simulated time repeats.
        seed = asyncio.get_running_loop().time()
        client.ctx.next_tid = Random(seed).randrange(1, transactions.LAST)
        self._reached = True

    def close(self) -> None:
        """Close the line."""
        client, self._client = self._client, None
        self._gate.expire()
        self._collect()
        if client is not None:
            try:
                client.close()
            except _PORT_ERRORS as error:
                logging.getLogger(__name__).debug("%s: closing: %s", self.where, error)

    def events(self, unit: int) -> list[LineEvent]:
        """Events of a unit, other than good answers, since the last call."""
        self._collect()
        return list(self._events.pop(unit, ()))

    async def read(self, unit: int, block: ReadBlock, count: int) -> list[int]:
        """Exactly ``count`` registers; raises NoReply, DeviceRefused, ConnectionLost."""
        client = await self._open()
        self._number(client)
        ask = client.read_holding_registers if block.function == 3 else client.read_input_registers
        reply = await self._exchange(unit, ask(block.start, count=count, device_id=unit))
        return list(reply.registers)

    async def write(self, unit: int, register: int, words: Sequence[int], *, many: bool) -> None:
        """Write registers, with function 16 where ``many``; raises as :meth:`read`."""
        client = await self._open()
        self._number(client)
        if many:
            await self._exchange(
                unit, client.write_registers(register, list(words), device_id=unit)
            )
        else:
            await self._exchange(unit, client.write_register(register, words[0], device_id=unit))

    def _number(self, client: AsyncModbusTcpClient | AsyncModbusSerialClient) -> None:
        """Let the library use a transaction number that the next answers are unlikely to hold."""
        gate, context = self._gate, client.ctx
        if isinstance(gate, TcpAnswerGate):
            context.next_tid = gate.numbers.after(context.next_tid) - 1

    async def _exchange(self, unit: int, request: Awaitable[Any]) -> Any:
        waiting = asyncio.ensure_future(request)
        self._lost = lost = asyncio.get_running_loop().create_future()
        try:
            await asyncio.wait((waiting, lost), return_when=asyncio.FIRST_COMPLETED)
            if not waiting.done():
                raise ModbusException("the answer is damaged")
            reply = waiting.result()
        except _PORT_ERRORS as error:
            came = self._gate.expire()
            raise self._failed(unit, error, came) from error
        finally:
            waiting.cancel()
            await asyncio.wait((waiting,))
            if self._closes:
                self.close()
        self._answers += 1
        if isinstance(reply, ExceptionResponse):
            self.refusal = code = reply.exception_code
            raise DeviceRefused(
                f"{self.where} unit {unit}: Modbus exception {code} "
                f"({_EXCEPTIONS.get(code, 'unknown')})"
            )
        return reply

    def _new_gate(self) -> AnswerGate | TcpAnswerGate:
        old = self._gate
        if self._spec.kind != "modbus-tcp":
            return AnswerGate()
        before = old if isinstance(old, TcpAnswerGate) else None
        return TcpAnswerGate(before, self.deviations)

    def _trace(self, gate: AnswerGate | TcpAnswerGate, sending: bool, data: bytes) -> bytes:
        """Stand between pymodbus and the line; it hands over all that it has not used yet."""
        if gate is not self._gate:
            return b""  # of a connection that was closed
        if sending:
            gate.sent(data)
            self._known = 0
            return data
        fresh = data[self._known :] if len(data) >= self._known else data
        answer = gate.received(fresh)
        lost = self._lost
        if isinstance(gate, TcpAnswerGate) and gate.lost and lost is not None and not lost.done():
            lost.set_result(None)
        self._known = len(data) - len(answer)
        return answer

    def _collect(self) -> None:
        for event in self._gate.events():
            self._events[event.unit].append(event)

    def _make(self) -> AsyncModbusTcpClient | AsyncModbusSerialClient:
        spec = self._spec
        if spec.kind == "modbus-tcp":
            return AsyncModbusTcpClient(
                spec.host or "",
                port=int(spec.port or 502),
                timeout=spec.timeout,
                retries=0,
                reconnect_delay=0,
                trace_packet=partial(self._trace, self._gate),
            )
        return AsyncModbusSerialClient(
            str(spec.port),
            baudrate=spec.baudrate,
            parity=spec.parity,
            stopbits=spec.stopbits,
            timeout=spec.timeout,
            retries=0,
            reconnect_delay=0,
            trace_packet=partial(self._trace, self._gate),
        )

    @property
    def _is_open(self) -> bool:
        return self._client is not None and bool(self._client.connected)

    def _look_at_end(self) -> None:
        """Note a device that ended its connections after the first answer, again and again."""
        if self._client is None or self._is_open or self._spec.kind != "modbus-tcp":
            return
        self._closed_early = self._closed_early + 1 if self._answers == 1 else 0
        if self._closed_early >= _CLOSES:
            self.deviations.note("closes", "closes the connection after each answer")

    async def _open(self) -> AsyncModbusTcpClient | AsyncModbusSerialClient:
        if self._closes and not self._is_open:
            await self.connect()
        if not self.connected or self._client is None:
            self._look_at_end()
            why = self.deviations.words or "the line is closed; it is opened again by itself"
            raise ConnectionLost(f"{self.where}: {why}")
        return self._client

    def _failed(self, unit: int, error: Exception, came: bool) -> ConnectionLost:
        if self._client is None or not self._client.connected:
            self._look_at_end()
            why = self.deviations.words
            return ConnectionLost(f"{self.where}: {why or f'connection lost: {error}'}")
        place, time = f"{self.where} unit {unit}", f"{self._spec.timeout:g} s"
        if came and self.deviations.words:
            return NoReply(f"{place}: {self.deviations.words}")
        if came:
            return NoReply(
                f"{place}: no valid answer within {time}, only what is damaged or answers "
                "something else; check wiring, termination and that every unit number is unique"
            )
        return NoReply(
            f"{place}: no answer within {time}; check power, wiring, baud rate and unit number"
        )

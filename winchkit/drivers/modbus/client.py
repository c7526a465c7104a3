"""The one module that knows pymodbus: a guarded client for one line.

Guards for what was measured: a reply that comes after its timeout must never answer the next
request (silence after a timeout, alternating lengths, the number of registers checked), and one
silent device must not close the line for the others.
"""

from __future__ import annotations

import asyncio
import logging

from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ExceptionResponse

from winchkit.errors import ConnectionLost, DeviceRefused, NoReply
from winchkit.schema.bench import BusSpec
from winchkit.schema.device import ReadBlock

__all__ = ["ModbusClient"]

_NEVER = 1 << 30
_EXCEPTIONS = {
    1: "illegal function",
    2: "illegal address",
    3: "illegal value",
    4: "device failure",
    5: "acknowledge",
    6: "device busy",
    10: "gateway path unavailable",
    11: "gateway target silent",
}

logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class ModbusClient:
    """One line, one request at a time; a coroutine's method raises one of our errors."""

    def __init__(self, spec: BusSpec, name: str) -> None:
        """Remember where the line is; ``connect`` opens it."""
        self.name = name
        self._spec = spec
        self._client: AsyncModbusTcpClient | AsyncModbusSerialClient | None = None

    @property
    def where(self) -> str:
        """The line for messages."""
        place = f"{self._spec.host}:{self._spec.port}" if self._spec.host else self._spec.port
        return f"bus '{self.name}' ({place})"

    @property
    def connected(self) -> bool:
        """Whether the line is open."""
        return self._client is not None and bool(self._client.connected)

    async def connect(self) -> None:
        """Open the line anew, so that nothing of an old one remains; raises ConnectionLost."""
        self.close()
        self._client = client = self._make()
        client.set_max_no_responses(_NEVER)
        try:
            open_now = await client.connect()
        except (OSError, ModbusException) as error:
            raise ConnectionLost(f"{self.where}: cannot be opened: {error}") from error
        if not open_now:
            raise ConnectionLost(f"{self.where}: cannot be opened; check address and power")

    def close(self) -> None:
        """Close the line."""
        if self._client is not None:
            self._client.close()
            self._client = None

    async def read(self, unit: int, block: ReadBlock, count: int, silence: float) -> list[int]:
        """Exactly ``count`` registers; raises NoReply, DeviceRefused, ConnectionLost.

        After a timeout it keeps the line silent for ``silence`` seconds, until no late reply can
        come any more.
        """
        client = self._open()
        ask = client.read_holding_registers if block.function == 3 else client.read_input_registers
        try:
            reply = await ask(block.start, count=count, device_id=unit)
        except (ModbusException, OSError) as error:
            await asyncio.sleep(silence)
            raise self._failed(unit, error) from error
        self._refuse_exception(unit, reply)
        registers = list(reply.registers)
        if len(registers) != count:
            await asyncio.sleep(silence)
            raise NoReply(
                f"{self.where} unit {unit}: {len(registers)} registers came for {count}: "
                "the answer to another request, dropped"
            )
        return registers

    async def write(self, unit: int, register: int, value: int, silence: float) -> None:
        """Write one register; raises NoReply, DeviceRefused, ConnectionLost."""
        client = self._open()
        try:
            reply = await client.write_register(register, value, device_id=unit)
        except (ModbusException, OSError) as error:
            await asyncio.sleep(silence)
            raise self._failed(unit, error) from error
        self._refuse_exception(unit, reply)

    def _make(self) -> AsyncModbusTcpClient | AsyncModbusSerialClient:
        spec = self._spec
        if spec.kind == "modbus-tcp":
            return AsyncModbusTcpClient(
                spec.host or "",
                port=int(spec.port or 502),
                timeout=spec.timeout,
                retries=0,
                reconnect_delay=0,
            )
        return AsyncModbusSerialClient(
            str(spec.port),
            baudrate=spec.baudrate,
            parity=spec.parity,
            stopbits=spec.stopbits,
            timeout=spec.timeout,
            retries=0,
            reconnect_delay=0,
        )

    def _open(self) -> AsyncModbusTcpClient | AsyncModbusSerialClient:
        if self._client is None or not self._client.connected:
            raise ConnectionLost(f"{self.where}: the line is closed; it is opened again by itself")
        return self._client

    def _failed(self, unit: int, error: Exception) -> ConnectionLost:
        if not self.connected:
            return ConnectionLost(f"{self.where}: connection lost: {error}")
        return NoReply(
            f"{self.where} unit {unit}: no valid answer within {self._spec.timeout:g} s; "
            "check power, wiring, baud rate and unit number"
        )

    def _refuse_exception(self, unit: int, reply: object) -> None:
        if isinstance(reply, ExceptionResponse):
            code = reply.exception_code
            raise DeviceRefused(
                f"{self.where} unit {unit}: Modbus exception {code} "
                f"({_EXCEPTIONS.get(code, 'unknown')})"
            )

"""The far end of a line: answers queries, and changes the answers as it is set to."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random
from typing import Any

from pymodbus.transport import CommParams, CommType, ModbusProtocol

from cell_campaign.device import Device
from cell_campaign.warp import WarpLoop
from modbus_peers.faulty_line import crc

Plan = Callable[[int], str]
"""Fault of the next answer of a unit; empty for none."""
LATE = (1.0, 2.9)
"""Of the longest reply; the driver promises to be safe up to three of them."""
OVERLOAD = (0.1, 0.4)
"""An overload lasts longer than the reading of value and status, s."""
TURNAROUND = 0.002
_PORTS = iter(range(10_000, 2**31))


@dataclass
class FarEnd:
    """Devices by unit on one line in memory; ``plan`` says what goes wrong with each answer."""

    loop: WarpLoop
    rtu: bool
    devices: dict[int, Device]
    plan: Plan
    random: Random
    timeout: float
    port: int = 0
    done: dict[str, int] = field(default_factory=dict)
    """How often each fault happened."""
    _listener: Any = None
    _busy: dict[int, float] = field(default_factory=dict)
    """A device answers one query after the other."""

    @property
    def address(self) -> dict[str, Any]:
        """Keys of the bus."""
        if self.rtu:
            return {"kind": "modbus-rtu", "port": f"__pymodbus_nullmodem:{self.port}"}
        return {"kind": "modbus-tcp", "host": "__pymodbus_nullmodem", "port": self.port}

    async def listen(self) -> None:
        """Be there."""
        self.port = next(_PORTS)
        kind = CommType.SERIAL if self.rtu else CommType.TCP
        host = "__pymodbus_nullmodem" + (f":{self.port}" if self.rtu else "")
        params = CommParams("far end", kind, source_address=(host, self.port))
        self._listener = _Listener(params, self)
        await self._listener.listen()

    def close(self) -> None:
        """Be gone."""
        self._listener.close()

    def unplug(self, connection: _Connection) -> None:
        """Close the line; it can be opened again at once."""
        self.loop.call_later(0.001, connection.close)

    def query(self, connection: _Connection, frame: bytes) -> None:
        """Answer one query."""
        head, body = (b"", frame[:-2]) if self.rtu else (frame[:6], frame[6:])
        unit = body[0]
        device = self.devices.get(unit)
        if device is None:
            return
        begin = max(self.loop.now, self._busy.get(unit, 0.0))
        fault = self.plan(unit)
        delay = TURNAROUND
        if fault == "late":
            low, high = LATE
            longest = device.spec.longest_reply
            delay = max(self.timeout * 1.01, longest * self.random.uniform(low, high))
        self._busy[unit] = begin + delay
        if fault == "overload":
            device.overload_until = begin + self.random.uniform(*OVERLOAD)
        device.overload = self.loop.now < device.overload_until
        device.not_a_number = fault == "nan"
        device.frozen = fault == "frozen"
        # What a late device shows is of the moment at which it was asked.
        pdu = self._pdu(device, body[1:])
        if fault:
            self.done[fault] = self.done.get(fault, 0) + 1
        for at, data in self._spoilt(fault, unit, head, pdu, frame):
            self.loop.call_at(begin + delay + at, connection.answer, data)
        if fault == "unplug":
            self.unplug(connection)

    def _pdu(self, device: Device, query: bytes) -> bytes:
        function, start, count = struct.unpack_from(">BHH", query)
        spec = device.spec
        blocks = [block for block in (spec.read, spec.status_read) if block is not None]
        if function != spec.read.function:
            return bytes((function | 0x80, 1))
        if not any(
            start == block.start and count - block.count in ((0,) if block.fixed else (0, 1))
            for block in blocks
        ):
            return bytes((function | 0x80, 2))
        words = device.words(self.loop.now)
        wanted = [words.get(start + k, 0) for k in range(count)]
        return struct.pack(f">BB{count}H", function, 2 * count, *wanted)

    def _frame(self, unit: int, head: bytes, pdu: bytes) -> bytes:
        if self.rtu:
            return bytes((unit,)) + pdu + crc(bytes((unit,)) + pdu)
        return head[:4] + struct.pack(">HB", len(pdu) + 1, unit) + pdu

    def _spoilt(
        self, fault: str, unit: int, head: bytes, pdu: bytes, query: bytes
    ) -> list[tuple[float, bytes]]:
        """What goes over the line, and when after the answer was due."""
        good, random = self._frame(unit, head, pdu), self.random
        count = max(1, pdu[1] // 2 - random.randint(1, 3))
        shorter = bytes((pdu[0], 2 * count)) + pdu[2:][: 2 * count]
        refusal = bytes((pdu[0] | 0x80, random.choice((2, 4, 6))))
        at = random.randrange(1, len(good))
        sent: dict[str, list[tuple[float, bytes]]] = {
            "silence": [],
            "unplug": [],
            "exception": [(0, self._frame(unit, head, refusal))],
            "short": [(0, self._frame(unit, head, shorter))],
            "wrong unit": [(0, self._frame(unit % 200 + 40, head, pdu))],
            "cut off": [(0, good[:at])],
            "garbage": [(0, bytes((random.randrange(256),)) + good)],
            "garbage behind": [(0, good + random.randbytes(random.randint(1, 4)))],
            "split": [(0, good[:at]), (0.004, good[at:])],
            "twice": [(0, good), (0.001, good)],
            "echo": [(0, query + good)],
            "only echo": [(0, query)],
            "damaged": [(0, self._damaged(good))],
        }
        return sent.get(fault, [(0, good)])

    def _damaged(self, good: bytes) -> bytes:
        """A few wrong bits; over TCP in the head, since there the frame has no check sum."""
        data = bytearray(good)
        for _ in range(self.random.randint(1, 3)):
            at = self.random.randrange(len(data) if self.rtu else 6)
            data[at] ^= 1 << self.random.randrange(8)
        return bytes(data) if bytes(data) != good else bytes((good[0] ^ 1,)) + good[1:]


class _Listener(ModbusProtocol):
    def __init__(self, params: CommParams, end: FarEnd) -> None:
        super().__init__(params, True)
        self._end = end

    def callback_new_connection(self) -> ModbusProtocol:
        return _Connection(self.comm_params, self._end)

    def callback_connected(self) -> None:
        pass

    def callback_disconnected(self, exc: Exception | None) -> None:
        pass

    def callback_data(self, data: bytes, addr: Any = None) -> int:
        return len(data)


class _Connection(_Listener):
    """One open line; queries come whole, as the client writes them at once."""

    def callback_data(self, data: bytes, addr: Any = None) -> int:
        self._end.query(self, bytes(data))
        return len(data)

    def answer(self, data: bytes) -> None:
        """Send, unless the line was closed meanwhile."""
        if self.transport:
            self.transport.write(data)


def run(loop: WarpLoop, coroutine: Any) -> Any:
    """Run on a loop of simulated time."""
    asyncio.set_event_loop(loop)
    return loop.run_until_complete(coroutine)

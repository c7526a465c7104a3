"""A small Modbus TCP device written from the protocol's own text, that misbehaves on request."""

from __future__ import annotations

import asyncio
import struct
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field


@dataclass
class Peer:
    """Answers FC 3, 6 and 16 on 127.0.0.1; ``behave`` may change, delay or swallow an answer."""

    registers: dict[int, int] = field(default_factory=dict)
    end: int = 200
    """First address that does not exist."""
    behave: Callable[[int, int, bytes], tuple[float, bytes] | None] = lambda _u, _n, b: (0.0, b)
    """Unit, number of the request, answer PDU -> delay (s) and PDU, or None for silence."""
    requests: list[tuple[int, int, int, int]] = field(default_factory=list)
    """Unit, function, address, count or value."""
    written: Callable[[Peer, int, int], None] = lambda _peer, _address, _value: None
    """Called with every register that is written."""
    transaction: Callable[[int], int] = lambda number: number
    """Transaction of an answer, of that of its request."""
    answers_as: int | None = None
    """Unit in its answers; None for that of the request."""
    copies: int = 1
    """How often each answer is sent."""
    apart: float = 0.0
    """Between two copies of an answer, s."""
    closes: bool = False
    """Whether it closes the connection after each answer."""
    connections: int = 0
    port: int = 0
    _loop: asyncio.AbstractEventLoop = field(default_factory=asyncio.new_event_loop)
    _writers: set[asyncio.StreamWriter] = field(default_factory=set)
    _tasks: set[asyncio.Task[None]] = field(default_factory=set)

    def __enter__(self) -> Peer:
        ready: Future[int] = Future()
        self._thread = threading.Thread(target=self._run, args=(ready,), daemon=True)
        self._thread.start()
        self.port = ready.result(5)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def hang_up(self) -> None:
        """Close every connection."""
        self._loop.call_soon_threadsafe(lambda: [w.close() for w in self._writers])

    def _run(self, ready: Future[int]) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._serve, "127.0.0.1", 0))
        ready.set_result(server.sockets[0].getsockname()[1])
        self._loop.run_forever()
        server.close()
        for writer in self._writers:
            writer.close()
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        self._writers.add(writer)
        try:
            while True:
                head = await reader.readexactly(7)
                transaction, _, length, unit = struct.unpack(">HHHB", head)
                pdu = await reader.readexactly(length - 1)
                number = len(self.requests)
                answer = self.behave(unit, number, self._answer(unit, pdu))
                if answer is not None:
                    task = self._loop.create_task(self._send(writer, transaction, unit, *answer))
                    self._tasks.add(task)
                    task.add_done_callback(self._tasks.discard)
        except (asyncio.IncompleteReadError, asyncio.CancelledError, ConnectionError):
            pass
        finally:
            self._writers.discard(writer)
            writer.close()

    async def _send(
        self, writer: asyncio.StreamWriter, transaction: int, unit: int, delay: float, pdu: bytes
    ) -> None:
        await asyncio.sleep(delay)
        unit = unit if self.answers_as is None else self.answers_as
        head = struct.pack(">HHHB", self.transaction(transaction), 0, len(pdu) + 1, unit)
        for copy in range(self.copies):
            if copy and self.apart:
                await asyncio.sleep(self.apart)
            writer.write(head + pdu)
        if self.closes:
            writer.close()

    def _answer(self, unit: int, pdu: bytes) -> bytes:
        function, address, number = struct.unpack_from(">BHH", pdu)
        self.requests.append((unit, function, address, number))
        if function == 6:
            self._write(address, number)
            return pdu
        if function == 16:
            for k, value in enumerate(struct.unpack_from(f">{number}H", pdu, 6)):
                self.requests[-1] = (unit, function, address, value)
                self._write(address + k, value)
            return pdu[:5]
        if address + number > self.end:
            return bytes((function | 0x80, 2))
        words = [self.registers.get(address + k, 0) for k in range(number)]
        return struct.pack(f">BB{number}H", function, 2 * number, *words)

    def _write(self, address: int, value: int) -> None:
        self.registers[address] = value
        self.written(self, address, value)

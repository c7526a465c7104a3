"""All slow devices on one asyncio thread: each line polls its instruments in turn."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine, Sequence
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass
from typing import Any

from winchkit.drivers.clock import Clock
from winchkit.drivers.modbus.client import ModbusClient
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.errors import ConnectionLost, NoReply
from winchkit.schema.bench import BusSpec

__all__ = ["Line", "SlowDevices"]

_RECONNECT = 0.3
_COMMAND_TIME = 5.0


@dataclass(frozen=True)
class Line:
    """One Modbus line and what hangs on it."""

    name: str
    spec: BusSpec
    instruments: tuple[Instrument, ...]


class SlowDevices:
    """Polls every line from one thread until closed."""

    def __init__(self, lines: Sequence[Line], clock: Clock) -> None:
        """Start polling at once; devices that are silent are tried again."""
        self._clock = clock
        self._loop = asyncio.new_event_loop()
        self._clients = {line.name: ModbusClient(line.spec, line.name) for line in lines}
        self._locks: dict[str, asyncio.Lock] = {line.name: asyncio.Lock() for line in lines}
        self._lines = tuple(lines)
        self._line_of = {id(item): line.name for line in lines for item in line.instruments}
        self._failure: Exception | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="slow-devices", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop polling and close the lines; raises what ended the polling before, if anything."""
        self._closing = True
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=3.0)
        if self._failure is not None:
            raise self._failure

    def command(self, instrument: Instrument, name: str) -> None:
        """Send a command to an instrument between two polls and wait for the device's answer.

        Raises NoReply, DeviceRefused, ConnectionLost, NotPermitted.
        """
        self._wait(self._command(instrument, name), instrument)

    def _wait(self, coroutine: Coroutine[Any, Any, None], instrument: Instrument) -> None:
        future = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        try:
            future.result(_COMMAND_TIME)
        except FutureTimeout:
            future.cancel()
            raise NoReply(
                f"{instrument.name}: no answer to a command within {_COMMAND_TIME:g} s; "
                "look at the line's other devices"
            ) from None

    async def _command(self, instrument: Instrument, name: str) -> None:
        line = self._line_of[id(instrument)]
        async with self._locks[line]:
            await instrument.command(self._clients[line], name)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        tasks = [self._loop.create_task(self._poll(line)) for line in self._lines]
        self._loop.run_forever()
        for task in tasks:
            task.cancel()
        ended = self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._failure = next((item for item in ended if isinstance(item, Exception)), None)
        for client in self._clients.values():
            client.close()
        self._loop.run_until_complete(asyncio.sleep(0.01))
        self._loop.close()

    async def _poll(self, line: Line) -> None:
        client, lock = self._clients[line.name], self._locks[line.name]
        # A cancellation that meets an answer is lost in asyncio.wait_for (Python 3.11).
        while not self._closing:
            if not client.connected and not await self._connect(line, client):
                await asyncio.sleep(_RECONNECT)
                continue
            instrument = min(line.instruments, key=lambda item: item.due)
            await asyncio.sleep(max(0.0, instrument.due - self._clock.now()))
            async with lock:
                await instrument.poll(client)

    async def _connect(self, line: Line, client: ModbusClient) -> bool:
        try:
            await client.connect()
        except ConnectionLost as error:
            for instrument in line.instruments:
                instrument.problem = error
            return False
        return True

"""Simulated Modbus instruments behind a pymodbus server, on a separate thread."""

from __future__ import annotations

import asyncio
import logging
import os
import select
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from winchkit.errors import ConnectionLost
from winchkit.sim.clock.simulated_clock import SimulatedClock, SimulatedThread
from winchkit.sim.instruments.modbus import ModbusInstrument

_AT_ONCE = 4096
"""Bytes: more than a frame (256), the buffer of a pseudo-terminal."""
_WAIT = 0.05
"""s: the thread ends at most that late."""


class PtyCable:
    """Two connected ports by path, ``near`` and ``far``; raises ConnectionLost."""

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise ConnectionLost(
                "Windows has no pseudo-terminals; simulate Modbus over TCP there instead"
            )
        import tty

        self._masters: list[int] = []
        self._slaves: list[int] = []
        for _ in range(2):
            master, slave = os.openpty()
            tty.setraw(slave)
            self._masters.append(master)
            # Kept open, so that a client that closes its end does not close the line.
            self._slaves.append(slave)
        self.near, self.far = (os.ttyname(slave) for slave in self._slaves)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._pump, name="sim-cable", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close both ends."""
        self._stopping.set()
        self._thread.join()
        for end in (*self._masters, *self._slaves):
            os.close(end)

    def _pump(self) -> None:
        first, second = self._masters
        other = {first: second, second: first}
        while not self._stopping.is_set():
            ready, _, _ = select.select(self._masters, [], [], _WAIT)
            for end in ready:
                os.write(other[end], os.read(end, _AT_ONCE))


_WRITE_ONE, _WRITE_MANY = 6, 16
_BAUDRATE = 115_200
"""Of a pseudo-terminal, which has no rate of its own; it has to be set to some value."""
_START_TIMEOUT = 5.0
"""s: a server starts within some tenths on a loaded machine."""

# A client that was killed is not reported at the simulation's terminal.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class SimulatedModbusLine:
    """One Modbus server with several instruments by unit id: over TCP, or RTU where ``serial``.

    ``up_to_date`` is entered on this line's thread before registers are read or written: it
    advances the simulation to the present time and locks it. With a ``clock`` the line is served in
    simulated time, over TCP within the process.
    """

    def __init__(
        self,
        instruments: Mapping[int, ModbusInstrument],
        up_to_date: Callable[[], Any],
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        serial: bool = False,
        clock: SimulatedClock | None = None,
    ) -> None:
        self._instruments = dict(instruments)
        self._up_to_date = up_to_date
        self._wanted = (host, port)
        self._loop = asyncio.new_event_loop() if clock is None else clock.event_loop()
        self._thread: threading.Thread | SimulatedThread = (
            threading.Thread(target=self._run, name="modbus-server", daemon=True)
            if clock is None
            else clock.thread(self._run, "modbus-server", device=True)
        )
        self._server: Any = None
        self._started = threading.Event() if clock is None else clock.event()
        self._failure: OSError | None = None
        self._serial = serial
        self._cable: PtyCable | None = None
        self.address = self._wanted
        """Host and port over TCP, once it serves."""
        self.port = ""
        """Path of the port on a serial line, once it serves."""

    def start(self) -> None:
        """Start serving; raises ConnectionLost where the address is in use."""
        if self._serial:
            self._cable = PtyCable()
            self.port = self._cable.far
        self._thread.start()
        self._started.wait(_START_TIMEOUT)
        host, port = self._wanted
        if self._server is None or self._failure is not None:
            self._thread.join(_START_TIMEOUT)
            reason = self._failure or "it did not start in time"
            raise ConnectionLost(
                f"cannot serve Modbus TCP on {host}:{port}: {reason}; choose another port"
            )

    def stop(self) -> None:
        """Close every connection and end the thread."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(_START_TIMEOUT)
        if self._cable is not None:
            self._cable.close()
            self._cable = None

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        except OSError as error:
            self._failure = error
        finally:
            self._started.set()
        if self._failure is None:
            self._loop.run_forever()
            self._loop.run_until_complete(self._close())
        self._loop.close()

    async def _serve(self) -> None:
        devices = [self._device(unit, one) for unit, one in self._instruments.items()]
        if 0 not in self._instruments:
            devices.append(_absent())
        if self._cable is not None:
            server: Any = ModbusSerialServer(
                devices, port=self._cable.near, baudrate=_BAUDRATE, ignore_missing_devices=True
            )
            await server.serve_forever(background=True)
            self._server = server
            return
        server = ModbusTcpServer(devices, address=self._wanted, ignore_missing_devices=True)
        try:
            await server.serve_forever(background=True)
        except RuntimeError as error:
            raise OSError("the address is in use or not of this machine") from error
        self.address = server.transport.sockets[0].getsockname()[:2]
        self._server = server

    async def _close(self) -> None:
        if self._server is not None:
            await self._server.shutdown()
        await asyncio.sleep(0.01)  # a request that has just arrived becomes a task a little later
        tasks = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _device(self, unit: int, instrument: ModbusInstrument) -> SimDevice:
        blocks = [SimData(at, values=0, datatype=DataType.REGISTERS) for at in instrument.addresses]

        async def act(*query: Any) -> ExcCodes | None:
            return await self._act(instrument, *query)

        return SimDevice(unit, simdata=blocks, action=act)

    async def _act(self, instrument: ModbusInstrument, *query: Any) -> ExcCodes | None:
        """Answer one query by the present state of the instrument."""
        function, start, address, count, registers, values = query
        if "silence" in instrument.faults:
            raise NoSuchIdException("the simulated instrument is silent")
        if "late reply" in instrument.faults:
            await asyncio.sleep(instrument.reply_delay)
        if "exception" in instrument.faults:
            return ExcCodes.DEVICE_FAILURE
        with self._up_to_date():
            if values is None:
                return _read(instrument, function, (start, count), registers)
            return _write(instrument, function, address, values)


def _read(
    instrument: ModbusInstrument,
    function: int,
    span: tuple[int, int],
    registers: list[int],
) -> ExcCodes | None:
    start, count = span
    spec = instrument.spec
    # The server reads back the registers that a function 6 has written.
    if function not in (spec.read.function, _WRITE_ONE):
        return ExcCodes.ILLEGAL_FUNCTION
    if count > spec.max_registers:
        return ExcCodes.ILLEGAL_VALUE
    if spec.read.fixed and count != spec.read.count:
        return ExcCodes.ILLEGAL_ADDRESS
    for at, content in instrument.registers().items():
        registers[at - start] = content
    return None


def _write(
    instrument: ModbusInstrument, function: int, address: int, values: list[int] | list[bool]
) -> ExcCodes | None:
    commands = instrument.spec.command.values()
    one_takes_six = not all(command.writes_many for command in commands)
    if function != _WRITE_MANY and not (function == _WRITE_ONE and one_takes_six):
        return ExcCodes.ILLEGAL_FUNCTION
    taken = instrument.command(address, *map(int, values))
    return None if taken else ExcCodes.ILLEGAL_VALUE


def _absent() -> SimDevice:
    """Stand-in for all units that do not exist, which do not answer."""

    async def silent(*_: Any) -> ExcCodes | None:
        raise NoSuchIdException("no such unit")

    everything = SimData(0, count=65_536, values=0, datatype=DataType.REGISTERS)
    return SimDevice(0, simdata=[everything], action=silent)

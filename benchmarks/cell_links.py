"""What a reading costs on each kind of line, beside plain pymodbus and minimalmodbus.

``python benchmarks/cell_links.py --seconds 5``: one JSON object on stdout. The far end is a program
of its own in another process; minimalmodbus comes with ``requirements-links.txt`` and is left out
where it is missing. CPU is of the reading process only.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.modbus.client import ModbusClient
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device

FAR_END = Path(__file__).with_name("cell_campaign") / "far_end.py"
START, COUNT = 6, 7
BAUDRATE = 115_200
Measured = dict[str, float]


@contextmanager
def far_end(kind: str) -> Iterator[str]:
    """A device in another process; yields its TCP port or the path of its serial port."""
    process = subprocess.Popen([sys.executable, FAR_END, kind], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def figures(done: int, seconds: float, cpu: float) -> Measured:
    """Transactions a second and CPU for each."""
    return {"per_second": round(done / seconds, 1), "cpu_us": round(cpu / done * 1e6, 1)}


async def repeat(once: Callable[[], Any], seconds: float) -> Measured:
    """Await something as often as there is time for."""
    for _ in range(20):
        await once()
    done, cpu, begin = 0, time.process_time(), time.perf_counter()
    while time.perf_counter() - begin < seconds:
        await once()
        done += 1
    return figures(done, time.perf_counter() - begin, time.process_time() - cpu)


async def ours(bus: BusSpec, seconds: float) -> Measured:
    """A whole reading: asked, checked, decoded, judged, published."""
    device = read_device(catalog.find("devices", "laumas-tlb"))
    assert device.modbus is not None
    fast = replace(device, modbus=replace(device.modbus, rate=1e6))
    instrument = Instrument("cell", fast, 1, MonotonicClock(), rate=1e6, timeout=bus.timeout)
    client = ModbusClient(bus, "line")
    await client.connect()
    try:
        found = await repeat(lambda: instrument.poll(client), seconds)
    finally:
        client.close()
    assert instrument.counters.timeouts == 0
    return found


async def pymodbus_async(bus: BusSpec, seconds: float) -> Measured:
    """Registers only."""
    from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

    client: Any
    if bus.kind == "modbus-tcp":
        client = AsyncModbusTcpClient(bus.host or "", port=int(bus.port or 0))
    else:
        client = AsyncModbusSerialClient(str(bus.port), baudrate=bus.baudrate)
    await client.connect()
    try:
        return await repeat(
            lambda: client.read_holding_registers(START, count=COUNT, device_id=1), seconds
        )
    finally:
        client.close()


def pymodbus_sync(bus: BusSpec, seconds: float) -> Measured:
    """Registers only, its blocking client."""
    from pymodbus.client import ModbusSerialClient, ModbusTcpClient

    client: Any
    if bus.kind == "modbus-tcp":
        client = ModbusTcpClient(bus.host or "", port=int(bus.port or 0))
    else:
        client = ModbusSerialClient(str(bus.port), baudrate=bus.baudrate)
    client.connect()
    try:
        return blocking(
            lambda: client.read_holding_registers(START, count=COUNT, device_id=1), seconds
        )
    finally:
        client.close()


def minimalmodbus(bus: BusSpec, seconds: float) -> Measured | None:
    """Registers only; it knows serial lines alone."""
    if bus.kind == "modbus-tcp":
        return None
    try:
        import minimalmodbus as library
    except ImportError:
        return None
    instrument = library.Instrument(str(bus.port), 1)
    instrument.serial.baudrate = bus.baudrate
    instrument.serial.timeout = 1.0
    try:
        return blocking(lambda: instrument.read_registers(START, COUNT), seconds)
    finally:
        instrument.serial.close()


def blocking(once: Callable[[], Any], seconds: float) -> Measured:
    """Call something as often as there is time for."""
    for _ in range(5):
        once()
    done, cpu, begin = 0, time.process_time(), time.perf_counter()
    while time.perf_counter() - begin < seconds:
        once()
        done += 1
    return figures(done, time.perf_counter() - begin, time.process_time() - cpu)


def measure(kind: str, seconds: float) -> dict[str, Measured | None]:
    """Every reader on one kind of line, one after the other."""
    found: dict[str, Measured | None] = {}
    readers: dict[str, Callable[[BusSpec], Measured | None]] = {
        "winchkit": lambda bus: asyncio.run(ours(bus, seconds)),
        "pymodbus async": lambda bus: asyncio.run(pymodbus_async(bus, seconds)),
        "pymodbus sync": lambda bus: pymodbus_sync(bus, seconds),
        "minimalmodbus": lambda bus: minimalmodbus(bus, seconds),
    }
    for name, reader in readers.items():
        with far_end(kind) as where:
            if kind == "tcp":
                bus = BusSpec("modbus-tcp", host="127.0.0.1", port=int(where), timeout=1.0)
            else:
                bus = BusSpec("modbus-rtu", port=where, baudrate=BAUDRATE, timeout=1.0)
            found[name] = reader(bus)
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    arguments = parser.parse_args()
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    found = {kind: measure(kind, arguments.seconds) for kind in ("tcp", "rtu over a pty")}
    print(json.dumps({"schema": 1, "registers": COUNT, **found}))


if __name__ == "__main__":
    main()

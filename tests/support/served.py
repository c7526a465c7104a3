"""A simulated cell behind a real Modbus server, converting with the machine's clock."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

from winchkit import catalog
from winchkit.schema.devices.modbus import ModbusSpec
from winchkit.schema.read import read_device
from winchkit.sim.instruments.modbus import ModbusInstrument, in_unit_of
from winchkit.sim.instruments.modbus_line import SimulatedModbusLine

BENCH = """\
schema = 1
kind = "bench"
name = "cells"

[bus.can]
kind = "can"
interface = "virtual"
channel = "nobody"

[bus.cells]
{bus}

[winch.A]
profile = "bench-spiral"
servo = {{ device = "generic-cia402", bus = "can", node = 1, encoder = "absolute" }}
cell = {{ device = "{device}", bus = "cells", unit = 1{more} }}

[winch.A.limits]
speed = "0.5 m/s"
"""


def spec_of(device: str) -> ModbusSpec:
    found = read_device(catalog.find("devices", device)).modbus
    assert found is not None
    return found


class Served:
    """One cell at unit 1, over TCP or at a pseudo-terminal; ``force`` is what hangs on it, N."""

    def __init__(
        self, device: str, *, serial: bool = False, noise: float = 0.3, force: float = 100.0
    ) -> None:
        self.device, self.force, self.noise, self.serial = device, force, noise, serial
        self._random, self._lock = Random(3), threading.Lock()
        spec = spec_of(device)
        # Switched on before anybody asks: its first conversion is through its filter.
        on = time.monotonic() - 1.0
        self.cell = ModbusInstrument(spec, in_unit_of(spec, self._measure), now=on)
        self.line = SimulatedModbusLine({1: self.cell}, self._up_to_date, serial=serial)

    def __enter__(self) -> Served:
        self.line.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.line.stop()

    def bench(self, folder: Path, more: str = "") -> Path:
        """A bench file that leads here."""
        if self.serial:
            bus = f'kind = "modbus-rtu"\nport = "{self.line.port}"'
        else:
            host, port = self.line.address
            bus = f'kind = "modbus-tcp"\nhost = "{host}"\nport = {port}'
        path = folder / "bench.toml"
        path.write_text(BENCH.format(bus=bus, device=self.device, more=more))
        return path

    def _measure(self) -> float:
        return self.force + self._random.gauss(0, self.noise)

    @contextmanager
    def _up_to_date(self) -> Iterator[None]:
        with self._lock:
            now = time.monotonic()
            while self.cell.next_conversion <= now:
                self.cell.convert()
            self.cell.show(now)
            yield

"""Drives and load cells of ``soak.py``, in a process of their own."""

from __future__ import annotations

import os
import select
import socket
import sys
import time
from contextlib import nullcontext, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from winchkit.catalog import find
from winchkit.schema.read import read_device
from winchkit.sim.instruments.modbus import ModbusInstrument, in_unit_of
from winchkit.sim.instruments.modbus_line import SimulatedModbusLine

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support"))

from slave import Declared, Slave
from slave.frames import Frame

_EDS = Path(__file__).parents[1] / "devices" / "generic-cia402" / "generic-cia402.eds"
_STEP = 2e-3
_PRIORITY = 60
_TENSION = 100.0


class Wire:
    """A CAN bus of two ends as a pair of datagram sockets: cheap enough for a long run."""

    def __init__(self, own: str, other: str) -> None:
        self._other = other
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
        self._socket.bind(own)

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Next frame; raises OSError."""
        if not select.select([self._socket], [], [], timeout)[0]:
            return None
        data = self._socket.recv(16)
        return int.from_bytes(data[:2], "little"), data[2:]

    def transmit(self, identifier: int, data: bytes) -> None:
        """Send a frame; it is lost where the other end is not there."""
        with suppress(FileNotFoundError, ConnectionRefusedError):
            self._socket.sendto(identifier.to_bytes(2, "little") + data, self._other)

    def send(self, message: Any, timeout: float | None = None) -> None:
        """Send a message of python-can."""
        self.transmit(message.arbitration_id, bytes(message.data))

    def close(self) -> None:
        """Let it go."""
        self._socket.close()


def serve(ours: Connection, winches: int, path: str, host: str, realtime: bool) -> None:
    """Serve until asked to end; first says at which port the cells are.

    ``path`` is the datagram socket of the drives, ``host`` the bench's. In ``realtime`` the drives
    have a priority above the bench's, where it is permitted: hardware is not late.
    """
    if realtime:
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    sys.setswitchinterval(5e-4)  # the cells' server is a thread beside the drives
    device = read_device(find("devices", "laumas-tlb"))
    assert device.modbus is not None
    now = time.monotonic()
    cells = {
        unit: ModbusInstrument(device.modbus, in_unit_of(device.modbus, lambda: _TENSION), now=now)
        for unit in range(1, winches + 1)
    }
    line = SimulatedModbusLine(cells, nullcontext)
    line.start()
    slaves = [
        Slave.from_file(_EDS, node, declared=Declared(disabled_deceleration=1000.0))
        for node in range(1, winches + 1)
    ]
    bus = Wire(path, host)
    ours.send(line.address[1])
    last = time.monotonic()
    try:
        while not ours.poll():
            message = bus.receive(_STEP)
            now = time.monotonic()
            frames = []
            if now - last >= _STEP:
                for slave in slaves:
                    frames += slave.advance(now - last)
                last = now
                _convert(list(cells.values()), now)
            if message is not None:
                frame = Frame(*message)
                node = frame.identifier & 0x7F
                shared = frame.identifier <= 0x080 or frame.identifier > 0x700
                for slave in slaves if shared else slaves[node - 1 : node]:
                    frames += slave.receive(frame)
            for identifier, data, _ in frames:
                bus.transmit(identifier, data)
    finally:
        line.stop()
        bus.close()


def _convert(cells: list[ModbusInstrument], now: float) -> None:
    for cell in cells:
        cell.convert()
        cell.show(now + 1.0)

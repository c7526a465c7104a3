"""A cell of a Modbus TCP peer: made, loaded, polled, and its readings collected."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from modbus_peer import Peer
from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.reading import InstrumentReading
from winchkit.drivers.slow import SlowDevices
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device

CLOCK = MonotonicClock()


PATIENT = 1.0
"""Timeout of tests in which no answer is to be missed, on a busy computer either, s."""


def cell(unit: int = 1, timeout: float = 0.1) -> Instrument:
    spec = read_device(catalog.find("devices", "laumas-tlb"))
    return Instrument(f"cell {unit}", spec, unit, CLOCK, rate=100.0, timeout=timeout)


def weigh(peer: Peer, counts: int, status: int = 1 << 11) -> None:
    peer.registers[6] = status
    for register in (7, 9):
        peer.registers[register], peer.registers[register + 1] = counts >> 16, counts & 0xFFFF


@contextmanager
def polled(peer: Peer, *instruments: Instrument, timeout: float = 0.1) -> Iterator[SlowDevices]:
    spec = BusSpec("modbus-tcp", host="127.0.0.1", port=peer.port, timeout=timeout)
    slow = SlowDevices([ModbusLine("cells", spec, instruments, CLOCK)])
    try:
        yield slow
    finally:
        slow.close()


def collected(instrument: Instrument) -> list[InstrumentReading]:
    readings: list[InstrumentReading] = []
    instrument.listeners.append(readings.append)
    return readings

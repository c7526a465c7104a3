"""Modbus and serial lines with their instruments, made from a declaration that can be sent."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from winchkit.drivers.clock import Clock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.stream.instrument import StreamInstrument
from winchkit.drivers.stream.line import StreamLine
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.device import DeviceSpec

Line = ModbusLine | StreamLine


@dataclass(frozen=True)
class InstrumentSpec:
    """An instrument on a line."""

    label: str
    """Name in messages."""
    device: DeviceSpec
    unit: int | None
    """Address on the line, None where the line needs none."""
    rate: float | None
    """Most readings a second that are wanted; None for those of the device."""


@dataclass(frozen=True)
class LineSpec:
    """A Modbus or serial line and its instruments."""

    bus: str
    """Name of the bus."""
    spec: BusSpec
    instruments: tuple[InstrumentSpec, ...]


def line_of(line: LineSpec, clock: Clock) -> Line:
    """Make a line, not opened yet; its instruments have the order of the declaration.

    Raises FileError where a device file contradicts itself, or a device that sends by itself is
    not alone on its line.
    """
    bus = line.spec
    if bus.kind == "serial":
        streams = tuple(
            StreamInstrument(
                one.label, one.device, one.unit, clock, timeout=bus.timeout, rate=one.rate or inf
            )
            for one in line.instruments
        )
        return StreamLine(line.bus, bus, streams, clock)
    registers = tuple(
        Instrument(
            one.label, one.device, one.unit or 1, clock, timeout=bus.timeout, rate=one.rate or inf
        )
        for one in line.instruments
    )
    return ModbusLine(line.bus, bus, registers, clock)

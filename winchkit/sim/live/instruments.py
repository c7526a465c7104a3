"""Simulated instruments of a winch by role, and the lines on which they answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from winchkit.catalog import find
from winchkit.errors import FileError, UsageError
from winchkit.schema.bench import BusSpec, DeviceRef, WinchWiring
from winchkit.schema.devices.device import DeviceSpec
from winchkit.sim.clock.lines import SimulatedSerialLine
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.instruments.instrument import in_unit
from winchkit.sim.instruments.modbus import ModbusInstrument, in_unit_of
from winchkit.sim.instruments.modbus_line import SimulatedModbusLine
from winchkit.sim.instruments.process import SimulatedProcessInstrument
from winchkit.sim.instruments.stream import SimulatedStreamInstrument, shown_by
from winchkit.sim.instruments.stream_line import SimulatedStreamLine

Instrument = ModbusInstrument | SimulatedStreamInstrument | SimulatedProcessInstrument
Send = Callable[[int, bytes], None]
"""Sends an identifier and data to a CAN bus."""


def instruments_of(
    wiring: WinchWiring,
    beside: str,
    quantities: Mapping[str, Callable[[], float]],
    send: Send,
    *,
    now: float,
) -> dict[str, Instrument]:
    """Instruments by role; ``quantities`` return the measured quantity of each, SI."""
    found: dict[str, Instrument] = {}
    for role, measure in quantities.items():
        ref: DeviceRef | None = getattr(wiring, role)
        if ref is not None:
            found[role] = _instrument(ref, beside, measure, send, now)
    return found


def device_of(ref: DeviceRef, beside: str) -> tuple[Path, DeviceSpec]:
    """Path and content of a device file to which a bench file refers."""
    from winchkit.schema.read import read_device

    path = find("devices", ref.device, beside=beside or None)
    return path, read_device(path)


def _instrument(
    ref: DeviceRef, beside: str, measure: Callable[[], float], send: Send, now: float
) -> Instrument:
    path, device = device_of(ref, beside)
    if device.modbus is not None:
        return ModbusInstrument(device.modbus, in_unit_of(device.modbus, measure), now=now)
    if device.stream is not None:
        shown = shown_by(device.stream, measure)
        return SimulatedStreamInstrument(device.stream, shown, now=now, address=ref.unit)
    if device.process is not None and ref.node is not None:
        spec, shown = device.process, in_unit(device.process.unit, measure)
        return SimulatedProcessInstrument(
            spec, path.parent / spec.eds, ref.node, shown, send, now=now
        )
    raise FileError(f"{path}: '{ref.device}' is not an instrument that can be simulated here")


Line = SimulatedModbusLine | SimulatedStreamLine | SimulatedSerialLine


class Placed(NamedTuple):
    """An instrument and its address on a bus."""

    where: str
    """Winch and role, for messages."""
    ref: DeviceRef
    instrument: Instrument


def open_line(
    bus: BusSpec,
    placed: Iterable[Placed],
    up_to_date: Callable[[], AbstractContextManager[None]],
    time: Callable[[], float] | SimulatedClock,
) -> tuple[Line, BusSpec]:
    """Serve the instruments of one bus; returns the line, and the bus for the user.

    Modbus is served over TCP whatever the declaration has, a serial line at a pseudo-terminal; in
    simulated time, where ``time`` is such a clock, both are within the process. Raises UsageError
    where two instruments share an address, ConnectionLost where the bus cannot be served.
    """
    instruments = list(placed)
    _refuse_shared(instruments)
    if bus.kind == "serial":
        streams = [
            one.instrument
            for one in instruments
            if isinstance(one.instrument, SimulatedStreamInstrument)
        ]
        stream_line = (
            SimulatedSerialLine(streams, up_to_date, time)
            if isinstance(time, SimulatedClock)
            else SimulatedStreamLine(streams, up_to_date, time)
        )
        stream_line.start()
        return stream_line, replace(bus, port=stream_line.port)
    units = {
        one.ref.unit: one.instrument
        for one in instruments
        if isinstance(one.instrument, ModbusInstrument) and one.ref.unit is not None
    }
    clock = time if isinstance(time, SimulatedClock) else None
    modbus_line = SimulatedModbusLine(units, up_to_date, clock=clock)
    modbus_line.start()
    host, port = modbus_line.address
    return modbus_line, BusSpec("modbus-tcp", host=host, port=port, timeout=bus.timeout)


def _refuse_shared(instruments: list[Placed]) -> None:
    taken: set[int | None] = set()
    for one in instruments:
        alone = isinstance(one.instrument, SimulatedStreamInstrument) and len(instruments) == 1
        if one.ref.unit in taken or (one.ref.unit is None and not alone):
            raise UsageError(f"{one.where} needs a unit of its own on the bus '{one.ref.bus}'")
        taken.add(one.ref.unit)

"""Lines of the instruments of a live simulated bench: a server or a pseudo-terminal for each."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import NamedTuple

from winchkit.errors import UsageError
from winchkit.schema.bench import BusSpec, DeviceRef
from winchkit.sim.clock.serial_line import SimulatedSerialLine
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.instruments.modbus import ModbusInstrument
from winchkit.sim.instruments.modbus_line import ModbusLine
from winchkit.sim.instruments.stream import StreamInstrument
from winchkit.sim.instruments.stream_line import StreamLine
from winchkit.sim.live.instruments import Instrument

Line = ModbusLine | StreamLine | SimulatedSerialLine


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
            one.instrument for one in instruments if isinstance(one.instrument, StreamInstrument)
        ]
        stream_line = (
            SimulatedSerialLine(streams, up_to_date, time)
            if isinstance(time, SimulatedClock)
            else StreamLine(streams, up_to_date, time)
        )
        stream_line.start()
        return stream_line, replace(bus, port=stream_line.port)
    units = {
        one.ref.unit: one.instrument
        for one in instruments
        if isinstance(one.instrument, ModbusInstrument) and one.ref.unit is not None
    }
    clock = time if isinstance(time, SimulatedClock) else None
    modbus_line = ModbusLine(units, up_to_date, clock=clock)
    modbus_line.start()
    host, port = modbus_line.address
    return modbus_line, BusSpec("modbus-tcp", host=host, port=port, timeout=bus.timeout)


def _refuse_shared(instruments: list[Placed]) -> None:
    taken: set[int | None] = set()
    for one in instruments:
        alone = isinstance(one.instrument, StreamInstrument) and len(instruments) == 1
        if one.ref.unit in taken or (one.ref.unit is None and not alone):
            raise UsageError(f"{one.where} needs a unit of its own on the bus '{one.ref.bus}'")
        taken.add(one.ref.unit)

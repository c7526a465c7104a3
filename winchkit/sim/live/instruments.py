"""Simulated instruments of a winch by role, as their device files declare them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from winchkit.catalog import find
from winchkit.errors import FileError
from winchkit.schema.bench import DeviceRef, WinchWiring
from winchkit.schema.devices.device import DeviceSpec
from winchkit.sim.instruments.modbus import ModbusInstrument, in_unit_of
from winchkit.sim.instruments.process import ProcessInstrument
from winchkit.sim.instruments.stream import StreamInstrument, shown_by
from winchkit.units import dimension_of, factor

Instrument = ModbusInstrument | StreamInstrument | ProcessInstrument
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
    """Instruments by role; ``quantities`` return the measured quantity of each role, SI.

    ``send`` is for instruments on the CAN bus of the servo.
    """
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
        return StreamInstrument(device.stream, shown, now=now, address=ref.unit)
    if device.process is not None and ref.node is not None:
        spec = device.process
        size = factor(spec.unit, dimension_of(spec.unit) or "")
        return ProcessInstrument(
            spec, path.parent / spec.eds, ref.node, lambda: measure() / size, send, now=now
        )
    raise FileError(f"{path}: '{ref.device}' is not an instrument that can be simulated here")

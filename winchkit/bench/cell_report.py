"""Facts about an instrument of a bench: who it is, how it is read, how fast and why."""

from __future__ import annotations

import dataclasses
from itertools import pairwise
from typing import Any

from winchkit.bench.cell_desk import CellDesk
from winchkit.bench.instruments import READ_RATE, calibration_of
from winchkit.drivers.modbus.timing import exchange
from winchkit.drivers.reading import Counters
from winchkit.schema.device import DeviceSpec

__all__ = ["about", "rate_report"]

_SERIAL = "serial number"
_WORTH_TELLING = 1.5


def about(desk: CellDesk, name: str) -> dict[str, Any]:
    """Everything that is known of an instrument; raises what keeps it from answering."""
    ref, device = desk.ref(name), desk.device(name)
    reading = desk.first_reading(name)
    identity = desk.identify(name)
    calibration = calibration_of(desk.spec, ref)
    sensor, scale = desk.sensors[name], desk.publisher(name).scale
    remarks = _link_remarks(desk, name, device)
    serial = str(int(identity[_SERIAL])) if _SERIAL in identity else ""
    if calibration and serial and calibration.serial_number not in ("", serial):
        remarks.append(
            f"the calibration is of serial number {calibration.serial_number}, this device "
            f"says {serial}: calibrate it, or name its own file"
        )
    return {
        "cell": name,
        "device": {
            key: getattr(device, key) for key in ("name", "maker", "model", "source", "trust")
        },
        "identity": identity,
        "calibration": f"{calibration.name} of {calibration.date}" if calibration else None,
        "coefficients": scale.coefficients,
        "tare": {"host": scale.tare, "device": sensor.tared},
        "reading": {
            "value": reading.value,
            "gross": reading.gross,
            "raw": reading.raw,
            "quality": str(reading.quality),
        },
        "timing": {
            "age": reading.t_receive - reading.t_sample,
            "uncertainty": reading.t_uncertainty,
            "filter": _filter_delay(device),
            "latency": reading.t_receive - reading.t_request,
        },
        "counters": counters_told(sensor.counters),
        "remarks": remarks,
    }


def counters_told(counters: Counters) -> dict[str, int]:
    """The counters that are no rate and no time."""
    return {
        field.name: value
        for field in dataclasses.fields(counters)
        if isinstance(value := getattr(counters, field.name), int)
    }


def rate_report(desk: CellDesk, name: str, duration: float) -> dict[str, Any]:
    """The rate that an instrument is read at, measured for ``duration`` s, and what limits it."""
    sensor, device, ref = desk.sensors[name], desk.device(name), desk.ref(name)
    readings = desk.readings(name, duration)
    measured = (len(readings) - 1) / (readings[-1].t_receive - readings[0].t_receive)
    duplicates = sum(a.raw == b.raw for a, b in pairwise(readings))
    wanted = ref.rate or READ_RATE
    limits = {"asked for in the wiring" if ref.rate else "winchkit's usual rate": wanted}
    facts: dict[str, Any] = {}
    if device.modbus is not None:
        limits["the device's conversions"] = device.modbus.rate
        facts = _exchange(desk, name, device)
        limits[f"the line, shared by {facts['sharing']}"] = facts["line_rate"]
    elif device.stream is not None:
        if device.stream.mode == "continuous":
            limits = {}
        limits["the device's output"] = device.stream.rate
    elif device.process is not None:
        limits["the device's conversions"] = device.process.rate
    limit = min(limits, key=lambda key: limits[key])
    counters = sensor.counters
    return {
        "cell": name,
        "rate": measured,
        "planned": 1 / sensor.period,
        "limited_by": limit,
        "limits": limits,
        "exchange": facts,
        "duplicates": duplicates / max(1, len(readings) - 1),
        "latency": dataclasses.asdict(counters.latency),
        "counters": counters_told(counters),
        "advice": _advice(limit, limits, measured, 1 / sensor.period),
    }


def _exchange(desk: CellDesk, name: str, device: DeviceSpec) -> dict[str, Any]:
    """What one reading costs on its line, and what the line has room for."""
    bus = desk.spec.bus[desk.line(name)]
    assert device.modbus is not None, "asked for a Modbus device only"
    cost = exchange(device.modbus, bus)
    sharing = [other for other in desk.sensors if desk.line(other) == desk.line(name)]
    return {
        "bytes": cost.bytes,
        "queries": cost.queries,
        "wire": cost.wire,
        "silence": cost.silence,
        "turnaround": cost.turnaround,
        "baudrate": None if bus.kind == "modbus-tcp" else bus.baudrate,
        "sharing": len(sharing),
        "line_rate": desk.line_rate(name),
    }


def _advice(limit: str, limits: dict[str, float], measured: float, planned: float) -> str:
    if planned > _WORTH_TELLING * measured:
        return "it is read more slowly than planned: look at timeouts, CRC errors and latency"
    if limit.startswith("the line"):
        return "raise the baud rate, read fewer registers, or give the cell a line of its own"
    others = min((value for key, value in limits.items() if key != limit), default=0.0)
    if limit.startswith("winchkit") and others > _WORTH_TELLING * limits[limit]:
        return f'write rate = "{others:.3g} Hz" beside the cell in the wiring for all there is'
    return ""


def _filter_delay(device: DeviceSpec) -> float:
    for table in (device.modbus, device.stream, device.process):
        if table is not None:
            return float(table.filter_delay)
    return 0.0


def _link_remarks(desk: CellDesk, name: str, device: DeviceSpec) -> list[str]:
    """Where the wiring differs from the device's factory setting: the first thing to look at."""
    bus = desk.spec.bus[desk.line(name)]
    if device.modbus is None or device.modbus.link is None or bus.kind != "modbus-rtu":
        return []
    link = device.modbus.link
    return [
        f"the line is set to {key} {getattr(bus, key)}, the device leaves its factory with "
        f"{getattr(link, key)}"
        for key in ("baudrate", "parity", "stopbits")
        if getattr(bus, key) != getattr(link, key)
    ]

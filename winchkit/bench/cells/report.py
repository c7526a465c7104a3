"""Facts about an instrument of a bench: who it is, how it is read, how fast and why."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from winchkit.bench.cells.desk import CellDesk
from winchkit.bench.cells.instruments import calibration_of
from winchkit.drivers.counters import Counters
from winchkit.drivers.modbus.timing import exchange
from winchkit.schema.calibration import CellCalibration
from winchkit.schema.devices.device import DeviceSpec

_SERIAL = "serial number"
_WORTH_TELLING = 1.5
"""Ratio of planned and measured rate: indicators offer rates by factors of about two, so that a
smaller ratio is no other setting."""


def about(desk: CellDesk, name: str) -> dict[str, Any]:
    """Everything that is known of an instrument; raises what keeps it from answering."""
    ref, device = desk.ref(name), desk.device(name)
    table = device.instrument
    reading = desk.first_reading(name)
    identity = desk.identify(name)
    calibration = calibration_of(desk.spec, ref)
    sensor, scale = desk.sensors[name], desk.publisher(name).scale
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
            "filter": 0.0 if table is None else float(table.filter_delay),
            "latency": reading.t_receive - reading.t_request,
        },
        "counters": counters_told(sensor.counters),
        "remarks": [*_link_remarks(desk, name, device), *_doubts(device, identity, calibration)],
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
    sensor = desk.sensors[name]
    readings = desk.readings(name, duration)
    measured = (len(readings) - 1) / (readings[-1].t_receive - readings[0].t_receive)
    duplicates = sum(a.raw == b.raw for a, b in pairwise(readings))
    limits, facts, by_itself = _limits(desk, name)
    limit = min(limits, key=lambda key: limits[key])
    counters = sensor.counters
    return {
        "cell": name,
        "rate": measured,
        "planned": 1 / sensor.period,
        "by_itself": by_itself,
        "limited_by": limit,
        "limits": limits,
        "exchange": facts,
        "duplicates": duplicates / max(1, len(readings) - 1),
        "latency": dataclasses.asdict(counters.latency),
        "counters": counters_told(counters),
        "advice": _advice(limit, measured, 1 / sensor.period, by_itself=by_itself),
    }


def _limits(desk: CellDesk, name: str) -> tuple[dict[str, float], dict[str, Any], bool]:
    """Rates that bound an instrument's, time of a reading, and whether it sends by itself."""
    device, cap = desk.device(name), desk.ref(name).rate
    table = device.instrument
    assert table is not None, "every instrument has one of them"
    stream, process = device.stream, device.process
    if (stream and stream.mode == "continuous") or (process and process.tpdo):
        return {"the device, which sends by itself": table.rate}, {}, True
    limits = {"the device's conversions": table.rate}
    if cap is not None:
        limits["`rate` in the wiring"] = cap
    line, sharing = desk.line_rate(name), desk.sharing(name)
    facts: dict[str, Any] = {}
    if line is not None:
        limits["the line" + (f", shared by {sharing}" if sharing > 1 else "")] = line
        facts = {"sharing": sharing, "line_rate": line, "time": desk.line_time(name)}
    if device.modbus is not None:
        cost = exchange(device.modbus, desk.spec.bus[desk.line(name)])
        facts |= dataclasses.asdict(cost)
    bus = desk.spec.bus[desk.line(name)]
    facts["baudrate"] = bus.baudrate if bus.kind in ("modbus-rtu", "serial") else None
    return limits, facts, False


def _advice(limit: str, measured: float, planned: float, *, by_itself: bool) -> str:
    strays = not 1 / _WORTH_TELLING < measured / planned < _WORTH_TELLING
    if by_itself:
        return (
            f"its device file says {planned:g} a second: correct `rate` there, or the device's own "
            "setting; what is stale and when a value was sampled are reckoned from it"
            if strays
            else ""
        )
    if planned > _WORTH_TELLING * measured:
        return "it is read more slowly than planned: look at timeouts, CRC errors and latency"
    if limit.startswith("the line"):
        return "raise the baud rate, read fewer registers, or give the cell a line of its own"
    return ""


def _link_remarks(desk: CellDesk, name: str, device: DeviceSpec) -> list[str]:
    """Effects of the line on its readings, and differences from the factory's setting."""
    note = desk.line_note(name)
    told = [note] if note else []
    bus = desk.spec.bus[desk.line(name)]
    if device.modbus is None or device.modbus.link is None or bus.kind != "modbus-rtu":
        return told
    link = device.modbus.link
    return told + [
        f"the line is set to {key} {getattr(bus, key)}, the device leaves its factory with "
        f"{getattr(link, key)}"
        for key in ("baudrate", "parity", "stopbits")
        if getattr(bus, key) != getattr(link, key)
    ]


def _doubts(
    device: DeviceSpec, identity: Mapping[str, float], calibration: CellCalibration | None
) -> list[str]:
    """Values without a source, and a calibration that is of another device."""
    told = [
        f"its device file has no source for {what}: compare with the manual"
        for what in device.unconfirmed
    ]
    serial = str(int(identity[_SERIAL])) if _SERIAL in identity else ""
    if calibration and serial and calibration.serial_number not in ("", serial):
        told.append(
            f"the calibration is of serial number {calibration.serial_number}, this device "
            f"says {serial}: calibrate it, or name its own file"
        )
    return told

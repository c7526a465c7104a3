"""What ``winchkit check`` says of CANopen devices: a device file against its EDS; a bench's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

from winchkit.errors import Fault, NotPermitted
from winchkit.schema.bench import BenchSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.simbench import SimBench

if TYPE_CHECKING:
    from winchkit.schema.devices.servo import ServoSpec

_EXAMPLE = 100.0
"""rpm: a speed of which the number is easily compared with the manual's."""


@dataclass(frozen=True)
class DriveReport:
    """Faults and remarks on the drives of a declaration."""

    faults: tuple[Fault, ...] = ()
    warnings: tuple[Fault, ...] = ()
    details: tuple[str, ...] = ()


def report_of(value: object) -> DriveReport:
    """Check the device file of a CANopen device, or all those of a bench. Raises FileError."""
    if isinstance(value, SimBench):
        return _of_bench(value.bench)
    if isinstance(value, BenchSpec):
        found = _of_bench(value)
        return replace(found, warnings=(*found.warnings, *_not_commissioned(value)))
    if not isinstance(value, DeviceSpec) or value.kind not in ("servo", "process"):
        return DriveReport()
    from winchkit.drivers.can.canopen.device_check import check_drive, check_process

    if value.process is not None:
        instrument = check_process(value)
        return DriveReport(instrument.faults, instrument.warnings)
    report = check_drive(value)
    ways = ", ".join(f"{one.way} ({one.reaction})" for one in report.host_loss)
    faults, details = report.faults, [f"loss of the host, by the EDS: {ways or 'no way'}"]
    if value.servo is not None:
        try:
            details.append(_units_of(value.servo))
        except NotPermitted as error:
            faults = (*faults, Fault(str(error), value.path))
    return DriveReport(faults, report.warnings, tuple(details))


def _units_of(servo: ServoSpec) -> str:
    """An example of the units of a device file, to be compared with the manual."""
    from winchkit.drivers.can.cia402.units import Units, scale_of

    scale = scale_of(Units(), servo)
    turn, speed = 2 * pi / scale.angle, _EXAMPLE * 2 * pi / 60 / scale.velocity
    unless = "" if servo.units == "file" else ", unless its objects 608Fh to 60A9h say otherwise"
    return (
        f"units: a motor turn is {turn:.9g} of 6064h, {_EXAMPLE:g} rpm are {speed:.9g} of 606Ch "
        f"({servo.speed_unit}){unless}"
    )


def _not_commissioned(spec: BenchSpec) -> list[Fault]:
    """Items of the commissioning record that are not valid, of a bench with real drives."""
    from winchkit.bench.commissioning.record import is_simulated, stale_items

    if is_simulated(spec):
        return []
    return [
        Fault(f"not commissioned: {item}; run `winchkit commission {spec.path}`", spec.path)
        for item in stale_items(spec)
    ]


def _of_bench(spec: BenchSpec) -> DriveReport:
    """All that a check of each device file says, and how each winch notices a dead host."""
    from winchkit.catalog import find
    from winchkit.drivers.can.bus.interface import sends_remote
    from winchkit.drivers.can.canopen.device_check import (
        check_drive,
        check_process,
        host_loss_problem,
    )
    from winchkit.schema.read import load

    faults: dict[Fault, None] = {}
    warnings: dict[Fault, None] = {}
    details = []
    for name, winch in spec.winch.items():
        declaration = load(find("devices", winch.servo.device, spec.path or None))
        device = declaration.value
        if not isinstance(device, DeviceSpec) or device.servo is None:
            continue
        report = check_drive(device)
        faults |= dict.fromkeys(report.faults)
        way = winch.host_loss or device.servo.host_loss
        doubt = host_loss_problem(report.host_loss, way)
        if doubt and not report.host_loss:
            faults[Fault(f"winch {name}, device '{device.name}': {doubt}", spec.path)] = None
        else:
            warnings |= dict.fromkeys(declaration.warnings + report.warnings)
        if way == "guarding" and not sends_remote(spec.bus[winch.servo.bus]):
            adapter = spec.bus[winch.servo.bus].interface
            said = f"winch {name}: guarding needs remote frames, which '{adapter}' does not send"
            faults[Fault(said, spec.path)] = None
        found = next((one.reaction for one in report.host_loss if one.way == way), "")
        details.append(f"winch {name}: loss of the host by {way}{f': {found}' if found else ''}")
        for ref in (winch.cell, winch.load, winch.length, winch.temperature):
            if ref is not None:
                instrument = load(find("devices", ref.device, spec.path or None))
                warnings |= dict.fromkeys(instrument.warnings)
                if isinstance(instrument.value, DeviceSpec):
                    read = check_process(instrument.value)
                    faults |= dict.fromkeys(read.faults)
                    warnings |= dict.fromkeys(read.warnings)
    return DriveReport(tuple(faults), tuple(warnings), tuple(details))

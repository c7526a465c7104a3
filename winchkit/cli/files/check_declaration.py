"""What ``winchkit check`` says of a file by itself: declarations, and an EDS or DCF."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite, pi
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit import wings
from winchkit.catalog import find
from winchkit.errors import Fault, NotPermitted
from winchkit.model.capacity import drum_warnings, safe_lengths
from winchkit.model.guide import guide_warnings
from winchkit.schema.bench import BenchSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import Declared, load, read_winch
from winchkit.schema.reading.source import open_source
from winchkit.schema.simbench import SimBench

if TYPE_CHECKING:
    from winchkit.drivers.can.canopen.description import DriveDescription, PdoEntry
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
    alike: dict[str, list[str]] = {}
    for one in report.host_loss:
        alike.setdefault(one.reaction, []).append(one.way)
    ways = "; ".join(f"{' or '.join(own)}: {reaction}" for reaction, own in alike.items())
    silent = f"if the computer falls silent, by the EDS: {ways or 'not noticed'}"
    faults, details = report.faults, [silent]
    if value.servo is not None:
        try:
            details.append(_units_of(value.servo))
        except NotPermitted as error:
            faults = (*faults, Fault(str(error), value.path))
    return DriveReport(faults, report.warnings, tuple(details))


def _units_of(servo: ServoSpec) -> str:
    """An example of the units of a device file, to be compared with the manual."""
    from winchkit.drivers.can.cia402.units import UnitObjects, scale_of

    scale = scale_of(UnitObjects(), servo)
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
    from winchkit.drivers.can.bus.interface import sends_remote
    from winchkit.drivers.can.canopen.device_check import (
        check_drive,
        check_process,
        host_loss_problem,
    )

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
        noticed = f"{_SILENT} by {way}{f': {found}' if found else ''}"
        by_hardware = "if the computer falls silent, hardware stops the winch"
        details.append(f"winch {name}: {by_hardware if way == 'hardware' else noticed}")
        for ref in (winch.cell, winch.load, winch.length, winch.temperature):
            if ref is not None:
                instrument = load(find("devices", ref.device, spec.path or None))
                warnings |= dict.fromkeys(instrument.warnings)
                if isinstance(instrument.value, DeviceSpec):
                    read = check_process(instrument.value)
                    faults |= dict.fromkeys(read.faults)
                    warnings |= dict.fromkeys(read.warnings)
    return DriveReport(tuple(faults), tuple(warnings), tuple(details))


def warnings_of_drums(file: str, value: Declared) -> tuple[Fault, ...]:
    """Warnings of a profile at its reference, or of a bench at the ends of its length limits."""

    if isinstance(value, WinchProfile):
        source = open_source(file)
        return tuple(
            source.fault(tuple(key.split(".")), message)
            for key, message in (*drum_warnings(value), *guide_warnings(value))
        )
    bench = value.bench if isinstance(value, SimBench) else value
    return _drum_warnings(file, bench) if isinstance(bench, BenchSpec) else ()


def _drum_warnings(file: str, bench: BenchSpec) -> tuple[Fault, ...]:

    faults = []
    for name, wiring in bench.winch.items():
        if wiring.limits.length is None:
            continue
        profile = read_winch(find("profiles", wiring.profile, beside=bench.path))
        faults += [
            open_source(file).fault(("winch", name, "limits", "length"), message)
            for _, message in (
                *drum_warnings(profile, *wiring.limits.length),
                *guide_warnings(profile, wiring.limits.length[0]),
            )
        ]
    return tuple(faults)


def stroke_of(value: Declared) -> str:
    """Between which cable lengths a profile's drum is neither full nor down to its dead wraps."""

    if not isinstance(value, WinchProfile):
        return ""
    shortest, longest = safe_lengths(value)
    if not isfinite(shortest):
        return ""
    return f"its drum is safe from {max(shortest, 0.0):.3g} m to {longest:.3g} m of cable"


def effect_faults_and_warnings(
    file: str, value: Declared, effects: Sequence[str]
) -> tuple[list[Fault], list[Fault]]:
    """Faults of the effects of a declaration's profiles, and effects that were not checked.

    ``effects`` are the Python files that the user named (``--effects``): they are executed. Those
    that a bench file names are not: an effect that the catalogue lacks may stand in one of them, so
    it is no fault then.
    """

    profiles, bench = _profiles(value), bench_of(value)
    unread = _not_executed(bench, effects)
    warnings = [
        Fault(
            f"'{name}' is Python code, which check does not execute; opening the bench does "
            f"(check it with --effects {name})",
            file,
            key="effects",
        )
        for name in unread
    ]
    robot = value if isinstance(value, RobotProfile) and value.effect else None
    if not (effects or robot or any(profile.effect for profile in profiles)):
        return [], warnings
    from winchkit.effects import check_profile, load_catalogue

    catalogue = load_catalogue(effects)
    if unread:
        profiles = [
            replace(item, effect=tuple(table for table in item.effect if table.id in catalogue))
            for item in profiles
        ]
    faults = [fault for profile in profiles for fault in check_profile(profile, catalogue)]
    if robot is not None and (by_wing := wings.call("check_effects", robot)) is not None:
        faults += by_wing(robot, catalogue)
    return list(dict.fromkeys(faults)), warnings


def _not_executed(bench: BenchSpec | None, effects: Sequence[str]) -> list[str]:
    """Effect files that a bench file names and the user did not."""
    named = {Path(file).resolve() for file in effects}
    files = () if bench is None else bench.effect_files
    return [str(file) for file in dict.fromkeys(files) if file.resolve() not in named]


def _profiles(value: Declared) -> list[WinchProfile]:
    """The winch profiles of a declaration; those that a bench names are read as well."""

    if isinstance(value, WinchProfile):
        return [value]
    if isinstance(value, RobotProfile):
        return [line.winch for line in value.line if isinstance(line.winch, WinchProfile)]
    bench = bench_of(value)
    if bench is None:
        return []
    named = dict.fromkeys(wiring.profile for wiring in bench.winch.values())
    return [read_winch(find("profiles", name, beside=bench.path)) for name in named]


def bench_of(value: Declared) -> BenchSpec | None:
    """The bench that a declaration is, if it is one."""

    bench = value.bench if isinstance(value, SimBench) else value
    return bench if isinstance(bench, BenchSpec) else None


_SIMULATED = ("virtual", "udp_multicast")


def refusals(bench: BenchSpec) -> tuple[str, ...]:
    """Missing settings of this computer for the drives of a bench; none for simulated buses."""
    real = [
        bus
        for bus in bench.bus.values()
        if bus.kind == "can"
        and bus.interface not in _SIMULATED
        and not (bus.channel or "").startswith("vcan")
    ]
    if not real:
        return ()
    from winchkit.bench.control.computer import instrument_reading, survey

    items = list(survey())
    if any(bus.kind != "can" for bus in bench.bus.values()):
        scheduled = any(item.name == "scheduling" and item.granted for item in items)
        items.append(instrument_reading(scheduled=scheduled))
    return tuple(f"this computer, {item}" for item in items if not item.granted)


_SHOWN = 12
"""Values of an instrument in one line."""
_SILENT = "if the computer falls silent, the drive notices it"


def describe_eds(path: Path) -> tuple[DriveDescription, tuple[Fault, ...]]:
    """Facts in an EDS on its drive, with the warnings of its text; raises FileError."""
    from winchkit.drivers.can.canopen.description import describe
    from winchkit.drivers.can.canopen.node import read_eds

    dictionary, warnings = read_eds(path, 1)
    return describe(dictionary), warnings


def lines_of(drive: DriveDescription) -> Iterator[str]:
    """The description in words, a line for each topic."""
    if not drive.servo_drive:
        yield _other_device(drive)
        yield f"PDOs: {_pdos('receive', drive.receive)}; {_pdos('transmit', drive.transmit)}"
        if drive.values:
            shown = ", ".join(drive.values[:_SHOWN])
            more = f" and {len(drive.values) - _SHOWN} more" if len(drive.values) > _SHOWN else ""
            yield f"values that a TPDO can carry: {shown}{more}"
            yield "an instrument is declared by [process] in a device file: docs/howto/load-cell.md"
        return
    yield f"modes: {', '.join(drive.modes) or 'none'}"
    yield f"modes that winchkit can move it in: {', '.join(drive.motion_modes) or 'none'}"
    yield f"feedback by TPDO: {_carried(drive.feedback)}"
    yield f"targets by RPDO: {_carried(drive.targets)}"
    yield f"PDOs: {_pdos('receive', drive.receive)}; {_pdos('transmit', drive.transmit)}"
    for way in drive.host_loss:
        yield f"{_SILENT} by {way.way} ({', '.join(way.objects)}): {way.reaction}"
    if not drive.host_loss:
        yield "if the computer falls silent, the drive does not notice it"
    for option in drive.options:
        said = "no default" if option.default is None else f"{option.default} ({option.meaning})"
        fixed = "" if option.writable else ", cannot be written"
        yield f"{option.index} on {option.occasion}: {said}{fixed}"
    for difference in drive.differences:
        yield f"note: {difference}"
    for obstacle in drive.obstacles:
        yield f"not movable: {obstacle}"


def _other_device(drive: DriveDescription) -> str:
    if drive.device_profile is None:
        return "no device profile in 1000h, and 6040h and 6041h are not both there: no servo drive"
    return f"device profile CiA {drive.device_profile}: no servo drive"


def _carried(objects: dict[str, bool]) -> str:
    able = [name for name, carried in objects.items() if carried]
    unable = [name for name, carried in objects.items() if not carried]
    return (", ".join(able) or "none") + (f"; not {', '.join(unable)}" if unable else "")


def _pdos(name: str, entries: Sequence[PdoEntry]) -> str:
    fixed = sum(entry.fixed for entry in entries)
    return f"{len(entries)} {name}" + (f" ({fixed} with a fixed mapping)" if fixed else "")

"""Instruments of a bench file by winch and role, and the lines that they hang on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit import catalog
from winchkit.drivers.clock import Clock
from winchkit.drivers.instrument_process.process import LineInstrument, ProcessLineSpec, line_of
from winchkit.drivers.publisher import HostScale, Publisher
from winchkit.drivers.reading import Sensor
from winchkit.drivers.slow import SlowLine
from winchkit.errors import Fault, FileError
from winchkit.schema.bench import BenchSpec, DeviceRef
from winchkit.schema.calibration import CellCalibration, TareBook, tare_book_path
from winchkit.schema.devices.device import DeviceSpec

if TYPE_CHECKING:
    from winchkit.drivers.can.bus.bus import CanBus
    from winchkit.drivers.can.process_value import ProcessInstrument
    from winchkit.drivers.instrument_process.process import InstrumentProcess

ROLES = ("cell", "load", "length", "temperature")


@dataclass(frozen=True)
class _Wired:
    """One instrument as the bench file has it."""

    label: str
    ref: DeviceRef
    scale: HostScale
    moving: Callable[[], bool]

    def prepare(self, publisher: Publisher) -> None:
        """Give what turns its values into readings the host's share of it."""
        publisher.scale, publisher.moving = self.scale, self.moving


def device_of(spec: BenchSpec, ref: DeviceRef) -> DeviceSpec:
    """The device file that a bench file refers to, with the encoder that the bench file names."""
    from winchkit.schema.read import read_device

    device = read_device(catalog.find("devices", ref.device, spec.path or None))
    if ref.encoder is None or device.servo is None:
        return device
    return replace(device, servo=replace(device.servo, encoder=ref.encoder))


def eds_of(device: DeviceSpec) -> Path:
    """EDS file of a servo's device file."""
    assert device.servo is not None, "the reader has checked it"
    return Path(device.path).parent / device.servo.eds


def calibration_of(spec: BenchSpec, ref: DeviceRef) -> CellCalibration | None:
    """The calibration that a bench file names for an instrument; raises FileError."""
    if ref.calibration is None:
        return None
    from winchkit.schema.read import read_calibration

    path = (Path(spec.path).parent if spec.path else Path()) / ref.calibration
    found = read_calibration(path)
    device = device_of(spec, ref)
    if (found.unit == "N") == is_raw(device):
        message = (
            f"is for readings in {found.unit}, and device '{ref.device}' reads in "
            f"{device.unit or '1'}; calibrate it with its own readings"
        )
        raise FileError(Fault(message, str(path)))
    return found


def is_raw(device: DeviceSpec) -> bool:
    """Whether an instrument reads counts or another number in place of a quantity."""
    return device.unit == "1"


def tares_of(spec: BenchSpec) -> TareBook:
    """The host's tares, from the file beside the bench file where there is one."""
    from winchkit.schema.read import read_tares

    path = tare_book_path(spec.path)
    return read_tares(path) if spec.path and Path(path).is_file() else TareBook(spec.name)


def refs_of(spec: BenchSpec) -> dict[tuple[str, str], DeviceRef]:
    """Instruments as they are wired, by winch and role."""
    return {
        (name, role): ref
        for name, winch in (*spec.winch.items(), *spec.cells.items())
        for role in ROLES
        if (ref := getattr(winch, role)) is not None
    }


def can_buses(spec: BenchSpec) -> list[str]:
    """The CAN buses that instruments are on."""
    used = dict.fromkeys(ref.bus for ref in refs_of(spec).values())
    return [name for name in used if spec.bus[name].kind == "can"]


def instruments(
    spec: BenchSpec,
    clock: Clock,
    buses: Mapping[str, CanBus] | None = None,
    moving: Mapping[str, Callable[[], bool]] | None = None,
    process: InstrumentProcess | None = None,
) -> tuple[dict[str, dict[str, Sensor]], list[SlowLine]]:
    """Instruments by winch and role; two roles on one device share the instrument.

    ``buses`` are the open CAN buses, for instruments on one of them; ``moving`` says of a winch
    whether it moves, so that counts that stand still meanwhile are seen to be frozen. ``process``,
    not started yet, is to serve the lines that are not CAN.
    """
    wired: dict[tuple[str, int | None], _Wired] = {}
    placed: dict[str, dict[str, tuple[str, int | None]]] = {
        name: {} for name in (*spec.winch, *spec.cells)
    }
    tares = tares_of(spec)
    for (name, role), ref in refs_of(spec).items():
        key = placed[name][role] = _address(spec, ref)
        label = f"{role} of winch {name} (bus '{key[0]}'{_spoken(ref)})"
        calibration = calibration_of(spec, ref)
        tare = tares.tare.get(f"{name}.{role}")
        scale = HostScale(
            calibration.coefficients if calibration else (0.0, 1.0), tare.value if tare else 0.0
        )
        moves = (moving or {}).get(name, _never) if role != "temperature" else _never
        wired.setdefault(key, _Wired(label, ref, scale, moves))
    found: dict[tuple[str, int | None], Sensor] = {}
    lines: list[SlowLine] = []
    for bus in dict.fromkeys(key[0] for key in wired):
        mine = {key: one for key, one in wired.items() if key[0] == bus}
        if spec.bus[bus].kind == "can":
            lines.append(_can_line(spec, bus, list(mine.values()), clock, buses or {}))
        else:
            declared = _declared(spec, bus, list(mine.values()))
            made = line_of(declared, clock)
            for one, sensor in zip(mine.values(), made.sensors, strict=True):
                one.prepare(sensor.publisher)
            lines.append(made if process is None else process.adopt(declared, made))
        found.update(zip(mine, lines[-1].sensors, strict=True))
    sensors = {
        name: {role: found[key] for role, key in roles.items()} for name, roles in placed.items()
    }
    return sensors, lines


def _address(spec: BenchSpec, ref: DeviceRef) -> tuple[str, int | None]:
    """Bus and address: a node on CAN, a unit on Modbus, a unit or nothing on a serial line."""
    kind = spec.bus[ref.bus].kind
    if kind == "can":
        return ref.bus, ref.node
    if kind == "serial":
        return ref.bus, ref.unit
    return ref.bus, ref.unit or 1


def _never() -> bool:
    return False


def _spoken(ref: DeviceRef) -> str:
    if ref.node is not None:
        return f" node {ref.node}"
    return "" if ref.unit is None else f" unit {ref.unit}"


def _declared(spec: BenchSpec, bus: str, wired: list[_Wired]) -> ProcessLineSpec:
    """The Modbus or serial line of a bus with its instruments, in the order of ``wired``."""
    table = "stream" if spec.bus[bus].kind == "serial" else "modbus"
    instruments = tuple(
        LineInstrument(one.label, _of_kind(spec, one, table), one.ref.unit, one.ref.rate)
        for one in wired
    )
    return ProcessLineSpec(bus, spec.bus[bus], instruments)


def _can_line(
    spec: BenchSpec, bus: str, wired: list[_Wired], clock: Clock, buses: Mapping[str, CanBus]
) -> SlowLine:
    from winchkit.drivers.can.process_value import ProcessInstrument, ProcessLine

    if bus not in buses:
        raise FileError(Fault(f"{wired[0].label}: its CAN bus is not open", spec.path))
    found: list[ProcessInstrument] = []
    for one in wired:
        if one.ref.node is None:
            raise FileError(Fault(f"{one.label}: needs its node number", spec.path))
        device = _of_kind(spec, one, "process")
        found.append(ProcessInstrument(one.label, device, one.ref.node, buses[bus], clock))
        one.prepare(found[-1].publisher)
    return ProcessLine(bus, tuple(found), clock)


def _of_kind(spec: BenchSpec, one: _Wired, table: str) -> DeviceSpec:
    """The device file, whose kind must fit the bus."""
    device = device_of(spec, one.ref)
    if getattr(device, table) is None:
        kind = spec.bus[one.ref.bus].kind
        raise FileError(
            Fault(
                f"{one.label}: '{device.name}' has no [{table}] table, which a bus of kind "
                f"'{kind}' needs",
                spec.path,
            )
        )
    return device

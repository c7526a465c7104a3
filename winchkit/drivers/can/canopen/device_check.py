"""Whether a device file of a drive or a CANopen instrument fits the EDS that it names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canopen.objectdictionary import datatypes

from winchkit.drivers.can.canopen.declared import (
    configured_value,
    declared,
    fixed_mapping,
    unmappable,
)
from winchkit.drivers.can.canopen.description import (
    ALWAYS,
    PDO_BITS,
    HostLossObjects,
    host_loss_ways,
    lacking,
)
from winchkit.drivers.can.canopen.node import read_eds
from winchkit.drivers.can.canopen.pdo import parse_object
from winchkit.drivers.can.canopen.pdo_parameters import IDENTIFIER, INVALID, cob_id
from winchkit.drivers.can.cia402.modes import MODES
from winchkit.drivers.can.cia402.option_codes import OPTIONS
from winchkit.errors import Fault, FileError
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.process import ProcessSpec
from winchkit.schema.devices.servo import PdoSpec, ServoSpec
from winchkit.schema.host_loss import HARDWARE, VENDOR
from winchkit.schema.reading.lines import Key
from winchkit.schema.reading.source import open_source

_NODE = 1
"""For which the EDS is read: $NODEID of its identifiers."""
_CONTROL = (0x6040, 0)
_OBJECTS = {
    "heartbeat": "a writable 1016h:1",
    "guarding": "writable 100Ch and 100Dh",
    "rpdo-timeout": "a writable event timer of an RPDO (1400h:5)",
    "sync-loss": "a writable 1006h, or a cyclic mode",
}
"""Needed by each way to notice a dead host."""


@dataclass(frozen=True)
class EdsReport:
    """Faults of a drive's EDS, or of a device file that names it."""

    faults: tuple[Fault, ...]
    warnings: tuple[Fault, ...]
    host_loss: tuple[HostLossObjects, ...] = ()
    """Ways to notice a dead host that the EDS has."""


def check_drive(device: DeviceSpec) -> EdsReport:
    """Check a device file of a drive against its EDS; FileError where there is none to read."""
    servo = device.servo
    if servo is None:
        return EdsReport((), ())
    dictionary, warnings = read_eds(Path(device.path).parent / servo.eds, _NODE)
    source = open_source(device.path)
    faults = [
        source.fault(("servo", kind, place, "objects"), message)
        for kind, specs in (("tpdo", servo.tpdo), ("rpdo", servo.rpdo))
        for place, spec in enumerate(specs)
        for message in _pdo_faults(dictionary, kind, spec)
    ]
    faults += [source.fault(("servo", "modes"), message) for message in _lacking(dictionary, servo)]
    faults += [
        source.fault(("servo", "options", key), message)
        for key, message in _option_faults(dictionary, servo)
    ]
    if servo.home_offset != ServoSpec.home_offset and (
        (key := _key(servo.home_offset)) is None or declared(dictionary, *key) is None
    ):
        faults.append(source.fault(("servo", "home_offset"), "is no object of the EDS"))
    ways = host_loss_ways(dictionary)
    problem = host_loss_problem(ways, servo.host_loss) or _not_watched(dictionary, servo)
    fault = source.fault(("servo",), problem) if problem else None
    if fault is not None and ways:
        faults.append(fault)
    elif fault is not None:
        warnings = (*warnings, fault)
    return EdsReport(tuple(faults), warnings, ways)


def check_process(device: DeviceSpec) -> EdsReport:
    """Check a device file of a CANopen instrument against its EDS; FileError without one."""
    spec = device.process
    if spec is None:
        return EdsReport((), ())
    dictionary, warnings = read_eds(Path(device.path).parent / spec.eds, _NODE)
    source = open_source(device.path)
    found: list[tuple[Key, str]] = [
        (("process", "tpdo", place, "objects"), message)
        for place, pdo in enumerate(spec.tpdo)
        for message in _pdo_faults(dictionary, "tpdo", pdo, real=True)
    ]
    found += [(("process", key), message) for key, message in _value_faults(dictionary, spec)]
    found += [
        (("process", "command", name, "object"), message)
        for name, command in spec.command.items()
        for message in _written_faults(dictionary, command.object)
    ]
    return EdsReport(tuple(source.fault(key, message) for key, message in found), warnings)


def _value_faults(dictionary: Any, spec: ProcessSpec) -> Iterator[tuple[str, str]]:
    """Key and fault of the value and its status: not there, or of another type."""
    for key, text in (("value", spec.value), ("status", spec.status)):
        if text is None:
            continue
        if (place := _key(text)) is None:
            yield key, f"'{text}' is no object; write it as 0x6130:1"
        elif (variable := declared(dictionary, *place)) is None:
            yield key, f"{text} is not in the EDS"
        elif key == "value" and spec.type == "f32" and variable.data_type != datatypes.REAL32:
            yield key, f'{text} is no REAL32 in the EDS; write type = "integer" and its scale'
        elif (key == "status" or spec.type == "integer") and (
            variable.data_type not in datatypes.INTEGER_TYPES
        ):
            yield key, f"{text} is no whole number in the EDS"


def _written_faults(dictionary: Any, text: str) -> Iterator[str]:
    variable = None if (place := _key(text)) is None else declared(dictionary, *place)
    if variable is None:
        yield f"{text} is not in the EDS"
    elif not variable.writable:
        yield f"{text} is {variable.access_type} in the EDS, it cannot be written"


def _not_watched(dictionary: Any, servo: ServoSpec) -> str:
    """Keys that the device file lacks for its detection of a dead host; empty where none."""
    if servo.host_loss == "sync-loss" and not MODES[servo.motion_mode].cyclic:
        return (
            f'host_loss = "sync-loss" needs a cyclic mode; in {servo.motion_mode} no drive minds a '
            "lost SYNC"
        )
    if servo.host_loss == "rpdo-timeout":
        for spec in servo.rpdo:
            if any(_key(text) == _CONTROL for text in spec.objects):
                record = 0x1400 + spec.number - 1
                if declared(dictionary, record, 5) is None:
                    return f'host_loss = "rpdo-timeout" needs {record:04X}h:5, which the EDS lacks'
                return ""
        return 'host_loss = "rpdo-timeout" needs an RPDO that carries 0x6040'
    return ""


def host_loss_problem(ways: tuple[HostLossObjects, ...], way: str) -> str:
    """Why a drive cannot notice a dead host as declared, by its EDS; empty where it may."""
    names = [one.way for one in ways]
    if way in names or way == HARDWARE or way.startswith(VENDOR):
        return ""
    if not names:
        return (
            "the EDS has no way to notice a dead host (no 1016h, no 100Ch with 100Dh, no "
            "1400h:5, no 1006h): motion is refused, unless the bench file names the hardware that "
            'stops the drive (host_loss = "hardware")'
        )
    return (
        f'host_loss = "{way}" is not possible by the EDS, which lacks {_OBJECTS.get(way, way)}; '
        f"it has {', '.join(names)}"
    )


def _pdo_faults(dictionary: Any, kind: str, spec: PdoSpec, *, real: bool = False) -> Iterator[str]:
    receive = kind == "rpdo"
    record = (0x1400 if receive else 0x1800) + spec.number - 1
    for index in (record, record + 0x200):
        if index not in dictionary:
            yield f"{kind} {spec.number} needs {index:04X}h, which the EDS lacks"
    yield from _communication_faults(dictionary, record, kind, spec)
    entries = set(getattr(dictionary.get(record + 0x200), "subindices", ())) - {0}
    if entries and len(spec.objects) > len(entries):
        yield (
            f"{kind} {spec.number} has {len(spec.objects)} objects; {record + 0x200:04X}h has "
            f"{len(entries)} mapping entries in the EDS"
        )
    bits = 0
    for text in spec.objects:
        try:
            index, sub = parse_object(text)
        except FileError as error:
            yield str(error)
            continue
        variable = declared(dictionary, index, sub)
        if variable is None:
            yield f"{text} is not in the EDS"
            continue
        bits += len(variable)
        if reason := unmappable(variable, receive=receive, real=real):
            yield f"{text} ({variable.name}) cannot be mapped: {reason}"
    if bits > PDO_BITS:
        yield f"{kind} {spec.number} would have {bits} bits; a PDO carries {PDO_BITS}"
    else:
        yield from _fixed_faults(dictionary, receive, spec)


def _communication_faults(dictionary: Any, record: int, kind: str, spec: PdoSpec) -> Iterator[str]:
    """Identifier and transmission type that the EDS does not let change and that differ."""
    identifier, type_ = (declared(dictionary, record, sub) for sub in (1, 2))
    kept = configured_value(identifier)
    wanted = cob_id("rpdo" if kind == "rpdo" else "tpdo", spec.number, _NODE)
    if identifier is not None and not identifier.writable and kept is not None:
        if kept & INVALID:
            yield f"{kind} {spec.number} is not in use: {record:04X}h:1 cannot be written"
        elif kept & IDENTIFIER != wanted:
            yield (
                f"{kind} {spec.number} has the identifier {kept & IDENTIFIER:03X}h at node "
                f"{_NODE}, which cannot be written, not {wanted:03X}h of the predefined "
                "connection set"
            )
    kept = configured_value(type_)
    if type_ is not None and not type_.writable and kept not in (None, spec.transmission):
        yield (
            f"{kind} {spec.number} has the transmission type {kept}, which cannot be written: "
            f"write transmission = {kept}, or use another PDO"
        )


def _fixed_faults(dictionary: Any, receive: bool, spec: PdoSpec) -> Iterator[str]:
    """A PDO whose mapping cannot be changed has to be taken as it is."""
    fixed = fixed_mapping(dictionary, receive, spec.number)
    if fixed is None:
        return
    if list(map(_key, spec.objects)) != list(map(_key, fixed)):
        held = ", ".join(f'"{text}"' for text in fixed) or "nothing"
        kind = "rpdo" if receive else "tpdo"
        yield f"{kind} {spec.number} has a fixed mapping in the EDS: objects = [{held}]"


def _key(text: str) -> tuple[int, int] | None:
    """Index and sub-index; None for a text that is neither."""
    try:
        return parse_object(text)
    except FileError:
        return None


def _lacking(dictionary: Any, servo: ServoSpec) -> Iterator[str]:
    for index in ALWAYS:
        if index not in dictionary:
            yield f"{index:04X}h is not in the EDS; winchkit cannot do without"
    for mode in servo.modes:
        yield from lacking(dictionary, mode)


def _option_faults(dictionary: Any, servo: ServoSpec) -> Iterator[tuple[str, str]]:
    """Key and fault of every option code that the EDS lacks, or does not let be written."""
    for key, row in OPTIONS.items():
        value = getattr(servo.options, key)
        variable = declared(dictionary, row.index)
        if value is None:
            continue
        if variable is None:
            yield key, f"the EDS lacks {row.index:04X}h; the drive has no such option code"
        elif not variable.writable and variable.default != value:
            yield key, f"{row.index:04X}h is {variable.access_type} in the EDS, it cannot be set"

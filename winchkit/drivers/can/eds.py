"""The object dictionary of an EDS or DCF, and whether a device file fits it."""

from __future__ import annotations

import configparser
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canopen.objectdictionary import datatypes
from canopen.objectdictionary import eds as _canopen_eds

from winchkit.drivers.can.pdo import parse_object
from winchkit.errors import Fault, FileError
from winchkit.schema.device import DeviceSpec
from winchkit.schema.device_servo import PdoSpec, ServoSpec
from winchkit.schema.eds import read_eds_text
from winchkit.schema.read_source import open_source

__all__ = ["EdsReport", "check_drive", "read_eds"]

_LONGEST = 64
_NEEDED = {
    "PP": (0x607A, 0x6081, 0x6083),
    "PV": (0x60FF, 0x6083),
    "PT": (0x6071,),
    "HM": (0x6098, 0x6099),
    "IP": (0x60C1, 0x60C2),
    "CSP": (0x607A,),
    "CSV": (0x60FF,),
    "CST": (0x6071,),
}
"""Objects without which a drive cannot have a mode."""
_ALWAYS = (0x6040, 0x6041, 0x6060, 0x6061, 0x6064, 0x606C)


@dataclass(frozen=True)
class EdsReport:
    """What is wrong with a drive's EDS, or with a device file that names it."""

    faults: tuple[Fault, ...]
    warnings: tuple[Fault, ...]


def read_eds(path: Path, node: int) -> tuple[Any, tuple[Fault, ...]]:
    """Object dictionary of an EDS or DCF for a node id, with warnings; raises FileError."""
    eds = read_eds_text(path)
    library: Any = _canopen_eds
    try:
        return library.import_eds(io.StringIO(eds.text), node), eds.warnings
    except (ValueError, KeyError, configparser.Error) as error:
        raise FileError(Fault(f"cannot be read as an EDS: {error}", str(path))) from error


def check_drive(device: DeviceSpec) -> EdsReport:
    """Check a device file of a drive against its EDS; FileError where there is none to read."""
    servo = device.servo
    if servo is None:
        return EdsReport((), ())
    dictionary, warnings = read_eds(Path(device.path).parent / servo.eds, 1)
    source = open_source(device.path)
    faults = [
        source.fault(("servo", kind, place, "objects"), message)
        for kind, specs in (("tpdo", servo.tpdo), ("rpdo", servo.rpdo))
        for place, spec in enumerate(specs)
        for message in _pdo_faults(dictionary, kind, spec)
    ]
    faults += [source.fault(("servo", "modes"), message) for message in _lacking(dictionary, servo)]
    return EdsReport(tuple(faults), warnings)


def _pdo_faults(dictionary: Any, kind: str, spec: PdoSpec) -> Iterator[str]:
    receive = kind == "rpdo"
    record = (0x1400 if receive else 0x1800) + spec.number - 1
    for index in (record, record + 0x200):
        if index not in dictionary:
            yield f"{kind} {spec.number} needs {index:04X}h, which the EDS lacks"
    bits = 0
    for text in spec.objects:
        try:
            index, sub = parse_object(text)
        except FileError as error:
            yield str(error)
            continue
        variable = _declared(dictionary, index, sub)
        if variable is None:
            yield f"{text} is not in the EDS"
            continue
        bits += len(variable)
        if reason := _unmappable(variable, receive):
            yield f"{text} ({variable.name}) cannot be mapped: {reason}"
    if bits > _LONGEST:
        yield f"{kind} {spec.number} would have {bits} bits; a PDO carries {_LONGEST}"


def _declared(dictionary: Any, index: int, sub: int) -> Any:
    """The object that the EDS declares; canopen by itself makes up entries of an array."""
    found = dictionary.get(index)
    subs = getattr(found, "subindices", None)
    if subs is not None:
        return subs.get(sub)
    return found if sub == 0 else None


def _unmappable(variable: Any, receive: bool) -> str:
    if variable.data_type not in datatypes.INTEGER_TYPES:
        return "it is no whole number"
    if not variable.pdo_mappable:
        return "its PDOMapping is 0 in the EDS"
    wrong = ("ro", "const", "rwr") if receive else ("wo", "rww")
    if variable.access_type in wrong:
        return f"it is {variable.access_type} in the EDS"
    return ""


def _lacking(dictionary: Any, servo: ServoSpec) -> Iterator[str]:
    for index in _ALWAYS:
        if index not in dictionary:
            yield f"{index:04X}h is not in the EDS; winchkit cannot do without"
    for mode in servo.modes:
        for index in _NEEDED[mode]:
            if index not in dictionary:
                yield f"{mode} needs {index:04X}h, which the EDS lacks"

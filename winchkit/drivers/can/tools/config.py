"""Settings of a drive: read as a whole, compared, written, and stored in its memory.

Settings are parameters that an engineer sets and the drive keeps. Values that a bench writes at
every opening (PDOs, heartbeats), commands, targets, demand values and measured values are not among
them.
"""

from __future__ import annotations

import configparser
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from canopen.objectdictionary import ODVariable, datatypes

from winchkit.drivers.can.canopen.identity import Identity
from winchkit.drivers.can.canopen.node import Objects, Value, object_name, variables
from winchkit.drivers.can.canopen.pdo import Key
from winchkit.drivers.can.cia402.state_machine import DriveState, state_of
from winchkit.drivers.can.tools.scan import identity_of
from winchkit.errors import DeviceRefused, Fault, FileError, NotPermitted, UsageError
from winchkit.regular_file import file_errors, read_text

STORE, RESTORE = (0x1010, b"save"), (0x1011, b"load")
"""Object and signature that store all parameters, and bring back the maker's."""

_NOT_SETTINGS = (
    range(0x1001, 0x1004),  # error register, status and history
    range(0x1010, 0x1018),  # store and restore, COB-IDs, heartbeats
    range(0x1200, 0x1C00),  # SDO servers, PDOs
    range(0x1F50, 0x1F58),  # program download
    range(0x6040, 0x6041),  # control word
    range(0x6060, 0x6061),  # mode
    range(0x6071, 0x6072),  # targets and offsets
    range(0x607A, 0x607B),
    range(0x60B0, 0x60B3),
    range(0x60C1, 0x60C3),  # interpolation data and period
    range(0x60FE, 0x6100),  # digital outputs, target velocity
    # Outputs of the drive by CiA 402-2, which some EDS files declare as rw.
    range(0x603F, 0x6040),  # error code
    range(0x6041, 0x6042),  # status word
    range(0x6061, 0x6065),  # mode display; demand and actual positions
    *(range(0x6069, 0x606A), range(0x606B, 0x606D)),  # demand and actual velocities
    *(range(0x6074, 0x6075), range(0x6077, 0x607A)),  # demand and actual torque, current, voltage
    *(range(0x60B9, 0x60BE), range(0x60D1, 0x60D9)),  # touch probe: status, positions, times
    *(range(0x60E4, 0x60E6), range(0x60F4, 0x60F5)),  # further encoders, following error
    *(range(0x60FA, 0x60FB), range(0x60FC, 0x60FE)),  # control effort, position demand, inputs
    range(0x6502, 0x6503),  # supported modes
)
_TYPES = {*datatypes.NUMBER_TYPES, datatypes.BOOLEAN, datatypes.VISIBLE_STRING}
_QUIET = (DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON, DriveState.FAULT)


@dataclass(frozen=True)
class Config:
    """Settings of one drive."""

    identity: Identity
    values: Mapping[Key, Value]
    """By index and sub-index."""
    refused: tuple[str, ...] = field(default=(), compare=False)
    """Objects that the drive refused to read, with its reason."""


@dataclass(frozen=True)
class Difference:
    """One setting that is not the same in a file and in the drive."""

    object: str
    name: str
    file: Value
    drive: Value | None
    """None where the drive has no such object."""


def settings(dictionary: Any) -> dict[Key, ODVariable]:
    """The objects of a dictionary that are settings."""
    return {
        (item.index, item.subindex): item
        for item in variables(dictionary)
        if item.data_type in _TYPES
        and item.access_type in ("rw", "rwr", "rww")
        and not any(item.index in part for part in _NOT_SETTINGS)
        and not (item.subindex == 0 and item.parent is not dictionary)
    }


@dataclass(frozen=True)
class Setting:
    """A setting as a dictionary declares it."""

    object: str
    name: str
    type: str
    """``whole number``, ``number`` or ``text``."""
    low: float | None
    """Least value; None where there is none."""
    high: float | None
    """Greatest value; None where there is none."""


def described(dictionary: Any) -> list[Setting]:
    """The settings of a dictionary with their types and limits."""
    return [
        Setting(object_name(*key), _name(item), _type(item), *_range(item))
        for key, item in settings(dictionary).items()
    ]


def named_setting(dictionary: Any, name: str) -> ODVariable:
    """A setting by its object, e.g. ``6081h`` or ``6091h:1``; raises UsageError for another."""
    for key, item in settings(dictionary).items():
        if object_name(*key) == name:
            return item
    raise UsageError(f"'{name}' is no setting of this drive")


def one_setting(dictionary: Any, name: str, text: str) -> dict[Key, Value]:
    """A setting from its name, such as ``6081h``, and its value; raises UsageError."""
    item = named_setting(dictionary, name)
    value = _parsed(item, text.strip())
    low, high = _range(item)
    outside = isinstance(value, int | float) and not (
        (low is None or low <= value) and (high is None or value <= high)
    )
    if value is None or outside:
        limits = "" if low is None or high is None else f" from {low:.10g} to {high:.10g}"
        raise UsageError(f"{name} ({_name(item)}): '{text}' is no {_type(item)}{limits}")
    return {(item.index, item.subindex): value}


def _type(variable: ODVariable) -> str:
    if variable.data_type == datatypes.VISIBLE_STRING:
        return "text"
    return "number" if variable.data_type in datatypes.FLOAT_TYPES else "whole number"


def _range(variable: ODVariable) -> tuple[float | None, float | None]:
    """Limits of a value: those of the EDS, else of a whole number's type; None where unknown."""
    low = high = None
    if _type(variable) == "whole number":
        bits = len(variable) - (variable.data_type in datatypes.SIGNED_TYPES)
        low, high = -(2.0**bits) if bits < len(variable) else 0.0, 2.0**bits - 1
    return (
        low if variable.min is None else float(variable.min),
        high if variable.max is None else float(variable.max),
    )


def read_config(objects: Objects) -> Config:
    """Read every setting; raises NoReply. What the drive refuses is noted."""
    values: dict[Key, Value] = {}
    refused = []
    for key, variable in settings(objects.dictionary).items():
        try:
            value = objects.value(variable)
        except DeviceRefused as error:
            refused.append(str(error))
            continue
        if value is not None:
            values[key] = value
    return Config(identity_of(objects.port), values, tuple(refused))


def check_fits(config: Config, found: Identity, path: str) -> None:
    """Raise FileError where the settings come from a drive of another kind."""
    wanted = config.identity
    if wanted.vendor and (wanted.vendor, wanted.product) != (found.vendor, found.product):
        raise FileError(
            f"{path}: is of vendor {wanted.vendor:04X}h product {wanted.product:08X}h; this drive "
            f"is of vendor {found.vendor:04X}h product {found.product:08X}h"
        )


def check_quiet(objects: Objects) -> None:
    """Raise NotPermitted while the drive is enabled or about to be."""
    status = objects.number(0x6041)
    state = DriveState.UNKNOWN if status is None else state_of(status)
    if status is not None and state not in _QUIET:
        raise NotPermitted(f"the drive is {state}; stop it before its settings are changed")


def difference(config: Config, objects: Objects) -> list[Difference]:
    """Where a file and the drive differ; raises FileError, NoReply, DeviceRefused."""
    known = settings(objects.dictionary)
    found = []
    for key, wanted in config.values.items():
        variable = known[key]
        kept = objects.value(variable)
        if kept != wanted:
            found.append(Difference(object_name(*key), _name(variable), wanted, kept))
    return found


def write_config(config: Config, objects: Objects) -> list[Difference]:
    """Write what differs and return it as it was before; each value is read back.

    Raises NotPermitted while the drive is enabled, DeviceRefused for what it does not take or
    does not have. What was written until then stays.
    """
    check_quiet(objects)
    known = {object_name(*key): item for key, item in settings(objects.dictionary).items()}
    changes = difference(config, objects)
    for change in changes:
        if change.drive is None:
            raise DeviceRefused(f"{change.object} ({change.name}): the drive has no such object")
    for change in changes:
        variable = known[change.object]
        objects.write(variable, change.file)
        kept = objects.value(variable)
        if kept != change.file:
            raise DeviceRefused(
                f"{change.object} ({change.name}): wrote {change.file}, reads back {kept}; "
                "the drive does not take this value"
            )
    return changes


def store(objects: Objects) -> None:
    """Store the settings in the drive (1010h); raises NotPermitted, DeviceRefused."""
    _sign(objects, *STORE, "store its parameters")


def restore(objects: Objects) -> None:
    """Restore the manufacturer's settings at the next start of the drive (1011h)."""
    _sign(objects, *RESTORE, "restore the maker's parameters")


def _sign(objects: Objects, index: int, signature: bytes, what: str) -> None:
    check_quiet(objects)
    if objects.number(index, 1) is None:
        raise DeviceRefused(f"{object_name(index, 1)}: the drive cannot {what}")
    objects.port.download(index, 1, signature)


def _name(variable: ODVariable) -> str:
    """Parameter name, with the record's where it has one."""
    parent = getattr(variable.parent, "name", "")
    return f"{parent}, {variable.name}" if parent else str(variable.name)


_KIND = "drive-config"
_JSON_KEY = re.compile(r"([0-9A-F]{4})h(?::(\d+))?")
_SECTION = re.compile(r"([0-9A-Fa-f]{4})(?:sub([0-9A-Fa-f]+))?")
_IDENTITY = ("vendor", "product", "revision", "serial")


def write_config_file(path: Path, config: Config, eds: Path, node: int, bitrate: int) -> None:
    """Write a .json or .dcf file, the latter on the drive's EDS; raises FileError."""
    text = _json(config) if _is_json(path) else _dcf(config, eds, node, bitrate)
    with file_errors(path):
        path.write_text(text, encoding="utf-8")


def read_config_file(path: Path, dictionary: Any) -> Config:
    """Read the settings of a .json or .dcf file against a drive's dictionary; raises FileError."""
    is_json = _is_json(path)
    try:
        text = read_text(path, "utf-8" if is_json else "latin-1")
    except FileNotFoundError:
        raise FileError(Fault("there is no such file", str(path))) from None
    except OSError as error:
        raise FileError(Fault(f"cannot be read: {error.strerror}", str(path))) from None
    except UnicodeDecodeError as error:
        raise FileError(Fault(f"is not UTF-8 text: {error}", str(path))) from None
    known = settings(dictionary)
    return _from_json(path, text, known) if is_json else _from_dcf(path, text, known)


def fitting_config(path: Path, objects: Objects) -> Config:
    """Settings of a file for a drive; raises FileError where they are those of another kind."""
    config = read_config_file(path, objects.dictionary)
    check_fits(config, identity_of(objects.port), str(path))
    return config


def _is_json(path: Path) -> bool:
    suffix = path.suffix.lower()
    if suffix not in (".json", ".dcf"):
        raise FileError(Fault(f"'{suffix}' is none of .dcf, .json", str(path)))
    return suffix == ".json"


def _json(config: Config) -> str:
    identity = config.identity
    tree = {
        "schema": 1,
        "kind": _KIND,
        "identity": {key: getattr(identity, key) for key in _IDENTITY},
        "objects": {object_name(*key): value for key, value in config.values.items()},
    }
    return json.dumps(tree, indent=2) + "\n"


def _from_json(path: Path, text: str, known: Mapping[Key, ODVariable]) -> Config:
    try:
        tree = json.loads(text)
    except ValueError as error:
        raise FileError(Fault(f"is no JSON: {error}", str(path))) from error
    if not isinstance(tree, dict) or tree.get("kind") != _KIND:
        raise FileError(Fault(f'is no drive configuration ("kind": "{_KIND}")', str(path)))
    raw, identity = tree.get("objects"), tree.get("identity", {})
    if not isinstance(raw, dict) or not isinstance(identity, dict):
        raise FileError(Fault("needs the tables 'identity' and 'objects'", str(path)))
    parts = [identity.get(key, 0) for key in _IDENTITY]
    if not all(isinstance(part, int) for part in parts):
        raise FileError(Fault("its parts are whole numbers", str(path), key="identity"))
    faults: list[Fault] = []
    values = {}
    for name, value in raw.items():
        match = _JSON_KEY.fullmatch(name)
        key = (int(match[1], 16), int(match[2] or "0")) if match else None
        if key is None or key not in known:
            faults.append(Fault("is no setting of this drive", str(path), key=name))
        elif not _fits(known[key], value):
            faults.append(Fault(f"{value!r} does not fit its type", str(path), key=name))
        else:
            values[key] = value
    if faults:
        raise FileError(faults)
    return Config(Identity(*parts), values)


def _dcf(config: Config, eds: Path, node: int, bitrate: int) -> str:
    parser = _parser(eds, eds.read_text(encoding="latin-1"))
    parser["DeviceComissioning"] = {"NodeID": str(node), "Baudrate": str(bitrate // 1000)}
    identity = config.identity
    for key, number in (("VendorNumber", identity.vendor), ("ProductNumber", identity.product)):
        if number:
            parser.set("DeviceInfo", key, f"0x{number:X}")
    sections = {section.upper(): section for section in parser.sections()}
    for (index, sub), value in config.values.items():
        names = [f"{index:04X}SUB{sub:X}"] + ([f"{index:04X}"] if sub == 0 else [])
        section = next((sections[name] for name in names if name in sections), None)
        if section is not None:
            parser.set(section, "ParameterValue", str(value))
    lines = []
    for section in parser.sections():
        lines += [f"[{section}]", *(f"{key}={value}" for key, value in parser.items(section)), ""]
    return "\n".join(lines)


def _from_dcf(path: Path, text: str, known: Mapping[Key, ODVariable]) -> Config:
    parser = _parser(path, text)
    faults: list[Fault] = []
    values: dict[Key, Value] = {}
    for section in parser.sections():
        match = _SECTION.fullmatch(section)
        key = (int(match[1], 16), int(match[2] or "0", 16)) if match else None
        raw = parser.get(section, "ParameterValue", fallback="").strip()
        if key is None or key not in known or not raw:
            continue
        value = _parsed(known[key], raw)
        if value is None:
            faults.append(Fault(f"'{raw}' does not fit its type", str(path), key=section))
        else:
            values[key] = value
    if not values and not faults:
        faults.append(Fault("has no ParameterValue of a setting of this drive", str(path)))
    if faults:
        raise FileError(faults)
    numbers = (
        _whole(parser.get("DeviceInfo", key, fallback="0")) or 0
        for key in ("VendorNumber", "ProductNumber")
    )
    return Config(Identity(*numbers), values)


def _parser(path: Path, text: str) -> configparser.RawConfigParser:
    parser = configparser.RawConfigParser(strict=False)
    # Keys of an EDS keep their case.
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    try:
        parser.read_string(text, str(path))
    except configparser.Error as error:
        raise FileError(Fault(f"is no DCF: {error}", str(path))) from error
    return parser


def _parsed(variable: ODVariable, raw: str) -> Value | None:
    """A value as a DCF writes it; None where it does not fit the object's type."""
    if variable.data_type == datatypes.VISIBLE_STRING:
        return raw
    try:
        value: Value
        value = float(raw) if variable.data_type in datatypes.FLOAT_TYPES else int(raw, 0)
    except ValueError:
        return None
    return value if _fits(variable, value) else None


def _fits(variable: ODVariable, value: object) -> bool:
    """Whether a value can be written as an object's type."""
    if variable.data_type == datatypes.VISIBLE_STRING:
        return isinstance(value, str) and value.isascii()
    if variable.data_type in datatypes.FLOAT_TYPES:
        return isinstance(value, int | float)
    if not isinstance(value, int):
        return False
    bits = len(variable)
    signed = variable.data_type in datatypes.SIGNED_TYPES
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    return low <= value <= high


def _whole(text: str) -> int | None:
    try:
        return int(text, 0)
    except ValueError:
        return None

"""Settings of a drive in files: DCF (the EDS with ParameterValue, CiA 306) and JSON."""

from __future__ import annotations

import configparser
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from canopen.objectdictionary import ODVariable, datatypes

from winchkit.drivers.can.config import Config, Key, settings
from winchkit.drivers.can.fitting import Identity
from winchkit.drivers.can.objects import Value, object_name
from winchkit.errors import Fault, FileError
from winchkit.regular_file import read_text

__all__ = ["read_config_file", "write_config_file"]

_KIND = "drive-config"
_JSON_KEY = re.compile(r"([0-9A-F]{4})h(?::(\d+))?")
_SECTION = re.compile(r"([0-9A-Fa-f]{4})(?:sub([0-9A-Fa-f]+))?")
_IDENTITY = ("vendor", "product", "revision", "serial")


def write_config_file(path: Path, config: Config, eds: Path, node: int, bitrate: int) -> None:
    """Write a .json or .dcf file, the latter on the drive's EDS; raises FileError."""
    text = _json(config) if _is_json(path) else _dcf(config, eds, node, bitrate)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror}") from error


def read_config_file(path: Path, dictionary: Any) -> Config:
    """Read a .json or .dcf file against the drive's dictionary; raises FileError.

    Of a DCF the objects count that are settings and have a ParameterValue.
    """
    is_json = _is_json(path)
    try:
        text = read_text(path, "utf-8" if is_json else "latin-1")
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(Fault(f"cannot be read: {error}", str(path))) from error
    known = settings(dictionary)
    return _from_json(path, text, known) if is_json else _from_dcf(path, text, known)


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

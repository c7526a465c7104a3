"""Writes the pages of drives and of instruments: ``python docs/make_devices.py``.

docs/howto/drive.md is docs/howto/drive.txt with the keys of the schema, docs/devices.md lists the
shipped instruments from their device files.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Sequence
from pathlib import Path

from winchkit import find
from winchkit.catalog import names
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.servo import OptionSpec, PdoSpec, QuirkSpec, ServoSpec
from winchkit.schema.host_loss import VendorObject, VendorWatchdog
from winchkit.schema.read import read_device

PAGE = Path(__file__).with_name("devices.md")
DRIVE_PAGE = Path(__file__).parent / "howto" / "drive.md"
_DRIVES = DRIVE_PAGE.with_suffix(".txt")
"""The page on drives, with a line ``<keys of CLASS>`` for each table of keys."""
_BEGIN = """\
# Shipped instruments

Written by `python docs/make_devices.py` from the device files; do not edit it by hand. The same
files are used by the readers and the simulated instruments. None has been tested on the device yet.
How to declare another one: [load cells on Modbus and CANopen](howto/load-cell.md),
[instruments on a serial line](howto/serial-instrument.md), [drives](howto/drive.md).
"""
_TABLES = {item.__name__: item for item in (ServoSpec, PdoSpec, OptionSpec, QuirkSpec)}
_TABLES |= {item.__name__: item for item in (VendorWatchdog, VendorObject)}
_TRUST = {
    "manual": "from its manual",
    "interoperability": "tested with another program",
    "hardware": "tested on the device",
    "generic": "generic, without a manual",
    "eds": "from its EDS only",
}


def page(devices: Sequence[DeviceSpec]) -> str:
    """The page: each instrument with what its file declares."""
    instruments = [device for device in devices if device.servo is None]
    sections = ("\n".join(_section(device)) + "\n" for device in instruments)
    return "\n".join([_BEGIN, *sections])


def drive_page() -> str:
    """The page on drives, with every key as the schema has it."""
    return "\n".join(_drive_lines()) + "\n"


def _drive_lines() -> Iterator[str]:
    for line in _DRIVES.read_text(encoding="utf-8").rstrip("\n").split("\n"):
        name = line.removeprefix("<keys of ")
        if name == line:
            yield line
        else:
            yield "| key | default | meaning |"
            yield "|---|---|---|"
            yield from _keys(_TABLES[name.removesuffix(">")])


def _keys(kind: type) -> Iterator[str]:
    """Rows of a table: the fields of a dataclass of the schema with their docstrings."""
    (tree,) = ast.parse(inspect.getsource(kind)).body
    assert isinstance(tree, ast.ClassDef)
    for item, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        if not isinstance(item, ast.AnnAssign):
            continue
        words = ""
        if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            words = " ".join(str(after.value.value).replace("``", "`").split())
        literal = ast.unparse(item.annotation)
        if "Literal" in literal:
            choices = ", ".join(literal.partition("[")[2].rpartition("]")[0].split(", "))
            words += f" One of {choices}." if "Mode" not in literal else ""
        default = "needed" if item.value is None else f"`{_default(item.value)}`"
        yield f"| `{ast.unparse(item.target)}` | {default} | {words.strip()} |"


def _default(value: ast.expr) -> str:
    text = ast.unparse(value)
    known = {"None": "left out", "()": "[]", "True": "true", "False": "false"}
    return known.get(text, "empty" if text.startswith("field(") else text)


def _section(device: DeviceSpec) -> Iterator[str]:
    table = device.modbus or device.stream or device.process
    assert table is not None, "a device other than a drive is an instrument"
    yield f"## {device.name}\n"
    described = device.description.strip().replace("<", "\\<")
    yield f"{device.maker}: {device.model}. {described}\n"
    yield f"- bus of kind {_line(device)}, {_how(device)}"
    yield f"- {table.rate:g} conversions per second, age of a value {table.filter_delay * 1e3:g} ms"
    if device.commands:
        names = (f"{name}{' (writes its EEPROM)' * last}" for name, last in device.commands.items())
        yield f"- commands: {', '.join(names)}"
    yield f"- {_TRUST[device.trust]}: {device.source}"
    if device.unconfirmed:
        yield f"- without a source: {'; '.join(device.unconfirmed)}"


def _line(device: DeviceSpec) -> str:
    if device.modbus is not None:
        return "`modbus-rtu` or `modbus-tcp`"
    return "`serial`" if device.stream is not None else "`can`"


def _how(device: DeviceSpec) -> str:
    if device.modbus is not None:
        return "polled"
    if device.stream is not None:
        return "polled" if device.stream.mode == "polled" else "continuous"
    return "continuous" if device.process and device.process.tpdo else "polled"


if __name__ == "__main__":
    found = [read_device(find("devices", name)) for name in names("devices")]
    PAGE.write_text(page(found), encoding="utf-8")
    DRIVE_PAGE.write_text(drive_page(), encoding="utf-8")

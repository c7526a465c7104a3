"""Writes docs/devices.md from the instruments' device files: ``python docs/make_devices.py``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from winchkit.catalog import find, names
from winchkit.schema.device import DeviceSpec
from winchkit.schema.read import read_device

PAGE = Path(__file__).with_name("devices.md")
_BEGIN = """\
# Instruments

Written by `python docs/make_devices.py` from the device files; do not edit it by hand. The same
files drive the readers and the simulated instruments. None has been tried on the device yet.
"""
_TRUST = {
    "manual": "read in its manual",
    "interoperability": "tried with another program",
    "hardware": "tried on the device",
    "generic": "not the word of any manual",
}


def page(devices: Sequence[DeviceSpec]) -> str:
    """The page: each instrument with what its file declares."""
    instruments = [device for device in devices if device.servo is None]
    return "\n".join([_BEGIN, *("\n".join(_section(device)) + "\n" for device in instruments)])


def _section(device: DeviceSpec) -> Iterator[str]:
    table = device.modbus or device.stream or device.process
    assert table is not None, "a device that is no drive is an instrument"
    yield f"## {device.name}\n"
    described = device.description.strip().replace("<", "\\<")
    yield f"{device.maker}: {device.model}. {described}\n"
    yield f"- on a line of kind {_line(device)}, {_how(device)}"
    yield f"- {table.rate:g} conversions a second, a value is {table.filter_delay * 1e3:g} ms old"
    if device.commands:
        told = (f"{name}{' (writes its EEPROM)' * last}" for name, last in device.commands.items())
        yield f"- commands: {', '.join(told)}"
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
        return "polled" if device.stream.mode == "polled" else "sends by itself"
    return "sends by itself" if device.process and device.process.tpdo else "polled"


if __name__ == "__main__":
    found = [read_device(find("devices", name)) for name in names("devices")]
    PAGE.write_text(page(found), encoding="utf-8")

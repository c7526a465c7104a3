"""What a device file declares: a servo drive or a Modbus instrument, with source and trust."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from winchkit.schema.quantity import Duration, PositiveDuration, PositiveNumber

__all__ = ["DeviceSpec", "FieldSpec", "PdoSpec", "ReadBlock", "ServoSpec", "CommandSpec", "ModbusSpec"]


@dataclass(frozen=True)
class PdoSpec:
    """One PDO: its objects in order as ``index`` or ``index:sub``, e.g. ``0x6041`` ``0x6064``."""

    number: int
    objects: tuple[str, ...]
    transmission: int = 1
    """CANopen transmission type; 1 is every SYNC."""


@dataclass(frozen=True)
class ServoSpec:
    """A CiA 402 drive."""

    eds: str
    """Name of the EDS file beside the device file."""
    modes: tuple[Literal["PP", "PV", "PT", "HM", "IP", "CSP", "CSV", "CST"], ...]
    motion_mode: Literal["CSP", "CSV", "PV"] = "CSV"
    increments_per_turn: int = 65_536
    """Position units of one motor turn unless objects 608Fh/6091h say otherwise."""
    speed_unit: Literal["increments/s", "rpm", "0.1 rpm"] = "increments/s"
    rated_torque: PositiveNumber = 1.0
    """N m, unless object 6076h says otherwise."""
    tpdo: tuple[PdoSpec, ...] = ()
    rpdo: tuple[PdoSpec, ...] = ()
    boot_time: Duration = 1.0


@dataclass(frozen=True)
class FieldSpec:
    """One value within a read block of Modbus registers."""

    name: str
    register: int
    type: Literal["u16", "i16", "u32", "i32", "f32"]
    order: Literal["ABCD", "CDAB", "BADC", "DCBA"] = "ABCD"
    unit: str = "1"
    scale: float = 1.0
    """Physical value in ``unit`` of one count."""
    sign_bit: int | None = None
    """Bit of the status word that makes this magnitude negative."""


@dataclass(frozen=True)
class ReadBlock:
    """Registers that are read in one query, so that they belong together."""

    start: int
    count: int
    function: Literal[3, 4] = 3


@dataclass(frozen=True)
class CommandSpec:
    """A command (tare, zero): the value written to a register."""

    register: int
    value: int


@dataclass(frozen=True)
class ModbusSpec:
    """An instrument read over Modbus RTU or TCP."""

    read: ReadBlock
    field: tuple[FieldSpec, ...]
    status_register: int | None = None
    status: Mapping[str, int] = field(default_factory=dict)
    """Status bits by meaning: overload, underload, unstable, fault, …"""
    command: Mapping[str, CommandSpec] = field(default_factory=dict)
    rate: PositiveNumber = 100.0
    """Conversions per second."""
    filter_delay: Duration = 0.0
    longest_reply: PositiveDuration = 0.1


@dataclass(frozen=True)
class DeviceSpec:
    """A device; one of ``servo`` and ``modbus`` is given."""

    name: str
    maker: str
    model: str
    source: str
    """Where its numbers come from: a manual's name and page."""
    trust: Literal["manual", "interoperability", "hardware", "generic"]
    servo: ServoSpec | None = None
    modbus: ModbusSpec | None = None
    description: str = ""
    path: str = field(default="", compare=False)

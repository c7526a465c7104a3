"""What a device file declares: a servo drive or a Modbus instrument, with source and trust."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from winchkit.schema.quantity import Duration, PositiveDuration, PositiveNumber, Quantity
from winchkit.schema.table import Rule, Table

__all__ = [
    "REGISTERS",
    "CommandSpec",
    "DeviceSpec",
    "FieldSpec",
    "ModbusSpec",
    "Mode",
    "PdoSpec",
    "ReadBlock",
    "ServoSpec",
    "StatusMeaning",
]

Mode = Literal["PP", "PV", "PT", "HM", "IP", "CSP", "CSV", "CST"]
StatusMeaning = Literal["fault", "overload", "underload", "stable", "unstable", "net", "zero"]

REGISTERS: dict[str, int] = {"u16": 1, "i16": 1, "u32": 2, "i32": 2, "f32": 2}
"""Registers that a value of each type takes."""


@dataclass(frozen=True)
class PdoSpec(Table):
    """One PDO: its objects in order as ``index`` or ``index:sub``, e.g. ``0x6041`` ``0x6064``."""

    number: int
    """Counted from 1; TPDO 1 has its communication record at 1800h."""
    objects: tuple[str, ...]
    transmission: int = 1
    """CANopen transmission type; 1 is every SYNC."""


@dataclass(frozen=True)
class ServoSpec(Table):
    """A CiA 402 drive."""

    eds: str
    """Name of the EDS file beside the device file."""
    modes: tuple[Mode, ...]
    motion_mode: Literal["CSP", "CSV", "PV"] = "CSV"
    """The mode in which the bench moves it."""
    increments_per_turn: int = 65_536
    """Position units of one motor turn unless objects 608Fh/6091h say otherwise."""
    speed_unit: Literal["increments/s", "rpm", "0.1 rpm"] = "increments/s"
    """Of 606Ch, 60FFh, 6081h and, per second, of 6083h to 6085h."""
    rated_torque: Annotated[float, Quantity("torque", 0.0, above=True)] = 1.0
    """N m, unless object 6076h says otherwise."""
    tpdo: tuple[PdoSpec, ...] = ()
    rpdo: tuple[PdoSpec, ...] = ()
    boot_time: Duration = 1.0
    """From power-on or NMT reset to the boot-up message at the latest, s."""


@dataclass(frozen=True)
class FieldSpec(Table):
    """One value within a read block of Modbus registers."""

    name: str
    register: int
    """Wire address (from 0) of its first register."""
    type: Literal["u16", "i16", "u32", "i32", "f32"]
    order: Literal["ABCD", "CDAB", "BADC", "DCBA"] = "ABCD"
    """Bytes as they come over the wire; A is the most significant. 16-bit types: AB or BA."""
    unit: str = "1"
    scale: float = 1.0
    """Physical value in ``unit`` of one count."""
    sign_bit: int | None = None
    """Bit of the status word that makes this magnitude negative."""


@dataclass(frozen=True)
class ReadBlock(Table):
    """Registers that are read in one query, so that they belong together."""

    start: int
    """Wire address (from 0)."""
    count: int
    function: Literal[3, 4] = 3
    fixed: bool = False
    """The device answers this length only, so queries cannot alternate with ``count + 1``."""


@dataclass(frozen=True)
class CommandSpec(Table):
    """A command (tare, zero): the value written to a register (wire address, from 0)."""

    register: int
    value: int


@dataclass(frozen=True)
class ModbusSpec(Table):
    """An instrument read over Modbus RTU or TCP."""

    read: ReadBlock
    field: tuple[FieldSpec, ...]
    value: str
    """Name of the field that is the measurement."""
    status_register: int | None = None
    status: Mapping[StatusMeaning, tuple[int, ...]] = dataclasses.field(default_factory=dict)
    """Status bits by meaning."""
    command: Mapping[str, CommandSpec] = dataclasses.field(default_factory=dict)
    rate: PositiveNumber = 100.0
    """Conversions per second."""
    filter_delay: Duration = 0.0
    """By this much a value is older than the moment at which it was read, s."""
    longest_reply: PositiveDuration = 0.1
    """After this long a reply cannot come any more, s."""

    def rules(self) -> Iterator[Rule]:
        """What is measured is among the fields, and every field within the block that is read."""
        names = [field.name for field in self.field]
        if self.value not in names:
            yield "value", f"'{self.value}' is none of the fields {', '.join(names) or '(none)'}"
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield "field", f"{names.count(name)} fields are named '{name}'"
        first, last = self.read.start, self.read.start + self.read.count - 1
        for field in self.field:
            end = field.register + REGISTERS[field.type] - 1
            if field.register < first or end > last:
                where = f"registers {field.register} to {end}"
                yield (
                    "field",
                    f"'{field.name}' in {where} is not within the block {first} to {last}",
                )
            if field.sign_bit is not None and self.status_register is None:
                yield "status_register", f"missing; '{field.name}' takes its sign from there"
        if self.status and self.status_register is None:
            yield "status_register", "missing; the status bits stand there"


@dataclass(frozen=True)
class DeviceSpec(Table):
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
    path: str = dataclasses.field(default="", compare=False)

    def rules(self) -> Iterator[Rule]:
        """A device is of one kind."""
        if (self.servo is None) == (self.modbus is None):
            yield "", "a device has exactly one of the tables [servo] and [modbus]"

"""Contents of a device file of an instrument that is read over Modbus."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from winchkit.schema.devices.register_numbers import address_of
from winchkit.schema.quantity import (
    Duration,
    Flag,
    Number,
    PositiveDuration,
    PositiveRate,
    Whole,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table
from winchkit.units import dimension_of

StatusMeaning = Literal[
    "fault", "overload", "underload", "stable", "unstable", "net", "zero", "valid", "busy"
]
"""``valid``: the value is valid only while it is set. ``busy``: the value is an old one while it is
set. ``zero``: the gross value is within a quarter of a count of zero."""
ValueType = Literal["u16", "i16", "u32", "i32", "f32"]
Order = Literal["ABCD", "CDAB", "BADC", "DCBA"]
"""Order of the bytes on the line; A is the most significant. 16-bit types: AB or BA."""

REGISTERS: dict[str, int] = {"u16": 1, "i16": 1, "u32": 2, "i32": 2, "f32": 2}
"""Registers that a value of each type takes."""
_RANGES: dict[str, tuple[float, float]] = {
    "u16": (0, 0xFFFF),
    "i16": (-0x8000, 0x7FFF),
    "u32": (0, 0xFFFFFFFF),
    "i32": (-0x80000000, 0x7FFFFFFF),
    "f32": (-3.4e38, 3.4e38),
}


@dataclass(frozen=True)
class DecimalsSpec(Table):
    """Bits of a register with the number of decimals of the counts."""

    register: int
    """Wire address (from 0), within a block that is read."""
    bit: Annotated[int, Whole(0, 15)] = 0
    """Lowest bit of the number."""
    bits: Annotated[int, Whole(1, 16)] = 16


@dataclass(frozen=True)
class FieldSpec(Table):
    """One value within a read block of Modbus registers."""

    name: str
    register: int
    """Wire address (from 0) of its first register."""
    type: ValueType
    order: Order = "ABCD"
    unit: str = "1"
    scale: Number = 1.0
    """Physical value in ``unit`` of one count."""
    sign_bit: int | None = None
    """Bit of the status word that makes this magnitude negative."""
    limit: Number | None = None
    """Largest count that the device shows without a flag; a larger one contradicts its status and
    is invalid."""
    decimals: DecimalsSpec | None = None
    """Counts are divided by ten to this power, which is read from the device."""


_ADDRESSES = 0x10000
"""Registers of a table: an address has 16 bits."""


@dataclass(frozen=True)
class ReadBlock(Table):
    """Registers that are read in one query, so that they are consistent."""

    start: int
    """Wire address (from 0); a file may give a manual's ``register`` (40008) in its place."""
    count: Annotated[int, Whole(1, 125)]
    function: Literal[3, 4] = 3
    fixed: Flag = False
    """The device answers only this length, so that queries cannot alternate with ``count + 1``."""

    @property
    def end(self) -> int:
        """The address behind the last one."""
        return self.start + self.count

    @property
    def doubt(self) -> str:
        """Why the start is likely a register's number of a manual; empty where it is not."""
        found = address_of(self.start) if self.start < _ADDRESSES else None
        if found is None:
            return ""
        return (
            f"{self.start} looks like a register's number, of which the leading digit is the kind, "
            f"not like an address: write register = {self.start} in place of start, and all "
            f"registers as the manual numbers them; or start = {found[0]}, function = {found[1]} "
            "and addresses"
        )

    def rules(self) -> Iterator[Rule]:
        """An address has 16 bits."""
        if not 0 <= self.start < _ADDRESSES:
            number = address_of(self.start)
            hint = "" if number is None else f"; register = {self.start} is a manual's number"
            yield "start", f"{self.start} is no address (0 to {_ADDRESSES - 1}){hint}"


@dataclass(frozen=True)
class UnlockStep(Table):
    """A register that must be written before a command."""

    register: int
    value: Annotated[int, Whole(0, 0xFFFF)]


@dataclass(frozen=True, kw_only=True)
class VerifiedCommand(Table):
    """A command of an instrument, whose execution its status shows."""

    comes: StatusMeaning | None = None
    """Status that is set when the command has been executed."""
    goes: StatusMeaning | None = None
    """Status that is cleared when the command has been executed."""
    within: PositiveDuration = 1.0
    """Longest time to that status, s."""
    permanent: Flag = False
    """It writes the device's EEPROM: only ``winchkit cell store`` sends it."""


def unverified(
    commands: Mapping[str, VerifiedCommand], bits: Mapping[StatusMeaning, tuple[int, ...]]
) -> Iterator[Rule]:
    """Commands that a status without a bit verifies."""
    for name, command in commands.items():
        for meaning in (command.comes, command.goes):
            if meaning is not None and meaning not in bits:
                yield (
                    "command",
                    f"'{name}' is verified by the status '{meaning}', which has no bit",
                )


@dataclass(frozen=True, kw_only=True)
class CommandSpec(VerifiedCommand):
    """A command (tare, zero): the value written to a register (wire address, from 0)."""

    register: int
    value: Number
    type: ValueType = "u16"
    order: Order = "ABCD"
    function: Literal[6, 16] = 6
    """Modbus function; two registers always take 16."""
    unlock: tuple[UnlockStep, ...] = ()
    """Written before it, with the same function."""

    @property
    def writes_many(self) -> bool:
        """Whether it is written by function 16."""
        return self.function == 16 or REGISTERS[self.type] > 1

    def rules(self) -> Iterator[Rule]:
        """The value is within the range of its type, and a whole number unless it is a float."""
        if self.type != "f32" and self.value != int(self.value):
            yield "value", f"{self.value:g} is not a whole number, as {self.type} requires"
        low, high = _RANGES[self.type]
        if not low <= self.value <= high:
            yield "value", f"{self.value:g} is beyond what {self.type} holds, {low:g} to {high:g}"


@dataclass(frozen=True)
class BusLink(Table):
    """Factory settings of the line."""

    baudrate: WholeNumber = 9600
    parity: Literal["N", "E", "O"] = "N"
    stopbits: Literal[1, 2] = 1


@dataclass(frozen=True)
class ModbusSpec(Table):
    """An instrument read over Modbus RTU or TCP."""

    read: ReadBlock
    field: tuple[FieldSpec, ...]
    value: str
    """Name of the field that is the measurement; a field ``gross`` is it before any tare."""
    status_read: ReadBlock | None = None
    """A second block with status and decimals, for a device where one query cannot read all. It
    is read after the value; the status before and the one after both apply to the value."""
    status_register: int | None = None
    status_type: ValueType = "u16"
    status_order: Order = "ABCD"
    status: Mapping[StatusMeaning, tuple[int, ...]] = dataclasses.field(default_factory=dict)
    """Status bits by meaning; any of the bits is sufficient."""
    command: Mapping[str, CommandSpec] = dataclasses.field(default_factory=dict)
    identity: tuple[FieldSpec, ...] = ()
    """Fields of `winchkit cell info`: serial number, firmware."""
    link: BusLink | None = None
    """Factory settings of the line."""
    max_registers: Annotated[int, Whole(1, 125)] = 125
    """Largest number of registers in one query."""
    gap: Duration = 0.0
    """Least pause between an answer and the next query, s."""
    rate: PositiveRate = 100.0
    """Conversions per second."""
    filter_delay: Duration = 0.0
    """Age of a value when it is read, s."""
    longest_reply: PositiveDuration = 0.1
    """Longest time to a reply, s."""

    def rules(self) -> Iterator[Rule]:
        """The measured value is a field, and all fields are within the blocks that are read."""
        names = [field.name for field in self.field]
        if self.value not in names:
            yield "value", f"'{self.value}' is none of the fields {', '.join(names) or '(none)'}"
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield "field", f"{names.count(name)} fields are named '{name}'"
        for field in self.field:
            yield from self._field_rules(field)
        yield from self._status_rules()
        for key, block in (("read", self.read), ("status_read", self.status_read)):
            wanted = 0 if block is None else block.count + (not block.fixed)
            if wanted > self.max_registers:
                yield key, f"asks for {wanted} registers of {self.max_registers} at most"

    def holds(self, first: int, count: int) -> bool:
        """Whether the registers lie within one of the blocks that are read."""
        blocks = [block for block in (self.read, self.status_read) if block is not None]
        return any(block.start <= first and first + count <= block.end for block in blocks)

    def _field_rules(self, field: FieldSpec) -> Iterator[Rule]:
        end = field.register + REGISTERS[field.type]
        if field.register < self.read.start or end > self.read.end:
            yield (
                "field",
                f"'{field.name}' in registers {field.register} to {end - 1} is not within the "
                f"block {self.read.start} to {self.read.end - 1}",
            )
        if dimension_of(field.unit) is None:
            yield "field", f"'{field.name}' has the unknown unit '{field.unit}'"
        if field.sign_bit is not None and self.status_register is None:
            yield "status_register", f"missing; '{field.name}' takes its sign from there"
        if field.decimals is not None and not self.holds(field.decimals.register, 1):
            yield "field", f"'{field.name}': the register of its decimals is in no block"

    def _status_rules(self) -> Iterator[Rule]:
        if self.status_register is None:
            if self.status:
                yield "status_register", "missing; it is the register of the status bits"
        elif not self.holds(self.status_register, REGISTERS[self.status_type]):
            yield "status_register", f"{self.status_register} is in no block that is read"
        yield from unverified(self.command, self.status)

"""Parts of a Modbus device's declaration: fields, read blocks, commands, its line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from winchkit.schema.quantity import Flag, Number, PositiveDuration, Whole, WholeNumber
from winchkit.schema.table import Rule, Table

__all__ = [
    "REGISTERS",
    "BusLink",
    "CommandSpec",
    "DecimalsSpec",
    "FieldSpec",
    "Order",
    "ReadBlock",
    "StatusMeaning",
    "UnlockStep",
    "ValueType",
]

StatusMeaning = Literal[
    "fault", "overload", "underload", "stable", "unstable", "net", "zero", "valid", "busy"
]
"""``valid``: without it there is no value. ``busy``: with it the value is an old one. ``zero``: the
gross value is within a quarter of a count of zero."""
ValueType = Literal["u16", "i16", "u32", "i32", "f32"]
Order = Literal["ABCD", "CDAB", "BADC", "DCBA"]
"""Bytes as they come over the wire; A is the most significant. 16-bit types: AB or BA."""

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
    """Where the device says how many decimals its counts have: bits of a register."""

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
    """The device never shows more counts than this without a flag; what is beyond contradicts
    its status, and is no number."""
    decimals: DecimalsSpec | None = None
    """Counts are divided by ten to this power, which the device tells itself."""


@dataclass(frozen=True)
class ReadBlock(Table):
    """Registers that are read in one query, so that they belong together."""

    start: int
    """Wire address (from 0)."""
    count: Annotated[int, Whole(1, 125)]
    function: Literal[3, 4] = 3
    fixed: Flag = False
    """The device answers this length only, so queries cannot alternate with ``count + 1``."""

    @property
    def end(self) -> int:
        """The address behind the last one."""
        return self.start + self.count


@dataclass(frozen=True)
class UnlockStep(Table):
    """A register that must be written before a command is taken."""

    register: int
    value: Annotated[int, Whole(0, 0xFFFF)]


@dataclass(frozen=True)
class CommandSpec(Table):
    """A command (tare, zero): the value written to a register (wire address, from 0)."""

    register: int
    value: Number
    type: ValueType = "u16"
    order: Order = "ABCD"
    function: Literal[6, 16] = 6
    """Modbus function; two registers always take 16."""
    unlock: tuple[UnlockStep, ...] = ()
    """Written before it, with the same function."""
    comes: StatusMeaning | None = None
    """This status must come, or the command was not obeyed."""
    goes: StatusMeaning | None = None
    """This status must go, or the command was not obeyed."""
    within: PositiveDuration = 1.0
    """So long the status may take, s."""
    permanent: Flag = False
    """It writes the device's EEPROM: only ``winchkit cell store`` sends it."""

    @property
    def writes_many(self) -> bool:
        """Whether it goes out as function 16."""
        return self.function == 16 or REGISTERS[self.type] > 1

    def rules(self) -> Iterator[Rule]:
        """A number that the type holds: a whole one, unless it is a float."""
        if self.type != "f32" and self.value != int(self.value):
            yield "value", f"{self.value:g} is no whole number, as {self.type} is"
        low, high = _RANGES[self.type]
        if not low <= self.value <= high:
            yield "value", f"{self.value:g} is beyond what {self.type} holds, {low:g} to {high:g}"


@dataclass(frozen=True)
class BusLink(Table):
    """A line as the device is set in the factory."""

    baudrate: WholeNumber = 9600
    parity: Literal["N", "E", "O"] = "N"
    stopbits: Literal[1, 2] = 1

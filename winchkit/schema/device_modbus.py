"""What a device file declares of an instrument that is read over Modbus."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from winchkit.schema.modbus_parts import (
    REGISTERS,
    BusLink,
    CommandSpec,
    DecimalsSpec,
    FieldSpec,
    Order,
    ReadBlock,
    StatusMeaning,
    UnlockStep,
    ValueType,
)
from winchkit.schema.quantity import Duration, PositiveDuration, PositiveNumber, Whole
from winchkit.schema.table import Rule, Table
from winchkit.units import dimension_of

__all__ = [
    "REGISTERS",
    "BusLink",
    "CommandSpec",
    "DecimalsSpec",
    "FieldSpec",
    "ModbusSpec",
    "ReadBlock",
    "StatusMeaning",
    "UnlockStep",
]


@dataclass(frozen=True)
class ModbusSpec(Table):
    """An instrument read over Modbus RTU or TCP."""

    read: ReadBlock
    field: tuple[FieldSpec, ...]
    value: str
    """Name of the field that is the measurement; a field ``gross`` is it before any tare."""
    status_read: ReadBlock | None = None
    """A second block with status and decimals, for a device where one query cannot hold all. It
    is read after the value; the status before and the one after both count for the value."""
    status_register: int | None = None
    status_type: ValueType = "u16"
    status_order: Order = "ABCD"
    status: Mapping[StatusMeaning, tuple[int, ...]] = dataclasses.field(default_factory=dict)
    """Status bits by meaning; any of the bits will do."""
    command: Mapping[str, CommandSpec] = dataclasses.field(default_factory=dict)
    identity: tuple[FieldSpec, ...] = ()
    """What `winchkit cell info` asks once: serial number, firmware."""
    link: BusLink | None = None
    """The device's factory setting of its line."""
    max_registers: Annotated[int, Whole(1, 125)] = 125
    """It answers at most so many in one query."""
    gap: Duration = 0.0
    """Silence that it needs between an answer and the next query, s."""
    rate: PositiveNumber = 100.0
    """Conversions per second."""
    filter_delay: Duration = 0.0
    """By this much a value is older than the moment at which it was read, s."""
    longest_reply: PositiveDuration = 0.1
    """After this long a reply cannot come any more, s."""

    def rules(self) -> Iterator[Rule]:
        """What is measured is among the fields, everything within what is read."""
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
                yield "status_register", "missing; the status bits stand there"
        elif not self.holds(self.status_register, REGISTERS[self.status_type]):
            yield "status_register", f"{self.status_register} is in no block that is read"
        for name, command in self.command.items():
            for meaning in (command.comes, command.goes):
                if meaning is not None and meaning not in self.status:
                    yield (
                        "command",
                        f"'{name}' is verified by the status '{meaning}', which has no bit",
                    )

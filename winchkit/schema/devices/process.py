"""What a device file declares of a CANopen instrument: a process value, as CiA 404 has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from winchkit.schema.devices.modbus import StatusMeaning
from winchkit.schema.devices.servo import PdoSpec
from winchkit.schema.quantity import (
    Duration,
    Flag,
    Number,
    PositiveDuration,
    PositiveNumber,
    Whole,
)
from winchkit.schema.table import Rule, Table
from winchkit.units import dimension_of

__all__ = ["ProcessCommand", "ProcessSpec"]


@dataclass(frozen=True)
class ProcessCommand(Table):
    """A command: the value written to an object."""

    object: str
    """As ``0x2104`` or ``0x2104:1``."""
    value: Annotated[int, Whole(0, 0xFFFFFFFF)]
    comes: StatusMeaning | None = None
    """This status must come, or the command was not obeyed."""
    goes: StatusMeaning | None = None
    """This status must go, or the command was not obeyed."""
    within: PositiveDuration = 1.0
    """So long the status may take, s."""
    permanent: Flag = False
    """It writes the device's EEPROM: only ``winchkit cell store`` sends it."""


@dataclass(frozen=True)
class ProcessSpec(Table):
    """A CANopen instrument. With ``tpdo`` it sends its values itself, else they are asked for."""

    eds: str
    """Name of the EDS file beside the device file; it has the objects' types."""
    value: str = "0x6130:1"
    """Object of the process value; CiA 404 has it in 6130h as REAL32."""
    type: Literal["f32", "integer"] = "f32"
    """An integer has the size and sign that the EDS gives it."""
    unit: str = "N"
    scale: Number = 1.0
    """Physical value in ``unit`` of one count."""
    limit: Number | None = None
    """The device never shows more counts than this without a flag."""
    status: str | None = None
    """Object with the status bits; CiA 404 has it in 6150h."""
    bits: Mapping[StatusMeaning, tuple[int, ...]] = field(default_factory=dict)
    """Status bits by meaning; any of the bits will do."""
    tpdo: tuple[PdoSpec, ...] = ()
    command: Mapping[str, ProcessCommand] = field(default_factory=dict)
    rate: PositiveNumber = 50.0
    """Conversions per second."""
    filter_delay: Duration = 0.0
    """By this much a value is older than the moment at which it was sent, s."""

    def rules(self) -> Iterator[Rule]:
        """The value is in one PDO with its status, so that they belong together."""
        if dimension_of(self.unit) is None:
            yield "unit", f"unknown unit '{self.unit}'"
        if self.bits and self.status is None:
            yield "status", "missing; the status bits stand there"
        wanted = {self.value} | ({self.status} if self.status else set())
        if self.tpdo and not any(wanted <= set(pdo.objects) for pdo in self.tpdo):
            yield "tpdo", f"none of them carries {' and '.join(sorted(wanted))}"
        for name, command in self.command.items():
            for meaning in (command.comes, command.goes):
                if meaning is not None and meaning not in self.bits:
                    yield (
                        "command",
                        f"'{name}' is verified by the status '{meaning}', which has no bit",
                    )

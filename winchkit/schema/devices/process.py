"""Contents of a device file of a CANopen instrument: a process value after CiA 404."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from winchkit.schema.devices.modbus import StatusMeaning, VerifiedCommand, unverified
from winchkit.schema.devices.servo import PdoSpec
from winchkit.schema.quantity import Duration, Number, PositiveRate, Whole
from winchkit.schema.table import Rule, Table
from winchkit.units import dimension_of


@dataclass(frozen=True, kw_only=True)
class ProcessCommand(VerifiedCommand):
    """A command: the value written to an object."""

    object: str
    """As ``0x2104`` or ``0x2104:1``."""
    value: Annotated[int, Whole(0, 0xFFFFFFFF)]


@dataclass(frozen=True)
class ProcessSpec(Table):
    """A CANopen instrument. With ``tpdo`` it sends its values, else they are read by SDO."""

    eds: str
    """Name of the EDS file beside the device file; it has the objects' types."""
    value: str = "0x6130:1"
    """Object of the process value; 6130h (REAL32) in CiA 404."""
    type: Literal["f32", "integer"] = "f32"
    """Type; an integer has the size and sign of its declaration in the EDS."""
    unit: str = "N"
    scale: Number = 1.0
    """Physical value in ``unit`` of one count."""
    limit: Number | None = None
    """Largest count that the device shows without a flag."""
    status: str | None = None
    """Object with the status bits; 6150h in CiA 404."""
    bits: Mapping[StatusMeaning, tuple[int, ...]] = field(default_factory=dict)
    """Status bits by meaning; any of the bits is sufficient."""
    tpdo: tuple[PdoSpec, ...] = ()
    command: Mapping[str, ProcessCommand] = field(default_factory=dict)
    rate: PositiveRate = 50.0
    """Conversions per second."""
    filter_delay: Duration = 0.0
    """Age of a value when it is sent, s."""

    def rules(self) -> Iterator[Rule]:
        """The value and its status are in one PDO, so that they are consistent."""
        if dimension_of(self.unit) is None:
            yield "unit", f"unknown unit '{self.unit}'"
        if self.bits and self.status is None:
            yield "status", "missing; it is the object of the status bits"
        wanted = {self.value} | ({self.status} if self.status else set())
        if self.tpdo and not any(wanted <= set(pdo.objects) for pdo in self.tpdo):
            yield "tpdo", f"none of them carries {' and '.join(sorted(wanted))}"
        yield from unverified(self.command, self.bits)

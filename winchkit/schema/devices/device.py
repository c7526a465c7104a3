"""Contents of a device file: a device of one kind, with source and confirmation of its values."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from winchkit.schema.devices.modbus import ModbusSpec
from winchkit.schema.devices.process import ProcessSpec
from winchkit.schema.devices.servo import ServoSpec
from winchkit.schema.devices.stream import StreamSpec
from winchkit.schema.table import Rule, Table
from winchkit.units import dimension_of

TABLES = ("servo", "modbus", "stream", "process")
"""One for each kind of device."""


@dataclass(frozen=True)
class DeviceSpec(Table):
    """A device; exactly one of its tables is given."""

    name: str
    maker: str
    model: str
    source: str
    """Source of its values: a manual's name and page."""
    trust: Literal["manual", "interoperability", "hardware", "generic", "eds"]
    """Confirmation of its values: by the manual, another program, the device itself, only the
    maker's EDS (``eds``), or none (a generic file)."""
    servo: ServoSpec | None = None
    modbus: ModbusSpec | None = None
    stream: StreamSpec | None = None
    process: ProcessSpec | None = None
    unconfirmed: tuple[str, ...] = ()
    """Values without a source, to be compared with the manual."""
    description: str = ""
    path: str = dataclasses.field(default="", compare=False)

    @property
    def kind(self) -> str:
        """Name of the table that is given."""
        return next((table for table in TABLES if getattr(self, table) is not None), "nothing")

    @property
    def instrument(self) -> ModbusSpec | StreamSpec | ProcessSpec | None:
        """The table of an instrument; None for a drive."""
        return self.modbus or self.stream or self.process

    @property
    def unit(self) -> str:
        """Unit of the value of an instrument; empty for a drive, or where a frame names several."""
        if self.modbus is not None:
            fields = (one.unit for one in self.modbus.field if one.name == self.modbus.value)
            return next(fields, "")
        if self.stream is not None:
            units = {one.unit for one in self.stream.units.values()} or {self.stream.unit}
            return units.pop() if len(units) == 1 else ""
        return "" if self.process is None else self.process.unit

    @property
    def dimension(self) -> str | None:
        """Dimension of the value of an instrument; None for a drive and for unknown units."""
        if self.stream is not None:
            return self.stream.dimension()
        return dimension_of(self.unit) if self.unit else None

    @property
    def commands(self) -> dict[str, bool]:
        """Commands of an instrument by name, and whether each writes its EEPROM."""
        table = self.instrument
        if table is None:
            return {}
        return {name: getattr(item, "permanent", False) for name, item in table.command.items()}

    def rules(self) -> Iterator[Rule]:
        """A device is of one kind."""
        if sum(getattr(self, table) is not None for table in TABLES) != 1:
            *most, last = (f"[{table}]" for table in TABLES)
            yield "", f"a device has exactly one of the tables {', '.join(most)} and {last}"

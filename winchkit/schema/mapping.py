"""Contents of a mapping (kind ``mapping``): the channels and units of another program's columns."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated

from winchkit.errors import UsageError, suggest
from winchkit.schema.quantity import Frequency, Marker, Number
from winchkit.schema.table import Rule, Table
from winchkit.units import UNITS, dimension_of

STAMP, EXCEL = "stamp", "excel"
"""Units of a time: text with a date or a time of day; days since 1899-12-30."""
DATE = "date"
"""Channel of a column with the date, beside one with the time of day."""
POSITION = ("platform_x", "platform_y", "platform_z")
QUATERNION = ("platform_qw", "platform_qx", "platform_qy", "platform_qz")
ANGLES = ("platform_roll", "platform_pitch", "platform_yaw")
POSE_DIMENSIONS: dict[str, str] = {
    **dict.fromkeys(POSITION, "length"),
    **dict.fromkeys(QUATERNION, "ratio"),
    **dict.fromkeys(ANGLES, "angle"),
}
"""Dimension of every channel of a robot's platform."""
MATRIX = tuple(f"platform_r{row}{column}" for row in "123" for column in "123")
"""Elements of a platform's rotation matrix, which become its quaternion."""
MODULO, TWOS, MAGNITUDE = "modulo", "two's complement", "sign and magnitude"
"""How numbers are stored that wrap or have lost their sign."""
VECTOR, EULER = "rotation vector", "angles of Rx Ry Rz"
"""How roll, pitch and yaw are stored as the components of a rotation vector, or as the angles of
another product than Rz Ry Rx."""

CHANNEL_DIMENSIONS: dict[str, str] = {
    **{"motor_angle": "angle", "motor_velocity": "angular speed"},
    **{"motor_torque": "torque", "motor_current": "current", "predicted_torque": "torque"},
    **dict.fromkeys(("tension", "tension_gross", "load", "load_gross"), "force"),
    **{"cable_length": "length", "cable_length_gross": "length"},
    **{"temperature": "temperature", "swivel": "angle"},
    **{"position": "length", "velocity": "speed"},
    **dict.fromkeys(("force", "predicted_force"), "force"),
}
"""Dimension of every channel that the model uses, of a winch or of a linear axis."""
CHANNELS: dict[str, str] = {
    "time": "time",
    DATE: "time",
    **CHANNEL_DIMENSIONS,
    **POSE_DIMENSIONS,
    **dict.fromkeys(MATRIX, "ratio"),
}
"""Dimension of every channel that a column may be."""


@dataclass(frozen=True)
class NameOrNumber(Marker):
    """Marks a text that may be written as a number without quotes."""

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        return 'the name of a column in quotes, such as "Torque", or its number'

    def read(self, raw: object) -> str:
        """Convert a value of a file; raises UsageError with the reason."""
        if isinstance(raw, str) or (isinstance(raw, int) and not isinstance(raw, bool)):
            return str(raw)
        raise UsageError(f"expected {self.wanted}, not {raw!r}")


@dataclass(frozen=True)
class MappedColumn(Table):
    """One column: SI value = factor × number + offset."""

    source: Annotated[str, NameOrNumber()]
    """Name of the column in the file, or its number from 1."""
    channel: str
    """Channel of a run, with a winch's name before it where there are several: ``A.tension``."""
    unit: str = ""
    """Unit in the file; with ``factor`` it is a description."""
    factor: Number | None = None
    """SI value of 1; by default that of ``unit``."""
    offset: Number = 0.0
    """SI value of 0."""
    stored: str = ""
    """``modulo 360`` for numbers that wrap there, ``two's complement 65536`` or ``sign and
    magnitude 65536`` for ones without their sign, with the number of values of the field;
    ``rotation vector`` for the three components of one in place of roll, pitch and yaw, ``angles
    of Rx Ry Rz`` for theirs."""
    written: str = ""
    """Unit in the header of the file, where it is another one than ``unit``, which counts."""

    def rules(self) -> Iterator[Rule]:
        """The channel exists, and the factor is known."""
        name = self.channel if self.channel in CHANNELS else self.channel.rpartition(".")[2]
        if name not in CHANNELS or (name != self.channel and name not in CHANNEL_DIMENSIONS):
            message = f"'{self.channel}' is no channel of a run; use one of {', '.join(CHANNELS)}"
            yield "channel", message + suggest(name, list(CHANNELS))
        dimension = CHANNELS.get(name)
        if self.factor is None and self.si is not None and dimension is not None:
            is_stamp = self.unit in {STAMP, EXCEL} and dimension == "time"
            if not is_stamp and self.unit not in UNITS[dimension]:
                yield (
                    "unit",
                    f"'{self.unit}' is not a unit of {dimension}; use one of "
                    f"{', '.join(UNITS[dimension])}, or give `factor`",
                )
        if self.factor is None and self.si is None:
            yield "unit", f"'{self.unit}' has no known SI value; give `factor`, the SI value of 1"
        if self.factor is not None and (self.factor == 0 or not math.isfinite(self.factor)):
            yield "factor", f"{self.factor:g} is not a scale"
        kind, _, size = self.stored.rpartition(" ")
        is_known = kind in {MODULO, TWOS, MAGNITUDE} and _is_positive(size)
        if self.stored not in {"", VECTOR, EULER} and not is_known:
            kinds = f"'{MODULO} N', '{TWOS} N', '{MAGNITUDE} N', '{VECTOR}', '{EULER}'"
            yield "stored", f"'{self.stored}' is none of {kinds}"

    @property
    def si(self) -> float | None:
        """The factor, or that of the unit; None for an unknown unit."""
        if self.factor is not None:
            return self.factor
        if self.unit in {STAMP, EXCEL}:
            return 1.0 if self.unit == STAMP else 86_400.0
        dimension = dimension_of(self.unit)
        return None if dimension is None else UNITS[dimension][self.unit]


def _is_positive(text: str) -> bool:
    try:
        return 0 < float(text) < math.inf
    except ValueError:
        return False


@dataclass(frozen=True)
class MappedLog(Table):
    """Columns of one kind of log; a file that has all of them is such a log."""

    name: str
    column: tuple[MappedColumn, ...]
    sample_rate: Frequency | None = None
    """Rate of the rows where the file has no times, or none to be used."""
    axis: str = ""
    """Column that names the axis of each row; empty where a row is of all axes."""
    kind: str = ""
    """Column that names the kind of each row, where rows have different quantities."""

    def rules(self) -> Iterator[Rule]:
        """Every channel has one column."""
        channels = [item.channel for item in self.column]
        for channel in dict.fromkeys(channels):
            if channels.count(channel) > 1 and channel != "time":
                yield "column", f"{channels.count(channel)} columns are '{channel}'"
        if not channels:
            yield "column", "a log needs at least one [[log.column]]"


@dataclass(frozen=True)
class ImportMapping(Table):
    """Logs of one or several programs."""

    name: str
    log: tuple[MappedLog, ...]
    path: str = field(default="", compare=False)

    def rules(self) -> Iterator[Rule]:
        """There is at least one log."""
        if not self.log:
            yield "log", "a mapping needs at least one [[log]]"

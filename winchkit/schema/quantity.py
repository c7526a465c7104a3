"""The types of file fields: a quantity with its unit in the file, an SI float in the dataclass.

``winding_radius: Length`` reads ``"60 mm"`` and has the value ``0.06``. The marker has the
dimension and the range. pydantic is imported only when a file is read; a dataclass that is built in
code from SI numbers is not checked.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from winchkit.errors import UsageError
from winchkit.schema.plausible import check_size
from winchkit.units import UNITS, article, is_bare, parse

if TYPE_CHECKING:
    from pydantic_core import CoreSchema


class Marker(ABC):
    """Reader of a field within ``Annotated``, with a description of the expected value."""

    @property
    @abstractmethod
    def wanted(self) -> str:
        """Description of the expected value."""

    @abstractmethod
    def read(self, raw: object) -> object:
        """Convert a value of a file; raises UsageError with the reason."""

    def __get_pydantic_core_schema__(
        self, source: object, handler: Callable[[Any], CoreSchema]
    ) -> CoreSchema:
        """Make pydantic read the field by :meth:`read`."""
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(self.read)


@dataclass(frozen=True)
class Quantity(Marker):
    """Marks a float field as a quantity of ``dimension`` within ``[low, high]`` (SI).

    With ``above`` the low end itself is excluded; ``why`` is the reason of the range. The bound of
    the dimension (``plausible``) applies too.
    """

    dimension: str
    low: float = float("-inf")
    high: float = float("inf")
    above: bool = False
    why: str = ""

    def read(self, raw: object) -> float:
        """Convert a value of a file to SI; raises UsageError with the reason."""
        value = parse(raw, self.dimension)
        unit = "" if is_bare(self.dimension) else next(iter(UNITS[self.dimension]))
        reason = f": {self.why}" if self.why else ""
        if value < self.low or (self.above and value == self.low):
            word = "above" if self.above else "at least"
            raise UsageError(f"'{raw}' must be {word} {self.low:g} {unit}".rstrip() + reason)
        if value > self.high:
            raise UsageError(f"'{raw}' must be at most {self.high:g} {unit}".rstrip() + reason)
        return check_size(value, self.dimension, raw)

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        if is_bare(self.dimension):
            return "a number" if self.dimension == "ratio" else article(self.dimension)
        unit = next(iter(UNITS[self.dimension]))
        return f'{article(self.dimension)} with its unit, such as "1 {unit}"'


@dataclass(frozen=True)
class QuantityOrNone(Quantity):
    """A quantity of at least zero; ``"none"`` is zero."""

    low: float = 0.0

    def read(self, raw: object) -> float:
        """Convert a value of a file to SI; raises UsageError with the reason."""
        return 0.0 if raw == "none" else super().read(raw)

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        return f'{super().wanted}, or "none"'


@dataclass(frozen=True)
class Whole(Marker):
    """Marks an int field as a whole number within ``[low, high]``."""

    low: int
    high: int | None = None

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        if self.high is None:
            return f"a whole number of at least {self.low}"
        return f"a whole number from {self.low} to {self.high}"

    def read(self, raw: object) -> int:
        """Check a value of a file; raises UsageError with the range."""
        if isinstance(raw, int) and not isinstance(raw, bool):
            if self.low <= raw <= (raw if self.high is None else self.high):
                return raw
            raise UsageError(f"{raw} is out of range; expected {self.wanted}")
        raise UsageError(f"expected {self.wanted}, not {raw!r}")


@dataclass(frozen=True)
class Truth(Marker):
    """Marks a bool field: ``true`` or ``false``, and neither ``1`` nor ``"yes"``."""

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        return "true or false"

    def read(self, raw: object) -> bool:
        """Check a value of a file."""
        if isinstance(raw, bool):
            return raw
        raise UsageError(f"expected {self.wanted}, not {raw!r}")


Length = Annotated[float, Quantity("length")]
PositiveLength = Annotated[float, Quantity("length", 0.0, above=True)]
PositiveSpeed = Annotated[float, Quantity("speed", 0.0, above=True)]
PositiveAcceleration = Annotated[float, Quantity("acceleration", 0.0, above=True)]
Angle = Annotated[float, Quantity("angle")]
Duration = Annotated[float, Quantity("time", 0.0)]
PositiveDuration = Annotated[float, Quantity("time", 0.0, above=True)]
Frequency = Annotated[float, Quantity("frequency", 0.0, above=True)]
Force = Annotated[float, Quantity("force")]
PositiveForce = Annotated[float, Quantity("force", 0.0, above=True)]
Torque = Annotated[float, Quantity("torque")]
Mass = Annotated[float, Quantity("mass", 0.0)]
PositiveMass = Annotated[float, Quantity("mass", 0.0, above=True)]
LinearDensity = Annotated[float, Quantity("mass per length", 0.0)]
Inertia = Annotated[float, Quantity("inertia", 0.0)]
Temperature = Annotated[float, Quantity("temperature")]
Number = Annotated[float, Quantity("number")]
PositiveNumber = Annotated[float, Quantity("number", 0.0, above=True)]
PositiveRate = Annotated[float, Quantity("number per second", 0.0, above=True)]
Count = Annotated[float, Quantity("number", 0.0)]
Ratio = Annotated[float, Quantity("ratio")]
NonNegativeRatio = Annotated[float, Quantity("ratio", 0.0)]
PositiveRatio = Annotated[float, Quantity("ratio", 0.0, above=True)]
WholeNumber = Annotated[int, Whole(1)]
Flag = Annotated[bool, Truth()]

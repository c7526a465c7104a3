"""Contents of the files of load cells beside a bench: calibration, and tares of the host."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Annotated, Literal

from winchkit.schema.quantity import (
    Force,
    Length,
    Marker,
    NonNegativeRatio,
    Number,
    PositiveForce,
    Ratio,
    Temperature,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table
from winchkit.units import parse

LoadDirection = Literal["tension", "compression"]


@dataclass(frozen=True)
class PointReading(Marker):
    """Marks a reading: a force with its unit, or a number in a unit of its own (counts, mV/V)."""

    @property
    def wanted(self) -> str:
        """Description of the expected value."""
        return 'a force such as "12 N", or a number in the unit of the calibration'

    def read(self, raw: object) -> float:
        """Convert a value of a file; raises UsageError with the reason."""
        if isinstance(raw, int | float) and not isinstance(raw, bool):
            return parse(raw, "ratio")
        return parse(raw, "force")


@dataclass(frozen=True)
class CalibrationPoint(Table):
    """One applied load and the device's reading."""

    load: Force
    indicated: Annotated[float, PointReading()]
    """Mean of the device's gross value, in the unit of the calibration."""
    std: Annotated[float, PointReading()] = 0.0
    """Standard deviation of that mean."""
    going: Literal["up", "down"] = "up"
    """Direction of loading: ``up`` after a smaller load, ``down`` after a larger one."""
    series: WholeNumber = 1


@dataclass(frozen=True)
class CellCalibration(Table):
    """True force in N from the reading x: c0 + c1 x + c2 x^2."""

    name: str
    date: date
    coefficients: tuple[Number, ...]
    """c0 in N, c1 in N per unit of the reading, c2 in N per its square."""
    unit: str = "N"
    """Unit of the reading: N, counts, mV/V, V."""
    device: str = ""
    serial_number: str = ""
    temperature: Temperature | None = None
    direction: LoadDirection = "tension"
    low: Force = 0.0
    high: PositiveForce = float("inf")
    """Lowest and highest load of the calibration."""
    residual_std: Force = 0.0
    nonlinearity: NonNegativeRatio = 0.0
    """Nonlinearity: largest deviation of the mean curve from its line, as a share of the span."""
    hysteresis: NonNegativeRatio = 0.0
    """Hysteresis: largest difference between unloading and loading beyond the zero return, as a
    share of the span."""
    zero_return: Ratio = 0.0
    """Zero return: reading at the smallest load after the largest one less before it, as a share of
    the span."""
    repeatability: NonNegativeRatio = 0.0
    """Repeatability: standard deviation between series at a load, as a share of the span."""
    point: tuple[CalibrationPoint, ...] = ()
    path: str = field(default="", compare=False)

    def rules(self) -> Iterator[Rule]:
        """One to three coefficients, and the true force grows with the indicated one."""
        if not 2 <= len(self.coefficients) <= 3:
            yield "coefficients", f"{len(self.coefficients)} given; two (a line) or three"
        elif self.coefficients[1] <= 0:
            yield "coefficients", f"c1 = {self.coefficients[1]:g} is not positive"


@dataclass(frozen=True)
class HostTare(Table):
    """A tare of the host: subtracted from the calibrated value and not stored in the device."""

    value: Force | Length
    """The subtracted value, N; m for a length instrument."""
    std: Force | Length = 0.0
    """Standard deviation of the mean from which it was taken."""
    taken: datetime | None = None


@dataclass(frozen=True)
class TareBook(Table):
    """The host's tares of one bench, by ``winch.role``."""

    name: str
    tare: Mapping[str, HostTare] = field(default_factory=dict)
    path: str = field(default="", compare=False)


def tare_book_path(bench_path: str) -> str:
    """File of a bench's tares: ``bench.tares.toml`` beside ``bench.toml``."""
    stem = bench_path.removesuffix(".toml")
    return f"{stem}.tares.toml"

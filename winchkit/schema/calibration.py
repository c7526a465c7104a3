"""What files beside a bench declare of its load cells: a calibration, and the host's tares."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from typing import Literal

from winchkit.schema.quantity import (
    Count,
    Force,
    Length,
    Number,
    PositiveForce,
    Temperature,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table

__all__ = ["CalibrationPoint", "CellCalibration", "HostTare", "TareBook", "tare_book_path"]

LoadDirection = Literal["tension", "compression"]


@dataclass(frozen=True)
class CalibrationPoint(Table):
    """One load as it was hung, and what the device showed."""

    load: Force
    indicated: Force
    """Mean of the device's gross value."""
    std: Force = 0.0
    """Of that mean."""
    going: Literal["up", "down"] = "up"
    """Whether the load before it was smaller or larger."""
    series: WholeNumber = 1


@dataclass(frozen=True)
class CellCalibration(Table):
    """True force from the indicated one: c0 + c1 x + c2 x^2, x and the result in N."""

    name: str
    date: date
    coefficients: tuple[Number, ...]
    """c0 in N, c1 without a unit, c2 in 1/N."""
    device: str = ""
    serial_number: str = ""
    temperature: Temperature | None = None
    direction: LoadDirection = "tension"
    low: Force = 0.0
    high: PositiveForce = float("inf")
    """Loads between which it was made."""
    residual_std: Force = 0.0
    nonlinearity: Count = 0.0
    """Largest departure of the mean curve from its straight line, as a share of the span."""
    hysteresis: Count = 0.0
    """Largest difference between going down and going up, as a share of the span."""
    repeatability: Count = 0.0
    """Standard deviation between series at the same load, as a share of the span."""
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
    """A tare of the host: subtracted from the calibrated value, unknown to the device."""

    value: Force | Length
    """Of a length instrument a length."""
    std: Force | Length = 0.0
    """Of the mean that it was taken from."""
    taken: datetime | None = None


@dataclass(frozen=True)
class TareBook(Table):
    """The host's tares of one bench, by ``winch.role``."""

    name: str
    tare: Mapping[str, HostTare] = field(default_factory=dict)
    path: str = field(default="", compare=False)


def tare_book_path(bench_path: str) -> str:
    """Where the tares of a bench stand: beside its wiring file."""
    stem = bench_path.removesuffix(".toml")
    return f"{stem}.tares.toml"

"""Contents of a sizing specification: requirements of a winch, and the parts chosen for it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from winchkit.schema.quantity import (
    Count,
    NonNegativeRatio,
    PositiveForce,
    PositiveLength,
    PositiveNumber,
    PositiveSpeed,
    Quantity,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table

Share = Annotated[float, Quantity("ratio", 0.0, 1.0, above=True)]
Power = Annotated[float, Quantity("power", 0.0, above=True)]
Turning = Annotated[float, Quantity("angular speed", 0.0, above=True)]
PositiveTorque = Annotated[float, Quantity("torque", 0.0, above=True)]
Margin = Annotated[float, Quantity("ratio", 1.0)]


@dataclass(frozen=True)
class RequirementSpec(Table):
    """Requirements of the winch."""

    force: PositiveForce
    """Of the cable, N."""
    speed: PositiveSpeed
    """Of the cable, m/s."""
    cable_length: PositiveLength
    """To be wound, without dead wraps, m."""


@dataclass(frozen=True)
class EfficiencySpec(Table):
    """Losses between motor and cable."""

    gearbox: Share
    belt: Share = 1.0
    """Of one belt drive."""
    belts: Count = 1.0
    """Number of belt drives in series."""
    bearing: Share = 1.0
    """Of one bearing."""
    bearings: Count = 0.0
    """Number of bearings."""


@dataclass(frozen=True)
class MotorChoice(Table):
    """The motor's rated values."""

    power: Power
    """W."""
    speed: Turning
    """Rad/s."""
    torque: PositiveTorque | None = None
    """N m; default is power over speed."""
    margin: Margin = 1.0
    """Safety factor of torque and power."""

    @property
    def rated_torque(self) -> float:
        """N m."""
        return self.power / self.speed if self.torque is None else self.torque


@dataclass(frozen=True)
class WormSpec(Table):
    """Geometry of a worm gear, which determines whether it is self-locking."""

    lead_angle: Annotated[float, Quantity("angle", 0.0, above=True)]
    """Rad."""
    friction: NonNegativeRatio
    """Of the flanks."""
    starts: WholeNumber = 1


@dataclass(frozen=True)
class GearboxChoice(Table):
    """The gearbox between motor and drum."""

    ratio: PositiveNumber
    """Motor turns per drum turn."""
    offered: tuple[PositiveNumber, ...] = (5, 7.5, 10, 15, 20, 25, 30, 40, 50, 60, 80, 100)
    """Ratios that the maker offers, for alternatives."""
    worm: WormSpec | None = None


@dataclass(frozen=True)
class DrumChoice(Table):
    """A grooved drum."""

    winding_radius: PositiveLength
    """Axis to cable centre, m."""
    groove_pitch: PositiveLength
    """m a turn."""
    width: PositiveLength
    """Of the groove, m."""
    full_radius: PositiveLength | None = None
    """Axis to cable centre with all cable wound, m; default is ``winding_radius`` (one layer)."""
    dead_wraps: Annotated[float, Quantity("number", 2.0)] = 2.0
    """Turns that never leave the drum."""

    def rules(self) -> Iterator[Rule]:
        """The full radius is at least the winding radius."""
        if self.full_radius is not None and self.full_radius < self.winding_radius:
            yield (
                "full_radius",
                f"{self.full_radius:g} m is below winding_radius {self.winding_radius:g} m",
            )


@dataclass(frozen=True)
class ScrewChoice(Table):
    """The lead screw of the cable guide."""

    lead: PositiveLength
    """m per screw turn."""
    diameter: PositiveLength
    """Of the core, m."""
    length: PositiveLength
    """Between the bearings, m."""
    ends: Literal["fixed-fixed", "fixed-supported", "supported-supported", "fixed-free"] = (
        "fixed-fixed"
    )
    speed: Turning | None = None
    """Highest speed, rad/s; default is the speed at the required cable speed."""
    nut: Annotated[float, Quantity("length", 0.0)] = 0.0
    """Length of nut and bearings, by which the travel is shorter than the screw, m."""


@dataclass(frozen=True)
class BeltChoice(Table):
    """The toothed belt from drum to screw."""

    module: PositiveLength
    """Pitch over π, m."""
    drum_teeth: WholeNumber
    screw_teeth: WholeNumber
    centre_distance: PositiveLength
    """m."""
    power: Power
    """Transmitted power, W."""

    @property
    def ratio(self) -> float:
        """Screw turns per drum turn."""
        return self.drum_teeth / self.screw_teeth


@dataclass(frozen=True)
class SizeSpec(Table):
    """A winch to be sized."""

    name: str
    requirement: RequirementSpec
    efficiency: EfficiencySpec
    motor: MotorChoice
    gearbox: GearboxChoice
    drum: DrumChoice
    screw: ScrewChoice | None = None
    belt: BeltChoice | None = None
    description: str = ""

    def rules(self) -> Iterator[Rule]:
        """A belt drives the screw."""
        if self.belt is not None and self.screw is None:
            yield "belt", "drives the screw of the guide; give [screw] too, or leave it out"

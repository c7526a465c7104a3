"""True values of a simulated robot's platform: mass, cables, hidden geometry, tracker."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated

from winchkit.schema.quantity import (
    Angle,
    Duration,
    Frequency,
    Length,
    PositiveForce,
    PositiveMass,
    Quantity,
    WholeNumber,
)
from winchkit.schema.table import Rule, Table

Point = tuple[Length, Length, Length]
Noise = Annotated[float, Quantity("length", 0.0)]
AngleNoise = Annotated[float, Quantity("angle", 0.0)]
PositiveInertia = Annotated[float, Quantity("inertia", 0.0, above=True)]


@dataclass(frozen=True)
class TrackerTruth(Table):
    """The simulated tracker: place of the robot's base in its frame, noise, rate and delay."""

    position: Point = (0.0, 0.0, 0.0)
    """Origin of the base frame in the tracker's frame, m."""
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw, base to tracker frame, rad."""
    position_noise: Noise = 0.0
    """Standard deviation per axis, m."""
    rotation_noise: AngleNoise = 0.0
    """Standard deviation per axis, rad."""
    rate: Frequency = 100.0
    delay: Duration = 0.0
    """From the instant of a pose to its datagram, s."""


@dataclass(frozen=True)
class PlatformTruth(Table):
    """Mechanics of the platform and of its cables."""

    inertia: tuple[PositiveInertia, PositiveInertia, PositiveInertia]
    """Principal moments about the centre of mass, in platform axes, kg m²."""
    axial_stiffness: PositiveForce
    """EA of every cable, N."""
    pretension: PositiveForce
    """Cable forces at home are those of the equilibrium that are nearest to this one, N."""
    damping_time: Duration = 0.0
    """Ratio of viscous damping to stiffness of a cable (Kelvin-Voigt), s."""
    mass: PositiveMass | None = None
    """kg; by default that of the robot's profile."""
    center_of_mass: Point | None = None
    geometry: Noise = 0.0
    """Standard deviation of the exit and anchor points against the profile, m per coordinate."""
    winding_radius: Noise = 0.0
    """Standard deviation of the drums' winding radii against the profile, cut at twice of it, m."""
    geometry_seed: WholeNumber = 0
    tracker: TrackerTruth = field(default_factory=TrackerTruth)

    def rules(self) -> Iterator[Rule]:
        """Principal moments satisfy the triangle inequality."""
        a, b, c = sorted(self.inertia)
        if c > a + b:
            yield "inertia", f"{c:g} kg m^2 is above the sum of the two others; no body has these"

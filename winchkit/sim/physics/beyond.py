"""Physics outside the catalogue of effects, which a diagnosis must report as unknown."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, pi, sin
from typing import Annotated, ClassVar

from winchkit.schema.quantity import (
    Force,
    Length,
    PositiveDuration,
    PositiveForce,
    PositiveLength,
    PositiveNumber,
    Quantity,
)
from winchkit.sim.physics.base import Physics, PlantState, Stiffness, winding_direction


@dataclass
class FiveCornerDrum(Physics):
    """The drum is a polygon: a sine of a higher order per drum turn."""

    amplitude: Length = 0.0003
    order: PositiveNumber = 5.0

    def wound_length(self, state: PlantState) -> tuple[float, float]:
        angle = self.order * state.drum_angle
        return self.amplitude * sin(angle), self.amplitude * self.order * cos(angle)


@dataclass
class TorqueCrosstalk(Physics):
    """Crosstalk of the motor current into the cell's wires, with the sign of the motion."""

    per_torque: Annotated[float, Quantity("ratio")] = 8.0
    """N per N m of motor torque."""
    wave: PositiveNumber = 3.0
    """Periods per motor torque of 1 N m, by rectification."""

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.per_torque * sin(2 * pi * self.wave * state.motor_torque)


@dataclass
class TemperatureCrosstalk(Physics):
    """The cell's zero is periodic in temperature."""

    swing: Force = 3.0
    period: Annotated[float, Quantity("ratio", 0.0, above=True)] = 1.5
    """Period, K."""

    def cell(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.swing * sin(2 * pi * state.temperature / self.period)


@dataclass
class StickyPlace(Physics):
    """Coulomb friction at one position of the stroke."""

    force: Force = 12.0
    at: Length = 2.4
    """Cable length of the friction, m."""
    width: PositiveLength = 0.1

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        """Friction at the first pulley of the drum, against the motion, around the position."""
        if index != 0:
            return 0.0
        where = (state.unstrained - self.at) / self.width
        return winding_direction(state) * self.force * exp(-where * where)


@dataclass
class GivingJoint(Physics):
    """A joint that opens above a load."""

    above: PositiveForce = 150.0
    stiffness: Stiffness = 20e3
    size: ClassVar[str] = "stiffness"
    inverse: ClassVar[bool] = True
    _opening: float = 0.0
    _SETTLE: ClassVar[float] = 0.01

    def stretch(self, state: PlantState, dt: float) -> float:
        """Opening in proportion to the excess of tension, with a time constant of some 10 ms."""
        goal = max(0.0, state.load - self.above) / self.stiffness
        self._opening += (goal - self._opening) * (1.0 - exp(-dt / self._SETTLE))
        return self._opening


@dataclass
class WanderingLength(Physics):
    """Slow periodic error of the length instrument."""

    amplitude: Length = 0.0015
    period: PositiveDuration = 7.0

    def length_signal(self, state: PlantState, reading: float, dt: float) -> float:
        return reading + self.amplitude * sin(2 * pi * state.time / self.period)

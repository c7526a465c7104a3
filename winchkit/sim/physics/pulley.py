"""Physics of the pulleys: change of the tension between platform and drum."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, exp, sqrt
from typing import ClassVar

from winchkit.schema.quantity import Mass, Number, PositiveNumber, PositiveSpeed
from winchkit.sim.physics.base import Physics, Stiffness, Viscosity, winding_direction
from winchkit.sim.physics.presliding import relax
from winchkit.sim.physics.state import PlantState


def pressure(before: float, after: float, wrap: float) -> float:
    """Force on the axle of a pulley between two tensions, N (Eq. 22)."""
    square = before * before - 2 * before * after * cos(wrap) + after * after
    return sqrt(max(0.0, square))


def _dragged(tension: float, wrap: float, friction: float) -> float:
    """Friction force of an axle whose load includes this friction (Eq. 23)."""
    force = friction * pressure(tension, tension, wrap)
    for _ in range(2):
        force = friction * pressure(tension, tension + force, wrap)
    return force


@dataclass
class StickyPulleys(Physics):
    """Coulomb friction of the axles, odd in direction."""

    friction: Number = 0.01
    size: ClassVar[str] = "friction"

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        return _dragged(tension, wrap, winding_direction(state) * self.friction)


@dataclass
class PreslidingPulleys(Physics):
    """Presliding friction (Dahl) over the cable's travel."""

    friction: Number = 0.012
    stiffness: Stiffness = 500.0
    shape: PositiveNumber = 1.0
    size: ClassVar[str] = "friction"
    _force: dict[int, float] = field(default_factory=dict)

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        force = self._force.get(index, 0.0)
        limit = self.friction * pressure(tension, tension + force, wrap)
        force = relax(force, state.winding_speed * dt, limit, self.stiffness, self.shape)
        self._force[index] = force
        return force


@dataclass
class ViscousPulleys(Physics):
    """Viscous friction of the bearings."""

    viscosity: Viscosity = 8.0
    size: ClassVar[str] = "viscosity"

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        return self.viscosity * state.winding_speed


@dataclass
class CreepPulleys(Physics):
    """Coulomb friction with a higher value at low speed (Stribeck)."""

    coulomb: Number = 0.008
    static: Number = 0.03
    stribeck_speed: PositiveSpeed = 0.04
    size: ClassVar[str] = "static"

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        fall = exp(-((state.winding_speed / self.stribeck_speed) ** 2))
        friction = self.coulomb + (self.static - self.coulomb) * fall
        return _dragged(tension, wrap, winding_direction(state) * friction)


@dataclass
class HeavyPulleys(Physics):
    """Inertia of the sheaves, as a mass that moves with the cable."""

    equivalent_mass: Mass = 1.0
    size: ClassVar[str] = "equivalent_mass"

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        return self.equivalent_mass * state.winding_acceleration

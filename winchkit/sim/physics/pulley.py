"""Physics of the pulleys: change of the tension between platform and drum."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, exp, sqrt
from typing import ClassVar

from winchkit.schema.quantity import Mass, PositiveNumber, PositiveSpeed, Ratio
from winchkit.sim.physics.base import Physics, PlantState, Stiffness, Viscosity, winding_direction
from winchkit.sim.physics.presliding import relax


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

    friction: Ratio = 0.01

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        return _dragged(tension, wrap, winding_direction(state) * self.friction)


@dataclass
class PreslidingPulleys(Physics):
    """Presliding friction (Dahl) over the cable's travel."""

    friction: Ratio = 0.012
    stiffness: Stiffness = 500.0
    shape: PositiveNumber = 1.0
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

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        return self.viscosity * state.winding_speed


@dataclass
class CreepPulleys(Physics):
    """Coulomb friction with a higher value at low speed (Stribeck)."""

    coulomb: Ratio = 0.008
    static: Ratio = 0.03
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

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        return self.equivalent_mass * state.winding_acceleration


_ELEMENTS = 4
"""The chords of four elements differ from the parabola of infinitely many by at most 1.6 % (1/64)
of the sliding force."""
_SHARES = tuple((2 * n + 1) / _ELEMENTS**2 for n in range(_ELEMENTS))
"""Share of each element in the sliding force; the sum is one."""


@dataclass
class MaxwellPulleys(Physics):
    """Maxwell-slip friction of the axles, higher at low speed, and drag of the bearings.

    Parallel springs slide at forces of their own (W. D. Iwan, *A distributed-element model for
    hysteresis*, 1966); their sum is the presliding hysteresis.
    """

    friction: Ratio = 0.012
    stiffness: Stiffness = 20000.0
    static_excess: Ratio = 0.15
    stribeck_speed: PositiveSpeed = 0.01
    drag_speed: PositiveSpeed = 5.0
    """At which the bearing drag equals the sliding force, m/s."""
    _forces: dict[int, list[float]] = field(default_factory=dict)

    def pulley(
        self, state: PlantState, index: int, wrap: float, tension: float, dt: float
    ) -> float:
        """Sum of the elements, each limited to its share of the sliding force."""
        forces = self._forces.setdefault(index, [0.0] * _ELEMENTS)
        speed = state.winding_speed
        excess = self.static_excess * exp(-((speed / self.stribeck_speed) ** 2))
        load = pressure(tension, tension + sum(forces), wrap)
        limit = self.friction * (1 + excess) * load
        move = self.stiffness / _ELEMENTS * speed * dt
        for n, share in enumerate(_SHARES):
            bound = share * limit
            forces[n] = max(-bound, min(bound, forces[n] + move))
        return sum(forces) + self.friction * load * speed / self.drag_speed

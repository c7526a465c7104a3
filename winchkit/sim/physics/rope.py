"""Physics of the rope and what carries it: stretch, creep, heat, weight, frame."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sin
from typing import ClassVar

from winchkit.schema.quantity import (
    LinearDensity,
    PositiveDuration,
    PositiveForce,
    PositiveNumber,
)
from winchkit.sim.physics.base import Expansion, Physics, Stiffness
from winchkit.sim.physics.presliding import relax
from winchkit.sim.state import GRAVITY, State

__all__ = [
    "CreepingRope",
    "ElasticRope",
    "HeavyRope",
    "LaggingRope",
    "SoftFrame",
    "WarmRope",
]

_WARM = 20.0


@dataclass
class ElasticRope(Physics):
    """The rope is a spring of stiffness EA over all of its stressed length."""

    axial_stiffness: PositiveForce = 250e3
    size: ClassVar[str] = "axial_stiffness"
    inverse: ClassVar[bool] = True

    def compliance(self, state: State) -> float:
        """Stressed length over EA."""
        return (state.unstrained + state.dead_length) / self.axial_stiffness


@dataclass
class SoftFrame(Physics):
    """The frame yields, however long the rope is."""

    stiffness: Stiffness = 60e3
    size: ClassVar[str] = "stiffness"
    inverse: ClassVar[bool] = True

    def compliance(self, state: State) -> float:
        """Inverse of the stiffness."""
        return 1.0 / self.stiffness


@dataclass
class WarmRope(Physics):
    """The rope lengthens with temperature above 20 degC."""

    expansion: Expansion = 1.1e-5
    size: ClassVar[str] = "expansion"

    def stretch(self, state: State, dt: float) -> float:
        """Thermal strain of the stressed length."""
        strain = self.expansion * (state.temperature - _WARM)
        return strain * (state.unstrained + state.dead_length)


@dataclass
class CreepingRope(Physics):
    """Strain that follows the tension slowly, from zero at the start."""

    creep_stiffness: PositiveForce = 300e3
    time_constant: PositiveDuration = 4.0
    size: ClassVar[str] = "creep_stiffness"
    inverse: ClassVar[bool] = True
    _strain: float = 0.0

    def stretch(self, state: State, dt: float) -> float:
        """First-order creep, stepped exactly at constant tension."""
        goal = state.load / self.creep_stiffness
        self._strain += (goal - self._strain) * (1.0 - exp(-dt / self.time_constant))
        return self._strain * (state.unstrained + state.dead_length)


@dataclass
class LaggingRope(Physics):
    """Inner friction of the strands: a Dahl loop of strain over tension.

    ``fraction`` is the half-width of the loop as a share of the elastic strain of 500 N.
    """

    axial_stiffness: PositiveForce = 250e3
    fraction: PositiveNumber = 0.3
    size: ClassVar[str] = "fraction"
    _loop: float = 0.0
    _before: float | None = None

    def stretch(self, state: State, dt: float) -> float:
        """Strain of the loop times the stressed length."""
        before = state.load if self._before is None else self._before
        limit = self.fraction * 500.0 / self.axial_stiffness
        slope = self.fraction / self.axial_stiffness
        self._loop = relax(self._loop, state.load - before, limit, slope, 1.0)
        self._before = state.load
        # The strain lags what the tension asks for, hence the sign.
        return -self._loop * (state.unstrained + state.dead_length)


@dataclass
class HeavyRope(Physics):
    """The hanging rope weighs on everything above the platform."""

    mass_per_length: LinearDensity = 0.15
    size: ClassVar[str] = "mass_per_length"

    def weight(self, state: State) -> float:
        """Weight of the free rope along its slope."""
        return self.mass_per_length * GRAVITY * state.unstrained * sin(state.inclination)

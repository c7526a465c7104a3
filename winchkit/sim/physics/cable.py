"""Physics of the cable and the frame: elongation, creep, thermal expansion, weight."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sin
from typing import ClassVar

from winchkit.schema.quantity import (
    Angle,
    LinearDensity,
    PositiveDuration,
    PositiveForce,
    PositiveRatio,
    Ratio,
)
from winchkit.sim.physics.base import Expansion, Physics, PlantState, Stiffness
from winchkit.sim.physics.presliding import relax
from winchkit.units import GRAVITY

_WARM = 20.0
"""Degrees Celsius: reference temperature of lengths (ISO 1)."""


@dataclass
class ElasticCable(Physics):
    """The cable is a spring of stiffness EA over all of its stressed length."""

    axial_stiffness: PositiveForce = 300e3
    inverse: ClassVar[bool] = True

    def compliance(self, state: PlantState) -> float:
        return (state.unstrained + state.dead_length) / self.axial_stiffness


@dataclass
class SoftFrame(Physics):
    """The frame is compliant, independent of the cable length."""

    stiffness: Stiffness = 60e3
    inverse: ClassVar[bool] = True

    def compliance(self, state: PlantState) -> float:
        return 1.0 / self.stiffness


@dataclass
class WarmCable(Physics):
    """The cable lengthens with temperature above 20 degC."""

    expansion: Expansion = 1.1e-5

    def stretch(self, state: PlantState, dt: float) -> float:
        strain = self.expansion * (state.temperature - _WARM)
        return strain * (state.unstrained + state.dead_length)


@dataclass
class CreepingCable(Physics):
    """Strain that follows the tension slowly, from zero at the start."""

    creep_stiffness: PositiveForce = 300e3
    time_constant: PositiveDuration = 4.0
    inverse: ClassVar[bool] = True
    _strain: float = 0.0

    def stretch(self, state: PlantState, dt: float) -> float:
        """First-order creep, stepped exactly at constant tension."""
        goal = state.load / self.creep_stiffness
        self._strain += (goal - self._strain) * (1.0 - exp(-dt / self.time_constant))
        return self._strain * (state.unstrained + state.dead_length)


@dataclass
class LaggingCable(Physics):
    """Internal friction of the strands withholds strain: a hysteresis of strain over tension.

    The friction takes half of a change of tension from rest, all of it after a full reversal,
    and at most ``fraction`` of the tension.
    """

    axial_stiffness: PositiveForce = 80e3
    fraction: PositiveRatio = 0.1
    size: ClassVar[str] = "fraction"
    _held: float = 0.0
    _before: float | None = None
    _SLOPE: ClassVar[float] = 0.5

    def stretch(self, state: PlantState, dt: float) -> float:
        """Strain withheld by friction, times the stressed length; a Dahl law in tension."""
        change = 0.0 if self._before is None else state.load - self._before
        self._before = state.load
        self._held = relax(self._held, change, self.fraction * state.load, self._SLOPE, 1.0)
        return -self._held / self.axial_stiffness * (state.unstrained + state.dead_length)


@dataclass
class HeavyCable(Physics):
    """Weight of the free cable."""

    mass_per_length: LinearDensity = 0.15

    def weight(self, state: PlantState) -> float:
        return self.mass_per_length * GRAVITY * state.unstrained * sin(state.inclination)


@dataclass
class LoadLever(Physics):
    """The load acts through a lever that turns with the drum."""

    amplitude: Ratio = 0.03
    phase: Angle = 0.3

    def weight(self, state: PlantState) -> float:
        return state.load * self.amplitude * sin(state.drum_angle + self.phase)

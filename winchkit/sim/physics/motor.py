"""Physics of the gearbox losses, the motor and its torque signal."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sin
from typing import Annotated, ClassVar

from winchkit.schema.quantity import (
    Angle,
    Inertia,
    PositiveDuration,
    PositiveNumber,
    Quantity,
    Ratio,
    Torque,
)
from winchkit.sim.physics.base import (
    Physics,
    PlantState,
    RotationalViscosity,
    motor_direction,
    winding_direction,
)
from winchkit.sim.physics.presliding import relax

AngularSpeed = Annotated[float, Quantity("angular speed", 0.0, above=True)]
Efficiency = Annotated[float, Quantity("ratio", 0.0, 1.0, above=True)]


@dataclass
class LossyGear(Physics):
    """Losses of the gearbox: more torque for winding in, less for paying out."""

    efficiency: Efficiency = 0.94
    size: ClassVar[str] = ""

    def gear(self, state: PlantState, torque: float) -> float:
        """Divide by the efficiency winding in, multiply paying out."""
        return float(torque * self.efficiency ** -winding_direction(state))


@dataclass
class MotorDrag(Physics):
    """Coulomb friction of motor and seals, independent of the load."""

    torque: Torque = 0.025

    def motor(self, state: PlantState) -> float:
        return motor_direction(state) * self.torque


@dataclass
class MotorGrease(Physics):
    """Viscous friction of the motor."""

    viscosity: RotationalViscosity = 1.5e-4

    def motor(self, state: PlantState) -> float:
        return self.viscosity * state.motor_speed


@dataclass
class OneWayGrease(Physics):
    """Viscous friction with a difference of the two directions from their mean."""

    viscosity_difference: RotationalViscosity = 1e-4

    def motor(self, state: PlantState) -> float:
        return self.viscosity_difference * abs(state.motor_speed)


@dataclass
class MotorStiction(Physics):
    """Friction of the motor at low speed only (Stribeck)."""

    torque: Torque = 0.03
    stribeck_speed: AngularSpeed = 20.0

    def motor(self, state: PlantState) -> float:
        fall = exp(-((state.motor_speed / self.stribeck_speed) ** 2))
        return motor_direction(state) * self.torque * fall


@dataclass
class PreslidingMotor(Physics):
    """Presliding friction (Dahl) of motor and gearbox over the motor angle."""

    torque: Torque = 0.03
    distance: Annotated[float, Quantity("angle", 0.0, above=True)] = 2.0
    _force: float = 0.0
    _angle: float | None = None

    def motor(self, state: PlantState) -> float:
        travel = 0.0 if self._angle is None else state.motor_angle - self._angle
        slope = self.torque / self.distance
        self._force = relax(self._force, travel, self.torque, slope, 1.0)
        self._angle = state.motor_angle
        return self._force


@dataclass
class Cogging(Physics):
    """Cogging torque of poles and slots, a whole number of periods per motor turn."""

    amplitude: Torque = 0.015
    order: PositiveNumber = 4.0
    phase: Angle = 0.3

    def motor(self, state: PlantState) -> float:
        return self.amplitude * sin(self.order * state.motor_angle + self.phase)


@dataclass
class RippledMotor(Physics):
    """Ripple of the torque constant, a whole number of periods per motor turn."""

    amplitude: Ratio = 0.02
    order: PositiveNumber = 6.0
    phase: Angle = 0.3

    def torque_signal(self, state: PlantState, reading: float, dt: float) -> float:
        return reading * (1.0 + self.amplitude * sin(self.order * state.motor_angle + self.phase))


@dataclass
class UnbalancedDrum(Physics):
    """An eccentric mass on the drum: a torque once per drum turn, at every load."""

    amplitude: Torque = 0.02
    phase: Angle = 0.3

    def motor(self, state: PlantState) -> float:
        return self.amplitude * sin(state.drum_angle + self.phase)


@dataclass
class HangingJoint(UnbalancedDrum):
    """The weight of a part that the axis turns."""

    amplitude: Torque = 0.5


@dataclass
class Balancer(Physics):
    """A spring between the drum and the frame, preloaded at the reference."""

    stiffness: Annotated[float, Quantity("rotational stiffness")] = 1e-3
    torque: Torque = 0.02

    def motor(self, state: PlantState) -> float:
        return self.stiffness * state.drum_angle + self.torque


@dataclass
class GrowingDrag(Physics):
    """Coulomb friction of the motor that grows with time."""

    rate: Annotated[float, Quantity("torque per time")] = 1e-3

    def motor(self, state: PlantState) -> float:
        return motor_direction(state) * self.rate * state.time


@dataclass
class RoughPlace(Physics):
    """Coulomb friction of the motor side around one position of the drum."""

    torque: Torque = 0.05
    place: Angle = 22.0
    width: Annotated[float, Quantity("angle", 0.0, above=True)] = 2.0

    def motor(self, state: PlantState) -> float:
        distance = (state.drum_angle - self.place) / self.width
        return motor_direction(state) * self.torque * exp(-distance * distance)


@dataclass
class HeavyRotor(Physics):
    """Inertia of rotor and gearbox, at the motor."""

    inertia: Inertia = 1e-4

    def rotor_inertia(self) -> float:
        return self.inertia

    def motor(self, state: PlantState) -> float:
        return self.inertia * state.motor_acceleration


@dataclass
class WeakMotor(Physics):
    """The drive's torque constant is wrong, and its reported torque with it."""

    gain_error: Ratio = 0.05

    def torque_signal(self, state: PlantState, reading: float, dt: float) -> float:
        return reading * (1.0 + self.gain_error)


@dataclass
class SlowTorque(Physics):
    """The drive's filter of its torque signal, first order."""

    time_constant: PositiveDuration = 0.08
    _value: float | None = None

    def torque_signal(self, state: PlantState, reading: float, dt: float) -> float:
        """First-order lag, stepped exactly for a held input."""
        if dt == 0.0:
            return reading
        if self._value is None:
            self._value = reading
        self._value += (reading - self._value) * (1.0 - exp(-dt / self.time_constant))
        return self._value

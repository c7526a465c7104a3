"""A motor with nothing on it, for drives that run in real time."""

from __future__ import annotations

import math
from dataclasses import dataclass

from winchkit.sim.plant.servo import DriveCommand

INERTIA = 0.01
"""kg m²."""
_LAG = 0.004


@dataclass
class Flywheel:
    """Follows speeds within milliseconds, and is sped up by torque."""

    motor_angle: float = 0.0
    motor_velocity: float = 0.0
    motor_torque: float = 0.25

    def advance(self, duration: float, command: DriveCommand) -> None:
        requested = 0.0
        if command.power and not command.brake:
            requested = command.speed
            if command.angle is not None:
                requested += 25.0 * (command.angle - self.motor_angle)
        if command.power and command.torque is not None:
            self.motor_velocity += command.torque / INERTIA * duration
        else:
            self.motor_velocity += (requested - self.motor_velocity) * -math.expm1(-duration / _LAG)
        self.motor_angle += self.motor_velocity * duration

    def measure(self) -> Flywheel:
        return self

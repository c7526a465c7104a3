"""The true state of one simulated winch, which its physics reads."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class PlantState:
    """Present true state; SI, mutable, owned by the plant."""

    time: float = 0.0
    temperature: float = 20.0
    """degC."""
    motor_angle: float = 0.0
    motor_speed: float = 0.0
    motor_acceleration: float = 0.0
    drum_angle: float = 0.0
    """Since the reference, positive winds in, rad."""
    wound_angle: float = 0.0
    """Total on the drum, rad."""
    arm: float = 0.0
    """Cable wound in per motor radian, m/rad, signed."""
    winding_speed: float = 0.0
    """Positive winds in, m/s."""
    winding_acceleration: float = 0.0
    unstrained: float = 0.0
    """Unstrained free cable length, m."""
    dead_length: float = 0.0
    inclination: float = 0.0
    cable_length: float = 0.0
    """From the exit point to the attachment, m."""
    load_mass: float = 0.0
    load: float = 0.0
    """Tension at the platform, N."""
    tension: float = 0.0
    """Tension between the pulleys and the drum, N."""
    motor_torque: float = 0.0
    """True torque of the motor, N m."""

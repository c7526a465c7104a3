"""The inner loops of a drive: how the motor follows a command, within its torque, or not at all."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, inf

from winchkit.errors import UsageError

__all__ = ["DriveCommand", "Servo"]

_FILTER_TIME = 0.004
_LOOP_TIME = 0.004
_POSITION_GAIN = 25.0
_BRAKE_DECELERATION = 2000.0


@dataclass(frozen=True)
class DriveCommand:
    """What a drive's power stage is told, SI, in the motor's frame.

    With ``power`` the motor follows ``speed``, and ``angle`` where one is given (``speed`` is
    then its feed-forward). Without it the motor is free, held only by the ``brake``.
    """

    power: bool = True
    speed: float = 0.0
    """rad/s."""
    angle: float | None = None
    """rad; None for a plain speed command."""
    brake: bool = False
    """Whether the brake is closed; it wins over the motor."""
    torque_limit: float = inf
    """N m, either sign."""

    @classmethod
    def off(cls, *, brake: bool) -> DriveCommand:
        """No torque; with or without the brake."""
        return cls(power=False, brake=brake)


class Servo:
    """Speed loop and set-point filter, both first order of 4 ms, under a position loop."""

    def __init__(self) -> None:
        self._filtered = 0.0

    def acceleration(
        self,
        command: DriveCommand,
        *,
        angle: float,
        speed: float,
        idle_torque: float,
        inertia: float,
        dt: float,
    ) -> float:
        """Mean acceleration of the motor over the next ``dt`` s, rad/s².

        ``idle_torque`` is what the motor needs at constant speed, ``inertia`` (kg m²) what it
        accelerates: together they tell what a torque limit allows.
        """
        if not dt > 0:
            raise UsageError(f"a time step of {dt:g} s must be positive")
        if command.brake:
            self._filtered = 0.0
            step = _BRAKE_DECELERATION * dt
            return -max(-step, min(step, speed)) / dt
        if not command.power:
            self._filtered = speed
            return -idle_torque / inertia
        goal = command.speed
        if command.angle is not None:
            goal += _POSITION_GAIN * (command.angle - angle)
        self._filtered += (goal - self._filtered) * (1.0 - exp(-dt / _FILTER_TIME))
        wanted = (self._filtered - speed) * (1.0 - exp(-dt / _LOOP_TIME)) / dt
        limit = command.torque_limit
        if limit == inf:
            return wanted
        torque = max(-limit, min(limit, idle_torque + inertia * wanted))
        return (torque - idle_torque) / inertia

"""The inner control loops of a drive: response of the motor to a command within its torque."""

from __future__ import annotations

from math import copysign, exp, inf
from typing import NamedTuple

from winchkit.errors import UsageError

_LAG = 0.004
"""s, of each of two lags in series: a velocity loop of 40 Hz (1/(2π·4 ms))."""
_POSITION_GAIN = 25.0
"""1/s: following error of 1/25 s of motion, as position loops of drives are set (10 to 60)."""
_BRAKE_DECELERATION = 2000.0
"""rad/s² of the motor: 1000 rpm end within 52 ms, as a holding brake that closes."""


class DriveCommand(NamedTuple):
    """Command to a drive's power stage, SI, in the motor's frame.

    With ``power`` the motor follows ``speed``, and ``angle`` if given (``speed`` is then its feed
    forward); with a ``torque`` it produces this torque up to ``top_speed``. Without power the motor
    is free or held by the ``brake``.
    """

    power: bool = True
    speed: float = 0.0
    """rad/s."""
    angle: float | None = None
    """rad; None for a plain speed command."""
    brake: bool = False
    """Whether the brake is closed, which stops the motor in any case."""
    torque_limit: float = inf
    """Limit of positive torque, and of negative torque without a limit of its own, N m."""
    negative_limit: float | None = None
    """Limit of negative torque, as a positive number, N m."""
    torque: float | None = None
    """N m."""
    top_speed: float = inf
    """rad/s, where a torque is given."""

    @property
    def torque_band(self) -> tuple[float, float]:
        """Lowest and highest permitted motor torque, N m."""
        below = self.torque_limit if self.negative_limit is None else self.negative_limit
        return -below, self.torque_limit

    @classmethod
    def off(cls, *, brake: bool) -> DriveCommand:
        """No torque; with or without the brake."""
        return cls(power=False, brake=brake)


class Servo:
    """Speed loop and set-point filter, both first order of 4 ms, within a position loop.

    Both are integrated exactly for a constant target. A bench in real time is integrated in steps
    of irregular length. A force that depended on the step length would bias a load cell whose
    conversions are synchronous with the steps.
    """

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
        """Mean acceleration over ``dt`` s, rad/s², at an idle torque, N m, and inertia, kg m²."""
        if not dt > 0:
            raise UsageError(f"a time step of {dt:g} s must be positive")
        if command.brake:
            self._filtered = 0.0
            step = _BRAKE_DECELERATION * dt
            return -max(-step, min(step, speed)) / dt
        if not command.power:
            self._filtered = speed
            return -idle_torque / inertia
        low, high = command.torque_band
        if command.torque is None:
            goal = command.speed
            if command.angle is not None:
                goal += _POSITION_GAIN * (command.angle - angle)
            wanted = self._towards(goal, speed, dt)
            if high == inf and low == -inf:
                return wanted
        else:
            self._filtered = speed
            made = max(low, min(high, command.torque))
            wanted = _below(command.top_speed, speed, (made - idle_torque) / inertia, dt)
        torque = max(low, min(high, idle_torque + inertia * wanted))
        return (torque - idle_torque) / inertia

    def _towards(self, goal: float, speed: float, dt: float) -> float:
        """Mean acceleration of two equal lags in series at a constant target."""
        keep = exp(-dt / _LAG)
        before = self._filtered - goal
        self._filtered = goal + keep * before
        reached = goal + keep * (speed - goal + before * dt / _LAG)
        return (reached - speed) / dt


def _below(top: float, speed: float, acceleration: float, dt: float) -> float:
    """Acceleration limited so that the top speed is not exceeded."""
    reached = speed + acceleration * dt
    return acceleration if abs(reached) <= top else (copysign(top, reached) - speed) / dt

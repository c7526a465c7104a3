"""Demand of a simulated drive on its motor, and the base class of the modes of operation."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, sqrt
from typing import Protocol

from winchkit.sim.drive.settings import Settings
from winchkit.sim.plant.servo import DriveCommand


def approach(value: float, goal: float, step: float) -> float:
    """Move ``value`` towards ``goal`` by at most ``step``."""
    return goal if abs(goal - value) <= step else value + copysign(step, goal - value)


@dataclass
class DriveDemand:
    """Present demand at the motor shaft."""

    angle: float = 0.0
    """rad; the actual angle where the mode controls only speed or torque."""
    speed: float = 0.0
    """rad/s."""
    torque: float = 0.0
    """N m, where the mode controls torque."""
    limited: bool = False
    """Status bit 11: a limit restricts the demand."""


class Windows(Protocol):
    """Present state of the windows and thresholds of CiA 402."""

    following_error: bool
    """Beyond the following error window (6065h)."""

    @property
    def position_reached(self) -> bool:
        """Within the position window (6067h, 6068h)."""

    @property
    def speed_reached(self) -> bool:
        """Within the velocity window (606Dh, 606Eh)."""

    @property
    def slow(self) -> bool:
        """Below the velocity threshold (606Fh, 6070h)."""


class SetPoints:
    """One mode of operation; the base class is that without a mode, which stops the motor.

    ``position`` and ``torque``: whether the demanded angle or torque is controlled; ``cyclic``:
    whether bit 12 means that the drive follows the command and bit 10 has no mode-specific meaning.
    """

    position = False
    torque = False
    cyclic = False

    def __init__(self, settings: Settings, demand: DriveDemand) -> None:
        self.settings, self.demand = settings, demand

    def reset(self) -> None:
        """Discard moves in progress, after a change of mode or without power."""

    def begin(self) -> None:
        """Start the set-points at the present demand."""

    def aim(self) -> None:
        """Take a target that was written."""

    def control(self, word: int, rising: int, angle: float, *, enabled: bool) -> None:
        """Take a control word; ``rising`` has the bits that change from 0 to 1."""

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Command for the next ``dt`` s; the motor is at ``angle`` (rad) with ``speed``."""
        rate = self.settings.ramp(0x6084)
        self.demand.speed = approach(self.demand.speed, 0.0, rate * dt)
        return self.by_speed(angle)

    def bits(self, windows: Windows) -> int:
        """The mode's bits 10, 12 and 13 of the status word."""
        return 0

    # Building blocks of modes.

    def by_speed(self, angle: float) -> DriveCommand:
        """Command that follows the demanded speed from an angle."""
        self.demand.angle = angle
        below, above = self.settings.limits.torque
        return DriveCommand(speed=self.demand.speed, torque_limit=above, negative_limit=below)

    def by_position(self, forward: float) -> DriveCommand:
        """Command that follows the demanded angle with a speed fed forward (rad/s)."""
        below, above = self.settings.limits.torque
        return DriveCommand(
            angle=self.demand.angle, speed=forward, torque_limit=above, negative_limit=below
        )

    def by_torque(self, angle: float) -> DriveCommand:
        """Command with the demanded torque."""
        below, above = self.settings.limits.torque
        demand = self.demand
        demand.angle, demand.speed = angle, 0.0
        demand.limited |= not -below <= demand.torque <= above
        return DriveCommand(
            torque=demand.torque,
            torque_limit=above,
            negative_limit=below,
            top_speed=self.settings.limits.top_speed,
        )

    def clamped(self, speed: float, fastest: float) -> float:
        """Limit a speed, and set the limit bit."""
        if abs(speed) <= fastest:
            return speed
        self.demand.limited = True
        return copysign(fastest, speed)

    def within(self, speed: float, angle: float, deceleration: float) -> float:
        """Reduce a speed so that the motor can stop before the software limit (607Dh)."""
        low, high = self.settings.limits.angle
        room = high - angle if speed > 0 else angle - low
        if speed == 0 or room == inf:
            return speed
        return self.clamped(speed, sqrt(2 * deceleration * max(0.0, room)))

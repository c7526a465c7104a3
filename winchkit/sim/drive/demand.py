"""What a simulated drive asks of its motor, and the base of the modes that make it."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, sqrt

from winchkit.sim.drive.settings import Settings
from winchkit.sim.plant.servo import DriveCommand

__all__ = ["Demand", "SetPoints", "Windows", "approach"]


def approach(value: float, goal: float, step: float) -> float:
    """Go from ``value`` towards ``goal`` by at most ``step``."""
    return goal if abs(goal - value) <= step else value + copysign(step, goal - value)


@dataclass
class Demand:
    """Demanded now, at the shaft."""

    angle: float = 0.0
    """rad; the actual one where the mode controls speed or torque only."""
    speed: float = 0.0
    """rad/s."""
    torque: float = 0.0
    """N m, where the mode controls torque."""
    limited: bool = False
    """Status bit 11: a limit holds the demand back."""


@dataclass(frozen=True)
class Windows:
    """What the windows and thresholds of CiA 402 say of the motor now."""

    position_reached: bool
    """6067h and 6068h."""
    speed_reached: bool
    """606Dh and 606Eh."""
    slow: bool
    """606Fh and 6070h."""
    following_error: bool
    """Beyond 6065h."""


class SetPoints:
    """One mode of operation; this one, of no mode at all, comes to rest and stays there.

    ``position`` and ``torque`` say whether the demanded angle or torque is followed, ``cyclic``
    whether bit 12 tells that the drive follows and bit 10 has no meaning of the mode's.
    """

    position = False
    torque = False
    cyclic = False

    def __init__(self, settings: Settings, demand: Demand) -> None:
        self.settings, self.demand = settings, demand

    def reset(self) -> None:
        """The mode was chosen, or the motor is without power: forget moves under way."""

    def begin(self) -> None:
        """Let the set-points go on from the present demand."""

    def aim(self) -> None:
        """A target was written."""

    def control(self, word: int, rising: int, angle: float, *, enabled: bool) -> None:
        """A control word was written; ``rising`` are the bits that it newly sets."""

    def step(self, angle: float, speed: float, dt: float) -> DriveCommand:
        """Command for the next ``dt`` s; the motor is at ``angle`` (rad) with ``speed``."""
        rate = self.settings.ramp(0x6084)
        self.demand.speed = approach(self.demand.speed, 0.0, rate * dt)
        return self.by_speed(angle)

    def bits(self, windows: Windows) -> int:
        """The mode's bits 10, 12 and 13 of the status word."""
        return 0

    # What modes are made of.

    def by_speed(self, angle: float) -> DriveCommand:
        """Command that follows the demanded speed from an angle."""
        self.demand.angle = angle
        below, above = self.settings.torque_band()
        return DriveCommand(speed=self.demand.speed, torque_limit=above, negative_limit=below)

    def by_position(self, forward: float) -> DriveCommand:
        """Command that follows the demanded angle with a speed fed forward (rad/s)."""
        below, above = self.settings.torque_band()
        return DriveCommand(
            angle=self.demand.angle, speed=forward, torque_limit=above, negative_limit=below
        )

    def by_torque(self, angle: float) -> DriveCommand:
        """Command that makes the demanded torque."""
        below, above = self.settings.torque_band()
        demand = self.demand
        demand.angle, demand.speed = angle, 0.0
        demand.limited |= not -below <= demand.torque <= above
        return DriveCommand(
            torque=demand.torque,
            torque_limit=above,
            negative_limit=below,
            top_speed=self.settings.top_speed(),
        )

    def clamped(self, speed: float, fastest: float) -> float:
        """Hold a speed to a limit, and tell so."""
        if abs(speed) <= fastest:
            return speed
        self.demand.limited = True
        return copysign(fastest, speed)

    def within(self, speed: float, angle: float, deceleration: float) -> float:
        """Slow a speed so that the motor can stop before the software limit (607Dh)."""
        low, high = self.settings.soft_limits()
        room = high - angle if speed > 0 else angle - low
        if speed == 0 or room == inf:
            return speed
        return self.clamped(speed, sqrt(2 * deceleration * max(0.0, room)))

"""What a simulated drive needs of whatever its motor turns."""

from __future__ import annotations

from math import inf
from typing import Protocol

from winchkit.sim.plant.servo import DriveCommand

__all__ = [
    "HoldingBrake",
    "Reading",
    "Shaft",
]


class Reading(Protocol):
    """What the drive's own sensors tell, SI, with their noise."""

    @property
    def motor_angle(self) -> float:
        """rad."""

    @property
    def motor_velocity(self) -> float:
        """rad/s."""

    @property
    def motor_torque(self) -> float:
        """N m."""


class Shaft(Protocol):
    """Something that a motor turns, such as a WinchPlant; SI."""

    @property
    def motor_angle(self) -> float:
        """True, rad."""

    @property
    def motor_velocity(self) -> float:
        """True, rad/s."""

    def advance(self, duration: float, command: DriveCommand) -> None:
        """Let ``duration`` s pass under one command."""

    def measure(self) -> Reading:
        """Read the sensors now."""


class HoldingBrake:
    """Opens ``release`` s after power comes, closes ``apply`` s after it goes.

    Where the motor stands still when its power is to go, it holds the load until the brake does.
    Without a brake (``fitted`` false) nothing holds.
    """

    def __init__(self, *, fitted: bool, release: float = 0.0, apply: float = 0.0) -> None:
        self.closed = fitted
        self.holding = False
        """Whether the motor holds the load while the brake closes."""
        self._fitted, self._release, self._apply = fitted, release, apply
        self._powered = 0.0
        self._off = inf

    def power(self, dt: float) -> None:
        """Power is on for another ``dt`` s."""
        self._off, self.holding = 0.0, False
        self.closed = self._fitted and self._powered < self._release
        self._powered += dt

    def off(self, dt: float, *, still: bool, cut: bool) -> None:
        """Power is to be off for another ``dt`` s; ``cut`` is off at once, come what may."""
        if not self._fitted:
            return
        if self._powered:
            self.holding = still and not self.closed
        self._powered = 0.0
        self.closed = self.closed or self._off >= self._apply
        self.holding = self.holding and not self.closed and not cut
        self._off += dt

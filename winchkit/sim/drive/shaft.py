"""Interface between a simulated drive and the plant that its motor turns."""

from __future__ import annotations

from math import inf
from typing import Protocol

from winchkit.sim.plant.servo import DriveCommand


class ShaftReading(Protocol):
    """Readings of the drive's sensors with noise, SI."""

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
    """A plant that a motor turns, such as a WinchPlant; SI."""

    @property
    def motor_angle(self) -> float:
        """True, rad."""

    @property
    def motor_velocity(self) -> float:
        """True, rad/s."""

    def advance(self, duration: float, command: DriveCommand) -> None:
        """Advance by ``duration`` s under one command."""

    def measure(self) -> ShaftReading:
        """Read the sensors."""


class HoldingBrake:
    """Holding brake: opens ``release`` s after power-on, closes ``apply`` s after power-off.

    A motor at standstill holds the load until the brake has closed. Without a brake (``fitted``
    false) the load is not held.
    """

    def __init__(self, *, fitted: bool, release: float = 0.0, apply: float = 0.0) -> None:
        self.closed = fitted
        self.holding = False
        """Whether the motor holds the load while the brake closes."""
        self._fitted, self._release, self._apply = fitted, release, apply
        self._powered = 0.0
        self._off = inf

    def power(self, dt: float) -> None:
        """Advance by ``dt`` s with power on."""
        self._off, self.holding = 0.0, False
        self.closed = self._fitted and self._powered < self._release
        self._powered += dt

    def off(self, dt: float, *, still: bool, cut: bool) -> None:
        """Advance by ``dt`` s with power off; ``cut`` removes it without waiting for the brake."""
        if not self._fitted:
            return
        if self._powered:
            self.holding = still and not self.closed
        self._powered = 0.0
        self.closed = self.closed or self._off >= self._apply
        self.holding = self.holding and not self.closed and not cut
        self._off += dt

"""What a simulated drive needs of whatever its motor turns."""

from __future__ import annotations

from typing import Protocol

from winchkit.sim.servo import DriveCommand

__all__ = ["Reading", "Shaft"]


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

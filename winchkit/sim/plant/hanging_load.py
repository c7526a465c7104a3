"""A load on a cable: rigid without compliance, else a mass on a damped spring."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Protocol

from winchkit.units import GRAVITY

_DAMPING_RATIO = 0.4
"""Damping ratio of a fibre cable with its load; that of a steel cable is lower."""
_STIFF = 1.0
"""Natural angular frequency, in 1/step, above which the oscillation is neglected."""


class CableLoad(Protocol):
    """The load at the end of a cable, as :class:`HangingLoad`."""

    mass: float
    position: float
    tension: float
    wrap_change: float
    """Wrap at the last pulley beyond that of the profile, rad."""

    def rest(self, cable_end: float, compliance: float) -> None:
        """Set the load to rest."""

    def step(self, cable_end: float, end_speed: float, compliance: float, dt: float) -> None:
        """Advance by ``dt`` s."""


@dataclass(slots=True)
class HangingLoad:
    """Position, speed and force of the load."""

    mass: float
    position: float
    """Cable length at the attachment, m."""
    speed: float = 0.0
    """Positive downwards, m/s."""
    tension: float = 0.0
    """At the platform, N."""
    wrap_change: float = 0.0
    """A load below the winch leaves the last pulley in one direction."""

    def rest(self, cable_end: float, compliance: float) -> None:
        """Set the load to rest on a cable whose unloaded end is at ``cable_end``."""
        self.tension = self.mass * GRAVITY
        self.position = cable_end + compliance * self.tension
        self.speed = 0.0

    def step(self, cable_end: float, end_speed: float, compliance: float, dt: float) -> None:
        """Advance by ``dt`` s; the unloaded end of the cable is then at ``cable_end``.

        ``end_speed`` is its downward speed. The spring and damper are integrated by the
        trapezoidal rule in closed form; on a slack cable the load falls freely.
        """
        mass = self.mass
        if compliance * mass < (dt / _STIFF) ** 2:
            self._follow(cable_end, end_speed, compliance, dt)
            return
        damping = 2 * _DAMPING_RATIO * sqrt(mass / compliance)
        # Tension at the end of the step is fixed + growth · (speed at the end of the step).
        fixed = (self.position + dt / 2 * self.speed - cable_end) / compliance
        fixed -= damping * end_speed
        growth = dt / (2 * compliance) + damping
        drive = self.speed + dt * GRAVITY - dt / (2 * mass) * (self.tension + fixed)
        speed = drive / (1 + dt * growth / (2 * mass))
        tension = fixed + growth * speed
        if tension < 0.0:
            tension = 0.0
            speed = self.speed + dt * (GRAVITY - self.tension / (2 * mass))
        self.position += dt * (self.speed + speed) / 2
        self.speed = speed
        self.tension = tension

    def _follow(self, cable_end: float, end_speed: float, compliance: float, dt: float) -> None:
        """Step for a stiff cable: the load moves with it, and the tension is not negative."""
        self.tension = max(0.0, self.mass * (GRAVITY - (end_speed - self.speed) / dt))
        self.speed = end_speed
        self.position = cable_end + compliance * self.tension

"""A weight on a rope: rigid where nothing yields, else a mass on a damped spring."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from winchkit.sim.physics.state import GRAVITY

__all__ = ["HangingLoad"]

_DAMPING_RATIO = 0.4
"""Of a fibre cable with its load; a steel cable would swing for longer."""
_STIFF = 1.0
"""A spring of a natural angular frequency above this, in 1/step, is followed without its swing."""


@dataclass(slots=True)
class HangingLoad:
    """Where the load is, how fast it sinks, and what it pulls."""

    mass: float
    position: float
    """Cable length at the attachment, m."""
    speed: float = 0.0
    """Positive sinks, m/s."""
    tension: float = 0.0
    """At the platform, N."""

    def rest(self, rope_end: float, compliance: float) -> None:
        """Hang still below a cable that ends at ``rope_end`` while unloaded."""
        self.tension = self.mass * GRAVITY
        self.position = rope_end + compliance * self.tension
        self.speed = 0.0

    def step(self, rope_end: float, rope_speed: float, compliance: float, dt: float) -> None:
        """Advance by ``dt`` s to a cable that ends at ``rope_end``, sinking at ``rope_speed``.

        The spring-damper is stepped by the trapezoidal rule, solved in closed form; a slack
        cable lets the load fall freely.
        """
        mass = self.mass
        if compliance * mass < (dt / _STIFF) ** 2:
            self._follow(rope_end, rope_speed, compliance, dt)
            return
        damping = 2 * _DAMPING_RATIO * sqrt(mass / compliance)
        # Tension at the end of the step is fixed + growth · (speed at the end of the step).
        fixed = (self.position + dt / 2 * self.speed - rope_end) / compliance
        fixed -= damping * rope_speed
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

    def _follow(self, rope_end: float, rope_speed: float, compliance: float, dt: float) -> None:
        """A cable too stiff to swing: the load moves with it, and is never pushed."""
        self.tension = max(0.0, self.mass * (GRAVITY - (rope_speed - self.speed) / dt))
        self.speed = rope_speed
        self.position = rope_end + compliance * self.tension

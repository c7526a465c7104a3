"""A motor as a first-order velocity loop without inertia, and what no EDS says of a drive."""

from __future__ import annotations

import math
from dataclasses import dataclass

_REST = 0.02
"""rad/s."""


@dataclass(frozen=True)
class Declared:
    """What no EDS says: the motor, its encoder and its units."""

    lag: float = 0.005
    """Time constant of the velocity loop, s."""
    counts: float | None = None
    """Position units a motor turn; None takes 608Fh, 6091h and 6092h, else 65536."""
    velocity_unit: float | None = None
    """rad/s of one count of a velocity; None is one position unit a second."""
    velocity_resolution: float = 0.0
    """Of 606Ch, rad/s; 0 is one count."""
    counter_bits: int = 32
    """Of 6064h; it wraps."""
    disabled_deceleration: float = 100.0
    """Of brake and friction while no torque drives, rad/s^2."""
    home_switch: float = 0.0
    """Motor angle of the reference switch, rad."""
    ramps: bool = True
    """Whether CSV follows at once, as it should; false limits it by 6083h and 6084h."""


class Motor:
    """Angle (rad) and velocity (rad/s) of the shaft, as they truly are."""

    def __init__(self, declared: Declared) -> None:
        self._lag, self._coast = declared.lag, declared.disabled_deceleration
        self.angle = self.velocity = 0.0

    @property
    def at_rest(self) -> bool:
        """Whether it stands still."""
        return abs(self.velocity) <= _REST

    def advance(self, dt: float, wanted: float | None) -> None:
        """Follow a velocity for ``dt`` seconds; without one it comes to rest by friction."""
        before = self.velocity
        if wanted is None:
            loss = min(abs(before), self._coast * dt)
            self.velocity = before - math.copysign(loss, before)
        else:
            self.velocity = wanted + (before - wanted) * math.exp(-dt / self._lag)
            if wanted == 0.0 and self.at_rest:
                self.velocity = 0.0
        self.angle += (before + self.velocity) / 2 * dt

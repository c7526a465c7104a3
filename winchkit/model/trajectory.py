"""Move from rest to rest with limited speed, acceleration and jerk (double S), in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from winchkit.arrays import Array
from winchkit.errors import UsageError

JERK_TIME = 0.3
"""Time in which a move's acceleration builds up, s."""


@dataclass(frozen=True)
class Trajectory:
    """Seven phases of constant jerk; at rest before the first and after the last."""

    start: Array
    """Time at which each phase starts and the last one ends, s, shape (8,)."""
    position: Array
    """Distance from the start of the move at those times, m, shape (8,)."""
    speed: Array
    """m/s, shape (8,)."""
    acceleration: Array
    """m/s^2, shape (8,)."""
    jerk: Array
    """m/s^3 in each phase, 0 after the last, shape (8,)."""

    @property
    def duration(self) -> float:
        """Time from rest to rest, s."""
        return float(self.start[-1])

    @property
    def distance(self) -> float:
        """Signed length of the move, m."""
        return float(self.position[-1])

    def at(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Position (m), speed (m/s) and acceleration (m/s^2) at times (s) of any shape."""
        clipped = np.clip(np.asarray(time, dtype=np.float64), 0.0, self.duration)
        phase = np.clip(np.searchsorted(self.start, clipped, side="right") - 1, 0, 7)
        t = clipped - self.start[phase]
        j, a, v = self.jerk[phase], self.acceleration[phase], self.speed[phase]
        return _advanced(t, self.position[phase], v, a, j)


def _advanced(
    t: Array, position: Array, speed: Array, acceleration: Array, jerk: Array
) -> tuple[Array, Array, Array]:
    """Position, speed and acceleration after a time ``t`` of constant jerk."""
    return (
        position + t * (speed + t * (acceleration / 2 + t * jerk / 6)),
        speed + t * (acceleration + t * jerk / 2),
        acceleration + t * jerk,
    )


def _peak_speed(distance: float, speed: float, acceleration: float, jerk: float) -> float:
    """Highest speed of the move: the limit, or less over a short distance."""
    if speed * _ramp(speed, acceleration, jerk)[1] <= distance:
        return speed
    corner = acceleration**2 / jerk
    with_plateau = (-corner + sqrt(corner**2 + 4 * acceleration * distance)) / 2
    if with_plateau >= corner:
        return with_plateau
    return float((distance**2 * jerk / 4) ** (1 / 3))


def _ramp(speed: float, acceleration: float, jerk: float) -> tuple[float, float]:
    """Time of one jerk phase and of the whole ramp from rest to ``speed``, s."""
    if speed * jerk >= acceleration**2:
        rise = acceleration / jerk
        return rise, rise + speed / acceleration
    rise = sqrt(speed / jerk)
    return rise, 2 * rise


def plan(distance: float, speed: float, acceleration: float, jerk: float) -> Trajectory:
    """The fastest move from rest to rest within limits.

    ``distance``: signed, m. ``speed``, ``acceleration``, ``jerk``: positive limits, m/s, m/s^2 and
    m/s^3. Raises UsageError for a limit that is not positive, or a distance that is not finite.

    References
    ----------
    The double S of L. Biagiotti, C. Melchiorri, *Trajectory Planning for Automatic Machines and
    Robots*, 2008, section 3.4, from rest to rest.
    """
    for name, value in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk)):
        if not 0 < value < float("inf"):
            raise UsageError(f"{name} limit of a move is {value:g}; it must be above 0 and finite")
    if not abs(distance) < float("inf"):
        raise UsageError(f"a move over {distance:g} m cannot be planned")
    sign, length = (1.0 if distance >= 0 else -1.0), abs(distance)
    peak = _peak_speed(length, speed, acceleration, jerk) if length else 0.0
    rise, ramp = _ramp(peak, acceleration, jerk)
    flat = max(0.0, ramp - 2 * rise)
    cruise = max(0.0, length / peak - ramp) if peak else 0.0
    times = np.array([rise, flat, rise, cruise, rise, flat, rise])
    jerks = sign * jerk * np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0, 0.0])
    start, position, velocity, accel = (np.zeros(8) for _ in range(4))
    start[1:] = np.cumsum(times)
    for k, t in enumerate(times):
        position[k + 1], velocity[k + 1], accel[k + 1] = _advanced(
            t, position[k], velocity[k], accel[k], jerks[k]
        )
    position[-1], velocity[-1], accel[-1] = distance, 0.0, 0.0
    return Trajectory(start, position, velocity, accel, jerks)

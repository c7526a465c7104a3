"""A jerk-limited move in closed form: seven segments of constant jerk, symmetric in time."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt

from winchkit.errors import UsageError


@dataclass(frozen=True)
class SCurve:
    """A move of ``distance`` from rest to rest; SI units of the moved coordinate (m or rad)."""

    distance: float
    jerk: float
    jerk_time: float
    """Duration of each of the four segments with jerk, s."""
    constant_time: float
    """Duration of constant acceleration, s."""
    cruise_time: float

    @property
    def duration(self) -> float:
        """Time from rest to rest, s."""
        return 4 * self.jerk_time + 2 * self.constant_time + self.cruise_time

    def at(self, time: float) -> tuple[float, float]:
        """Distance and speed at ``time``; constant outside the move."""
        if time < 0.0:
            return 0.0, 0.0
        if time >= self.duration:
            return self.distance, 0.0
        sign = copysign(1.0, self.distance)
        half = 0.5 * self.duration
        if time > half:
            gone, speed = self._rise(self.duration - time)
            return self.distance - sign * gone, sign * speed
        gone, speed = self._rise(time)
        return sign * gone, sign * speed

    def _rise(self, time: float) -> tuple[float, float]:
        """Distance and speed in the first half, both positive."""
        gone = speed = acceleration = 0.0
        for jerk, length in (
            (self.jerk, self.jerk_time),
            (0.0, self.constant_time),
            (-self.jerk, self.jerk_time),
        ):
            t = min(time, length)
            gone += t * (speed + t * (acceleration / 2 + t * jerk / 6))
            speed += t * (acceleration + t * jerk / 2)
            acceleration += t * jerk
            time -= t
        return gone + time * speed, speed


def plan(distance: float, speed: float, acceleration: float, jerk: float) -> SCurve:
    """Plan the fastest symmetric S-curve over ``distance`` within the three positive limits.

    Raises UsageError for a limit that is not positive.
    """
    for name, value in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk)):
        if not value > 0:
            raise UsageError(f"{name} limit {value:g} must be positive")
    length = abs(distance)
    jerk_time = min(acceleration / jerk, sqrt(speed / jerk), (length / (2 * jerk)) ** (1 / 3))
    # Half the move without cruise covers v (2 tj + tc) / 2 at peak speed v = j tj (tj + tc).
    peak = jerk * jerk_time
    constant = 0.0
    if peak > 0:
        by_speed = speed / peak - jerk_time
        by_length = (sqrt(jerk_time**2 + 4 * length / peak) - 3 * jerk_time) / 2
        constant = max(0.0, min(by_speed, by_length))
    top = peak * (jerk_time + constant)
    cruise = max(0.0, length / top - (2 * jerk_time + constant)) if top > 0 else 0.0
    return SCurve(distance, jerk, jerk_time, constant, cruise)

"""Correction of the cable forces of a platform at rest toward a force distribution.

The measured deviation from the distribution is projected on the null space of the structure matrix:
forces that balance each other. Each winch moves its cable in proportion to its part of it, divided
by its stiffness; the platform then keeps its pose, as far as the ratios of the stiffnesses are
right. A cable under load integrates its speed, so that the loop has no integrator that could wind
up; limits of speed, acceleration and travel scale the speeds of all cables in common, which keeps
them in the null space.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.motion import GAIN, Target
from winchkit.bench.control.tension_control import LOOP, UsedUp, fastest_within
from winchkit.schema.bench import LimitSpec


@dataclass(frozen=True)
class TrimSetting:
    """Correction of the tensions of n cables, SI."""

    names: Sequence[str]
    force: Array
    """Wanted cable forces, (n,), N."""
    balanced: Array
    """Projection on the forces that balance each other, (n, n)."""
    stiffness: Array
    """Upper bounds of the cables' stiffnesses, (n,), N/m."""
    delay: float
    """Of reading and drive together, s."""
    travel: float
    """Of each cable from its place at the start, either way, m."""
    speed: float
    """Of each cable, m/s."""
    duration: float
    """s."""


class ForceTrim:
    """Winding speeds of all cables of a platform, the same calculation for all of a cycle."""

    def __init__(
        self,
        setting: TrimSetting,
        limits: Sequence[LimitSpec],
        readings: Callable[[float], Array],
        trip: Callable[[int, str], None],
    ) -> None:
        """Take limits of the winches, ``readings`` of the tensions (NaN without a valid one).

        ``trip`` latches a reason in words for a cable.
        """
        count = len(setting.force)
        self.setting = setting
        self.ended = False
        """Whether all cables have come to rest."""
        self._limits, self._readings, self._trip = limits, readings, trip
        self._acceleration = min(one.acceleration for one in limits)
        self._speed, self._travelled = np.zeros(count), np.zeros(count)
        self._joined: set[int] = set()
        self._cycle = self._begun = math.nan
        self._stopped = False
        self._used_up = UsedUp()

    def join(self, index: int) -> None:
        """A winch has come to rest at its place; the correction begins with the last of them."""
        self._joined.add(index)

    def end(self) -> None:
        """Come to rest now."""
        self._stopped = True

    @property
    def duration(self) -> float:
        """Time to rest after :meth:`end`, s."""
        return float(np.abs(self._speed).max()) / self._acceleration

    def at(self, index: int, time: float, now: float) -> tuple[float, float]:
        """Cable wound in since the start (m) and winding speed (m/s) of a winch.

        The first winch that asks in a cycle advances all.
        """
        if time != self._cycle:
            self._advance(time, now)
        return float(self._travelled[index]), float(self._speed[index])

    def _advance(self, time: float, now: float) -> None:
        step, self._cycle = time - self._cycle, time
        if len(self._joined) < len(self._speed) and not self._stopped:
            return
        if math.isnan(self._begun):
            self._begun = time
        if not step > 0 or self.ended:
            return
        before = self._speed
        over = self._stopped or time - self._begun >= self.setting.duration
        requested = np.zeros_like(before) if over else self._requested(now)
        change = requested - before
        largest, most = float(np.abs(change).max()), self._acceleration * step
        self._speed = before + change * min(1.0, most / largest) if largest > 0 else requested
        self._travelled = self._travelled + (before + self._speed) / 2 * step
        self.ended = over and not self._speed.any()

    def _requested(self, now: float) -> Array:
        """Speeds by the deviation of the forces, within the limits; rest without all readings."""
        setting = self.setting
        error = setting.balanced @ (setting.force - self._readings(now))
        if not np.all(np.isfinite(error)):
            return np.zeros_like(error)
        requested = LOOP / setting.delay * error / setting.stiffness
        rooms = setting.travel - np.sign(requested) * self._travelled
        scale, tightest = 1.0, 0
        for i, (room, limits) in enumerate(zip(rooms.tolist(), self._limits, strict=True)):
            fastest = min(setting.speed, limits.speed, fastest_within(room, limits))
            if abs(requested[i]) * scale > fastest:
                scale, tightest = fastest / abs(float(requested[i])), i
        if self._used_up.at(now, used_up=scale < 1e-3):
            self._trip(
                tightest,
                f"{error[tightest]:+.1f} N are missing in cable {setting.names[tightest]} after "
                f"{setting.travel * 1e3:g} mm of cable (travel of the trim); look for a broken or "
                "jammed cable and a wrong load cell, home the winches, then reset",
            )
        return np.asarray(requested * scale)


class CableTrim:
    """One winch of a :class:`ForceTrim`; a motion source."""

    joins = False

    def __init__(self, trim: ForceTrim, index: int, cable: CableMap, *, holds: bool) -> None:
        self.holds = holds
        self.trim = trim
        self._index, self._cable = index, cable
        self._begin = self._slope = math.nan

    def start(self, time: float, angle: float, _winding_speed: float) -> None:
        """Begin at rest at a motor angle (rad)."""
        self._begin, self._slope = angle, 1.0 / self._cable.at(angle)[1]
        self.trim.join(self._index)
        self.trim.at(self._index, time, time)

    def target(self, time: float, angle: float, now: float) -> Target:
        """Where the correction is at this time."""
        wound, speed = self.trim.at(self._index, time, now)
        planned, velocity = self._begin + wound * self._slope, speed * self._slope
        return Target(velocity + GAIN * (planned - angle), planned, speed, done=self.trim.ended)

    def run_down(self) -> TrimRunDown:
        """The stop of all cables in common."""
        return TrimRunDown(self)


class TrimRunDown:
    """Ramp to rest of one winch during a correction."""

    holds = False
    joins = True

    def __init__(self, motion: CableTrim) -> None:
        """Come to rest from the next cycle on."""
        self._motion = motion

    @property
    def duration(self) -> float:
        """s."""
        return self._motion.trim.duration

    def start(self, _time: float, _angle: float, _winding_speed: float) -> None:
        """Order the stop of the correction for all winches."""
        self._motion.trim.end()

    def target(self, time: float, angle: float, now: float) -> Target:
        """As before, until it rests."""
        return self._motion.target(time, angle, now)

"""Correction of the cables of a platform at rest: winding speeds of all of them in common.

Loops ask for a winding speed of each cable: of the forces (:mod:`.force_loop`) and of the pose
(:mod:`.pose_loop`). Limits of speed, acceleration and travel scale the speeds of all cables in
common, which keeps those of a force loop in the null space of the structure matrix.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.dead_man import DeadMan
from winchkit.bench.control.motion import Setpoint, fastest_within
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.control.tension_control import UsedUp
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.schema.bench import LimitSpec

Latch = Callable[[Trip], None]
_GAIN = 4.0
"""Of the position loop around a speed-controlled drive, 1/s: half of that of a move, since a wrong
lag of the drive is position error there."""


class Loop(Protocol):
    """A controller that asks for winding speeds."""

    def speeds(self, time: float, now: float, wound: Array) -> Array | None:
        """Winding speeds (n,), m/s, once a cycle; None for rest, without a valid measurement.
        Motors have ``wound`` in (n,), m, since the start."""

    def left(self, index: int) -> str:
        """What is left to correct of a cable, in words."""


@dataclass(frozen=True)
class Bounds:
    """Bounds of a correction of n cables, SI."""

    names: Sequence[str]
    limits: Sequence[LimitSpec]
    """Of the winches."""
    travel: float
    """Of each cable from its place at the start, either way, m."""
    speed: float
    """Of each cable, m/s."""


class Correction:
    """Winding speeds of all cables of a platform, the same calculation for all of a cycle."""

    def __init__(
        self,
        bounds: Bounds,
        loops: Sequence[Loop],
        lasts: Callable[[float, float], bool],
        latch: Latch,
        elongating: Array,
    ) -> None:
        """Take ``lasts``: whether it goes on, by its duration so far and the true time (s);
        ``latch`` takes the trip of a travel that is used up. ``elongating`` as of
        :func:`.corrections.elongating`."""
        count = len(bounds.names)
        self.loops = loops
        self.ended = False
        """Whether all cables have come to rest."""
        self.measured = np.zeros(count)
        """Cable wound in since the start by the motors, (n,), m."""
        self._bounds, self._lasts, self._latch = bounds, lasts, latch
        self._elongating = elongating
        self.elongation = np.zeros(count)
        """Cable wound in for the forces, (n,), m: the pose stays."""
        self._acceleration = min(one.acceleration for one in bounds.limits)
        self.lag = max(one.response_time for one in bounds.limits) / 2
        """Usual lag of a drive behind its speed, s."""
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
        """Cable wound in since the start (m) and winding speed (m/s) of a winch; the first winch
        that asks in a cycle advances all."""
        if time != self._cycle:
            self._advance(time, now)
        return float(self._travelled[index]), float(self._speed[index])

    def _advance(self, time: float, now: float) -> None:
        step, self._cycle = time - self._cycle, time
        if len(self._joined) < len(self._speed) and not self._stopped:
            return
        if math.isnan(self._begun):
            self._begun = time
        self._stopped = self._stopped or not self._lasts(time - self._begun, now)
        if not step > 0 or self.ended:
            return
        before = self._speed
        requested = np.zeros_like(before) if self._stopped else self._requested(time, now)
        change = requested - before
        largest, most = float(np.abs(change).max()), self._acceleration * step
        self._speed = before + change * min(1.0, most / largest) if largest > 0 else requested
        self._travelled = self._travelled + (before + self._speed) / 2 * step
        self.elongation = self._elongating @ self._travelled
        self.ended = self._stopped and not self._speed.any()

    def _requested(self, time: float, now: float) -> Array:
        """Speeds that the loops ask for, within the limits; rest without all measurements."""
        bounds, none = self._bounds, np.zeros_like(self._speed)
        asked = [loop.speeds(time, now, self.measured) for loop in self.loops]
        speeds = [one for one in asked if one is not None]
        if len(speeds) < len(asked):
            return none
        requested = sum(speeds, none)
        rooms = bounds.travel - np.sign(requested) * self._travelled
        scale, tightest = 1.0, 0
        for i, (room, limits) in enumerate(zip(rooms.tolist(), bounds.limits, strict=True)):
            fastest = min(bounds.speed, limits.speed, fastest_within(room, limits))
            if abs(requested[i]) * scale > fastest:
                scale, tightest = fastest / abs(float(requested[i])), i
        if self._used_up.at(now, used_up=scale < 1e-3):
            left = " and ".join(loop.left(tightest) for loop in self.loops)
            words = (
                f"{left} left after {bounds.travel * 1e3:g} mm of cable (travel of the "
                "correction); look for a broken or jammed cable, a wrong load cell and a wrong "
                "frame of the tracker, home the winches, then reset"
            )
            self._latch(Trip("correction", bounds.names[tightest], words, latches=True))
        return np.asarray(requested * scale)


class CableCorrection:
    """One winch of a :class:`Correction`; a motion source."""

    joins = False

    def __init__(
        self,
        correction: Correction,
        index: int,
        cable: CableMap,
        axis: Cia402Axis,
        *,
        holds: bool = False,
    ) -> None:
        self.holds = holds
        self.correction = correction
        self._index, self._cable, self._axis = index, cable, axis
        self._begin = self._slope = self._trimmed = math.nan

    def start(self, time: float, angle: float, _winding_speed: float) -> None:
        """Begin at a motor angle (rad), at rest or beside a motion of the platform."""
        self._begin, self._slope = angle, 1.0 / self._cable.at(angle)[1]
        self._trimmed = self._axis.position.trim
        self.correction.join(self._index)
        self.at(time, time)

    def at(self, time: float, now: float) -> tuple[float, float]:
        """Cable wound in since the start (m) and winding speed (m/s)."""
        found = self.correction.at(self._index, time, now)
        elongation = float(self.correction.elongation[self._index])
        self._axis.position.trim = self._trimmed + elongation * self._slope
        return found

    def target(self, time: float, angle: float, now: float) -> Setpoint:
        """Where the correction is at this time."""
        correction = self.correction
        wound, speed = self.at(time, now)
        correction.measured[self._index] = (angle - self._begin) / self._slope
        planned, velocity = self._begin + wound * self._slope, speed * self._slope
        late = planned - velocity * correction.lag - angle
        return Setpoint(velocity + _GAIN * late, planned, speed, done=correction.ended)

    def run_down(self) -> CorrectionRunDown:
        """The stop of all cables in common."""
        return CorrectionRunDown(self)


class HeldCorrection(CableCorrection):
    """A correction that lasts while its commander refreshes it."""

    def __init__(
        self,
        correction: Correction,
        index: int,
        cable: CableMap,
        axis: Cia402Axis,
        dead_man: DeadMan,
    ) -> None:
        super().__init__(correction, index, cable, axis)
        self.dead_man = dead_man


class CorrectionRunDown:
    """Ramp to rest of one winch during a correction."""

    holds = False
    joins = True

    def __init__(self, motion: CableCorrection) -> None:
        """Come to rest from the next cycle on."""
        self._motion = motion

    @property
    def duration(self) -> float:
        """s."""
        return self._motion.correction.duration

    def start(self, _time: float, _angle: float, _winding_speed: float) -> None:
        """Order the stop of the correction for all winches."""
        self._motion.correction.end()

    def target(self, time: float, angle: float, now: float) -> Setpoint:
        """As before, until it rests."""
        return self._motion.target(time, angle, now)

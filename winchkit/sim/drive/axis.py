"""The axis of a simulated drive: motion in short time steps, and feedback."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, inf
from typing import NamedTuple

from winchkit.sim.drive.motion import DriveMotion
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.power import PowerStage
from winchkit.sim.drive.shaft import Shaft
from winchkit.sim.drive.status import StatusBits
from winchkit.sim.drive.units import wrapped

_LEAST_SLICE = 2e-5
"""Shorter times are left to the next call, s."""


class _Sample(NamedTuple):
    """Feedback and demand at one instant, SI."""

    angle: float = 0.0
    speed: float = 0.0
    torque: float = 0.0
    demanded_angle: float = 0.0
    demanded_speed: float = 0.0
    demanded_torque: float = 0.0
    """The actual torque where the mode does not control it."""
    following_error: float = 0.0


class DriveAxis:
    """Motion and feedback, starting at the time ``now``, in steps of at most ``longest_step`` s.

    ``following_failed`` is called while the following error (60F4h) has been beyond its window
    (6065h) for longer than 6066h allows.
    """

    def __init__(
        self,
        objects: ObjectDictionary,
        shaft: Shaft,
        power: PowerStage,
        motion: DriveMotion,
        status: StatusBits,
        *,
        now: float,
        longest_step: float,
    ) -> None:
        self._longest_step = longest_step
        self._shaft = shaft
        self._power, self._motion, self._status = power, motion, status
        self.following_failed: Callable[[], None] = lambda: None
        self.now = now
        self._sampled_at, self._sampled = -inf, _Sample()
        self._following_since: float | None = None
        objects.computed.update({(index, 0): value for index, value in self._actual_values()})

    def advance(self, now: float, tolerance: float = 0.0) -> None:
        """Move until ``now``, if more than ``tolerance`` s is left."""
        duration = now - self.now
        if duration < _LEAST_SLICE or duration < tolerance:
            return
        count = ceil(duration / self._longest_step - 1e-6)
        dt = duration / count
        start, shaft, motion, power = self.now, self._shaft, self._motion, self._power
        for index in range(count):
            command = motion.step(power.order, shaft.motor_angle, shaft.motor_velocity, dt)
            shaft.advance(dt, command)
            self.now = start + (index + 1) * dt
            if motion.stopping and motion.stop_is_over(shaft.motor_velocity):
                power.standstill()
            if motion.controls_position:
                self._watch_following()
            else:
                self._status.following_error, self._following_since = False, None
        self.now = now
        self._status.advance(shaft.motor_angle, shaft.motor_velocity, duration)

    def sample(self) -> None:
        """Sample feedback and demand for the actual values in the object dictionary."""
        if self._sampled_at == self.now:
            return
        self._sampled_at = self.now
        reading, motion, demand = self._shaft.measure(), self._motion, self._motion.demand
        self._sampled = _Sample(
            reading.motor_angle,
            reading.motor_velocity,
            reading.motor_torque,
            demand.angle,
            demand.speed,
            demand.torque if motion.set_points.torque else reading.motor_torque,
            demand.angle - reading.motor_angle if motion.controls_position else 0.0,
        )

    def _actual_values(self) -> Iterator[tuple[int, Callable[[], int]]]:
        """Objects of the last sample by index."""
        status, power, motion, shaft = self._status, self._power, self._motion, self._shaft
        settings = motion.settings

        def counts(angle: float) -> int:
            return wrapped(settings.counts(angle), 32)

        def speed(value: float) -> int:
            return wrapped(value / settings.units.speed, 32)

        def torque(value: float) -> int:
            return _permille(value / settings.units.torque)

        yield 0x6041, lambda: status.word(power.state)
        yield 0x6061, lambda: motion.mode
        yield 0x6064, lambda: counts(self._sampled.angle)
        yield 0x606C, lambda: speed(self._sampled.speed)
        yield 0x6077, lambda: torque(self._sampled.torque)
        yield 0x6078, lambda: torque(self._sampled.torque)
        yield 0x6074, lambda: torque(self._sampled.demanded_torque)
        yield 0x6062, lambda: counts(self._sampled.demanded_angle)
        yield 0x606B, lambda: speed(self._sampled.demanded_speed)
        yield 0x60F4, lambda: wrapped(self._sampled.following_error / settings.units.angle, 32)
        yield 0x60FD, lambda: motion.switches.inputs(shaft.motor_angle)

    def _watch_following(self) -> None:
        motion = self._motion
        error = abs(motion.demand.angle - self._shaft.motor_angle)
        beyond = error > motion.settings.limits.following_window
        self._status.following_error = beyond
        if not beyond:
            self._following_since = None
            return
        if self._following_since is None:
            self._following_since = self.now
        if self.now - self._following_since >= motion.settings.limits.following_time:
            self.following_failed()


def _permille(value: float) -> int:
    return max(-32768, min(32767, round(value)))

"""The axis of a simulated drive: motion in short time steps, and feedback."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, inf

from winchkit.sim.drive.motion import Motion
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.power import PowerStage
from winchkit.sim.drive.shaft import Shaft
from winchkit.sim.drive.status import StatusBits
from winchkit.sim.drive.units import wrapped

__all__ = ["Axis"]

_LEAST_SLICE = 2e-5
"""Shorter times are left to the next call, s."""


class Axis:
    """Motion and feedback, starting at the time ``now``, in steps of at most ``longest_step`` s.

    ``following_failed`` is called while the following error (60F4h) has been beyond its window
    (6065h) for longer than 6066h allows.
    """

    def __init__(
        self,
        objects: ObjectDictionary,
        shaft: Shaft,
        power: PowerStage,
        motion: Motion,
        status: StatusBits,
        *,
        now: float,
        longest_step: float,
    ) -> None:
        self._longest_step = longest_step
        self._objects, self._shaft = objects, shaft
        self._power, self._motion, self._status = power, motion, status
        self.following_failed: Callable[[], None] = lambda: None
        self.now = now
        self._sampled_at = -inf
        self._following_since: float | None = None

    def advance(self, now: float, tolerance: float = 0.0) -> None:
        """Move until ``now``, if more than ``tolerance`` s is left."""
        duration = now - self.now
        if duration < max(_LEAST_SLICE, tolerance):
            return
        count = ceil(duration / self._longest_step - 1e-6)
        dt = duration / count
        start, shaft, motion = self.now, self._shaft, self._motion
        for index in range(count):
            command = motion.step(self._power.order, shaft.motor_angle, shaft.motor_velocity, dt)
            shaft.advance(dt, command)
            self.now = start + (index + 1) * dt
            if motion.stop_is_over(shaft.motor_velocity):
                self._power.standstill()
            self._watch_following()
        self.now = now
        self._status.advance(shaft.motor_angle, shaft.motor_velocity, duration)

    def sample(self, error_code: int) -> None:
        """Update the actual values in the object dictionary."""
        put, motion = self._objects.put, self._motion
        put(0x6041, 0, self._status.word(self._power.state))
        put(0x603F, 0, error_code)
        put(0x6061, 0, motion.mode)
        if self._sampled_at == self.now:
            return
        self._sampled_at = self.now
        reading, settings, demand = self._shaft.measure(), motion.settings, motion.demand
        units = settings.units
        put(0x6064, 0, wrapped(settings.counts(reading.motor_angle), 32))
        put(0x606C, 0, wrapped(reading.motor_velocity / units.speed, 32))
        torque = _permille(reading.motor_torque / units.torque)
        put(0x6077, 0, torque)
        put(0x6078, 0, torque)
        demanded = demand.torque if motion.set_points.torque else reading.motor_torque
        put(0x6074, 0, _permille(demanded / units.torque))
        put(0x6062, 0, wrapped(settings.counts(demand.angle), 32))
        put(0x606B, 0, wrapped(demand.speed / units.speed, 32))
        error = demand.angle - reading.motor_angle if motion.controls_position else 0.0
        put(0x60F4, 0, wrapped(error / units.angle, 32))
        put(0x60FD, 0, motion.switches.inputs(self._shaft.motor_angle))

    def forget_sample(self) -> None:
        """Discard the last sample, e.g. after a change of units."""
        self._sampled_at = -inf

    def _watch_following(self) -> None:
        motion = self._motion
        error = abs(motion.demand.angle - self._shaft.motor_angle)
        beyond = motion.controls_position and error > motion.settings.following_window()
        self._status.following_error = beyond
        if not beyond:
            self._following_since = None
            return
        if self._following_since is None:
            self._following_since = self.now
        if self.now - self._following_since >= motion.settings.following_time():
            self.following_failed()


def _permille(value: float) -> int:
    return max(-32768, min(32767, round(value)))

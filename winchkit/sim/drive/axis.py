"""The axis of a simulated drive: motion in short time steps, and feedback."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, inf
from typing import NamedTuple

from winchkit.sim.drive.modes import Mode
from winchkit.sim.drive.motion import DriveMotion
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.power import PowerStage, PowerState
from winchkit.sim.drive.shaft import Shaft
from winchkit.sim.drive.units import wrapped

_VOLTAGE, _REMOTE, _REACHED, _LIMIT = 1 << 4, 1 << 9, 1 << 10, 1 << 11


class StatusBits:
    """Times within the windows, and status bits; ``toggling``: bit 10 is the parity of SYNCs."""

    def __init__(self, objects: ObjectDictionary, motion: DriveMotion, *, toggling: bool) -> None:
        self._objects, self._motion, self._toggling = objects, motion, toggling
        self.following_error = False
        self.syncs = 0
        self._position_time = self._speed_time = self._slow_time = 0.0
        self._speed = 0.0

    def advance(self, angle: float, speed: float, dt: float) -> None:
        """Advance by ``dt`` s with the motor at ``angle`` (rad) and ``speed`` (rad/s)."""
        settings = self._motion.settings
        limits = settings.limits
        self._speed = speed
        near = abs(self._target() - angle) <= limits.position_window
        self._position_time = self._position_time + dt if near else 0.0
        target = self._objects.number(0x60FF, 0, 0) * settings.units.speed
        near = abs(target - speed) <= limits.speed_window
        self._speed_time = self._speed_time + dt if near else 0.0
        slow = abs(speed) <= limits.slow_speed
        self._slow_time = self._slow_time + dt if slow else 0.0

    def _target(self) -> float:
        settings, number = self._motion.settings, self._objects.number
        if self._motion.mode is Mode.IP:
            return settings.angle(number(0x60C1, 1, 0))
        return settings.angle(number(0x607A, 0, 0))

    @property
    def position_reached(self) -> bool:
        """Within the position window (6067h) for the time 6068h."""
        return self._position_time > self._motion.settings.limits.position_time

    @property
    def speed_reached(self) -> bool:
        """Within the velocity window (606Dh) for the time 606Eh."""
        return self._speed_time > self._motion.settings.limits.speed_time

    @property
    def slow(self) -> bool:
        """Below the velocity threshold (606Fh) for the time 6070h."""
        return self._slow_time > self._motion.settings.limits.slow_time

    def word(self, state: PowerState) -> int:
        """Status word (6041h) in a state."""
        if state is PowerState.NOT_READY:
            return 0
        word = int(state) | _VOLTAGE | _REMOTE
        still = self._motion.at_rest(self._speed)
        if state is PowerState.QUICK_STOP_ACTIVE and still:
            word |= _REACHED
        if state is not PowerState.OPERATION_ENABLED:
            return word
        word |= _LIMIT if self._motion.demand.limited else 0
        return word | self._mode_bits(still)

    def _mode_bits(self, still: bool) -> int:
        motion = self._motion
        bits = motion.set_points.bits(self)
        if motion.set_points.cyclic:
            bits = 0 if motion.stopping else bits
            return bits | (_REACHED if self._toggling and self.syncs % 2 else 0)
        if motion.stopping:
            bits = bits & ~_REACHED | (_REACHED if still else 0)
        return bits


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

"""Set-points of a simulated drive: what its inner loops are told, slice by slice."""

from __future__ import annotations

from enum import IntEnum
from math import copysign, inf, sqrt

from winchkit.sim.drive_power import RAMPS, Order
from winchkit.sim.drive_pp import ProfilePosition
from winchkit.sim.drive_smooth import MovingAverage
from winchkit.sim.drive_units import Units
from winchkit.sim.object_dictionary import ObjectDictionary
from winchkit.sim.servo import DriveCommand

__all__ = ["SIMULATED_MODES", "Mode", "Motion", "approach"]

_RPM = 0.10471975511965977
_STANDSTILL = 0.05
"""rad/s below which a ramp has ended."""
_PATIENCE = 0.5
"""s for which a stop waits for the motor to stand after its ramp."""
_NO_LIMITS = (-(2**31), 2**31 - 1)


class Mode(IntEnum):
    """Values of 6060h that are simulated; the value less one is its bit in 6502h."""

    NONE = 0
    PP = 1
    PV = 3
    CSP = 8
    CSV = 9


SIMULATED_MODES = sum(1 << (mode - 1) for mode in Mode if mode)
"""What 6502h says."""


def approach(value: float, goal: float, step: float) -> float:
    """Go from ``value`` towards ``goal`` by at most ``step``."""
    return goal if abs(goal - value) <= step else value + copysign(step, goal - value)


class Motion:
    """Makes :class:`DriveCommand` of an order, the mode and the targets.

    ``smoothing`` (s) averages the targets of CSV, as drives can: it keeps the jitter of a
    master's cycle out of the rope. ``angle`` and ``speed`` of the methods are the motor's own,
    in rad and rad/s; ``units`` may be replaced while the drive is off.
    """

    def __init__(
        self, objects: ObjectDictionary, units: Units, *, brake: bool, smoothing: float = 0.0
    ) -> None:
        self._objects = objects
        self._smooth = MovingAverage(smoothing)
        self.units = units
        self._off = DriveCommand.off(brake=brake)
        self.mode = Mode.NONE
        self.halted = False
        self.speed = 0.0
        """Demanded, rad/s."""
        self.angle = 0.0
        """Demanded, rad; the actual one where the mode controls speed only."""
        self.limited = False
        """Status bit 11: a limit holds the demand back."""
        self.stopping = False
        self.profile = ProfilePosition()
        self._following = False
        self._from = self._goal = 0.0
        self._elapsed = inf
        self._clipped = False
        self._wanted = 0.0
        self._stood = 0.0

    @property
    def controls_position(self) -> bool:
        """Whether the demanded angle is followed now."""
        return self._following and not self.stopping and self.mode in (Mode.PP, Mode.CSP)

    def set_mode(self, mode: Mode, angle: float) -> None:
        """Change the mode; set-points begin where the motor is."""
        self.mode = mode
        self.profile.reset()
        self._begin(angle)

    def _begin(self, angle: float) -> None:
        """Let the set-points go on from the present speed, at an angle."""
        self.angle, self._wanted = angle, self.speed
        self._smooth.begin(self.speed)
        self.aim()

    def aim(self) -> None:
        """A cyclic target was written: go there within the interpolation period (60C2h)."""
        number = self._objects.number
        self._elapsed = 0.0
        if self.mode is Mode.CSP:
            low, high = self._soft_limits()
            wanted = (number(0x607A) + number(0x60B0)) * self.units.angle
            self._from, self._goal = self.angle, min(max(wanted, low), high)
            self._clipped = self._goal != wanted
        else:
            self._from = self._wanted
            self._goal = (number(0x60FF) + number(0x60B1)) * self.units.speed

    def step(self, order: Order, angle: float, speed: float, dt: float) -> DriveCommand:
        """Command for the next ``dt`` s, given where the motor is."""
        if order is Order.OFF:
            self._following = self.stopping = False
            self.profile.reset()
            self.angle, self.speed = angle, speed
            return self._off
        if not self._following:
            self._following = True
            self.speed = speed
            self._begin(angle)
        self.limited = False
        halt = self.halted and order is Order.FOLLOW
        if halt or order is not Order.FOLLOW:
            return self._stop(order, angle, speed, dt)
        if self.stopping:
            self.stopping = False
            self._begin(angle)
        return self._follow(angle, speed, dt)

    def at_rest(self, speed: float) -> bool:
        """Whether it stands still at the end of a stop."""
        return self.stopping and self.speed == 0 and abs(speed) < _STANDSTILL

    def stop_is_over(self, speed: float) -> bool:
        """Whether a stop has ended, or has had time enough: a motor may be dragged along."""
        return self.at_rest(speed) or (self.stopping and self._stood > _PATIENCE)

    def _stop(self, order: Order, angle: float, speed: float, dt: float) -> DriveCommand:
        if order is Order.FOLLOW:
            order = RAMPS.get(self._objects.number(0x605D), Order.SLOW_DOWN)
        else:
            self.profile.reset()
        if not self.stopping:
            self.stopping, self._stood = True, 0.0
        index = {Order.SLOW_DOWN: 0x6084, Order.QUICK_STOP: 0x6085}.get(order, 0x60C6)
        self.speed = approach(self.speed, 0.0, self._per_second(index) * dt)
        self._stood = self._stood + dt if self.speed == 0 else 0.0
        self.angle = angle
        return self._command(None)

    def _follow(self, angle: float, speed: float, dt: float) -> DriveCommand:
        if self.mode is Mode.PV:
            self._profile_velocity(angle, dt)
        elif self.mode is Mode.CSV:
            self._cyclic_velocity(angle, dt)
        elif self.mode is Mode.CSP:
            return self._cyclic_position(dt)
        elif self.mode is Mode.PP:
            return self._profile_position(dt)
        else:
            self.speed = approach(self.speed, 0.0, self._per_second(0x6084) * dt)
        self.angle = angle
        return self._command(None)

    def _profile_velocity(self, angle: float, dt: float) -> None:
        fastest = min(self._objects.number(0x607F) * self.units.speed, self._motor_speed())
        goal = self._objects.number(0x60FF) * self.units.speed
        goal = self._within(self._clamped(goal, fastest), angle, self._per_second(0x6084))
        faster = abs(goal) > abs(self.speed) and goal * self.speed >= 0
        rate = self._per_second(0x6083 if faster else 0x6084)
        self.speed = approach(self.speed, goal, rate * dt)

    def _cyclic_velocity(self, angle: float, dt: float) -> None:
        self._wanted = self._interpolated(dt)
        goal = self._clamped(self._smooth.step(self._wanted, dt), self._motor_speed())
        hardest = self._per_second(0x60C6)
        goal = self._within(goal, angle, hardest)
        reached = approach(self.speed, goal, hardest * dt)
        self.limited |= reached != goal
        self.speed = reached

    def _cyclic_position(self, dt: float) -> DriveCommand:
        wanted = self._interpolated(dt)
        farthest = self._motor_speed() * dt
        before, self.angle = self.angle, approach(self.angle, wanted, farthest)
        self.limited = self._clipped or self.angle != wanted
        self.speed = (self.angle - before) / dt
        extra = self._objects.number(0x60B1) * self.units.speed
        return self._command(self.angle, self.speed + extra)

    def _profile_position(self, dt: float) -> DriveCommand:
        number = self._objects.number
        fastest = min(number(0x6081), number(0x607F)) * self.units.speed
        self.angle, self.speed = self.profile.step(
            self.angle,
            self.speed,
            min(fastest, self._motor_speed()),
            (self._per_second(0x6083), self._per_second(0x6084)),
            dt,
        )
        return self._command(self.angle)

    def start_profile(self, angle: float, *, relative: bool, at_once: bool) -> bool:
        """Take a new set-point of PP (607Ah); False where the buffer is full."""
        wanted = self._objects.number(0x607A) * self.units.angle
        if relative:
            last = self.profile.last
            wanted += angle if last is None else last
        low, high = self._soft_limits()
        return self.profile.accept(min(max(wanted, low), high), at_once=at_once)

    def _interpolated(self, dt: float) -> float:
        number = self._objects.number
        period = number(0x60C2, 1) * 10.0 ** number(0x60C2, 2)
        self._elapsed += dt
        if self._elapsed >= period:
            return self._goal
        return self._from + (self._goal - self._from) * self._elapsed / period

    def _clamped(self, speed: float, fastest: float) -> float:
        if abs(speed) <= fastest:
            return speed
        self.limited = True
        return copysign(fastest, speed)

    def _within(self, speed: float, angle: float, deceleration: float) -> float:
        """Slow a speed so that the motor can stop before the software limit (607Dh)."""
        low, high = self._soft_limits()
        room = high - angle if speed > 0 else angle - low
        if speed == 0 or room == inf:
            return speed
        return self._clamped(speed, sqrt(2 * deceleration * max(0.0, room)))

    def _soft_limits(self) -> tuple[float, float]:
        low, high = self._objects.number(0x607D, 1), self._objects.number(0x607D, 2)
        if (low, high) == _NO_LIMITS or low >= high:
            return -inf, inf
        return low * self.units.angle, high * self.units.angle

    def _motor_speed(self) -> float:
        return self._objects.number(0x6080) * _RPM

    def _per_second(self, index: int) -> float:
        return self._objects.number(index) * self.units.speed

    def _command(self, angle: float | None, speed: float | None = None) -> DriveCommand:
        number = self._objects.number
        limit = min(number(0x6072), number(0x60E0), number(0x60E1)) * self.units.torque
        return DriveCommand(
            speed=self.speed if speed is None else speed, angle=angle, torque_limit=limit
        )

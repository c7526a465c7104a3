"""Motion settings in the object dictionary of a simulated drive, in SI at the motor shaft."""

from __future__ import annotations

from math import inf, nan, pi
from typing import NamedTuple

from winchkit.schema.devices.servo import ServoSpec
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.units import units_of

_RPM = 2 * pi / 60
_RAMP_FROM = 3000 * _RPM
"""Final speed of ramps that are declared as times, rad/s."""
_TIMES = (0x6083, 0x6084, 0x6085, 0x609A)
_STEP = 1e6
"""Ramp of a drive without such an object, rad/s²."""
_MS = 1e-3
"""s: unit of times in 6066h to 6070h, and of ramps that are declared as times."""
_NO_LIMITS = (-(2**31), 2**31 - 1)
_INSTEAD = {0x6084: 0x6083, 0x6085: 0x6084, 0x60C6: 0x6085}
"""Ramps that replace a missing one."""
_UNWATCHED = 0xFFFFFFFF
"""6065h with all bits set: no following error (CiA 402)."""
_NARROW = 100
"""Default of a missing window, counts."""


class Limits(NamedTuple):
    """Values that every step of the motion needs, SI at the motor shaft."""

    torque: tuple[float, float]
    """Greatest negative and positive torque, both as positive numbers, N m."""
    angle: tuple[float, float]
    """Lowest and highest motor angle by 607Dh, rad."""
    top_speed: float
    """Maximum motor speed (6080h), rad/s."""
    period: float
    """Interpolation period (60C2h), s; 0 where the drive does not interpolate."""
    following_window: float
    """Following error window (6065h), rad."""
    following_time: float
    """Following error time-out (6066h), s."""
    position_window: float
    """6067h, rad."""
    position_time: float
    """6068h, s."""
    speed_window: float
    """606Dh, rad/s."""
    speed_time: float
    """606Eh, s."""
    slow_speed: float
    """Velocity threshold (606Fh), rad/s."""
    slow_time: float
    """6070h, s."""


class Settings:
    """Present units, zero, limits and ramps.

    ``zero`` is the motor angle (rad) at which the position counts 0; homing moves it.
    """

    def __init__(self, objects: ObjectDictionary, servo: ServoSpec) -> None:
        self.number = objects.number
        self._objects, self._servo = objects, servo
        self.zero = 0.0
        self._changes, self._zero = -1, nan
        self._ramps: dict[int, float] = {}
        self.read_units()

    def read_units(self) -> None:
        """Read the units again after a change."""
        self.units = units_of(self._objects, self._servo)
        self._changes = -1

    @property
    def limits(self) -> Limits:
        """Present limits and windows, computed anew after a change."""
        if self._objects.changes != self._changes or self.zero != self._zero:
            self._read()
        return self._limits

    def _read(self) -> None:
        self._changes, self._zero = self._objects.changes, self.zero
        self._ramps.clear()
        number, unit = self.number, self.units
        window = number(0x6065, 0, _UNWATCHED)
        self._limits = Limits(
            self._torque_band(),
            self._soft_limits(),
            number(0x6080) * _RPM if (0x6080, 0) in self._objects else inf,
            number(0x60C2, 1, 0) * 10.0 ** number(0x60C2, 2, -3),
            inf if window == _UNWATCHED else window * unit.angle,
            number(0x6066, 0, 0) * _MS,
            number(0x6067, 0, _NARROW) * unit.angle,
            number(0x6068, 0, 0) * _MS,
            number(0x606D, 0, _NARROW) * unit.speed,
            number(0x606E, 0, 0) * _MS,
            number(0x606F, 0, _NARROW) * unit.speed,
            number(0x6070, 0, 0) * _MS,
        )

    def angle(self, counts: int) -> float:
        """Motor angle of a position, rad."""
        return self.zero + counts * self.units.angle

    def counts(self, angle: float) -> float:
        """Position of a motor angle (rad)."""
        return (angle - self.zero) / self.units.angle

    def take_home(self, angle: float) -> None:
        """Move the zero so that a motor angle (rad) is home, by the home offset (607Ch)."""
        offset = self.number(0x607C, 0, 0) * self.units.angle
        self.zero = angle + (-offset if self._servo.quirks.home_gets_offset else offset)

    def ramp(self, index: int) -> float:
        """Acceleration of an object such as 6083h, rad/s²; nearly a step where it is missing."""
        if self._objects.changes != self._changes:
            self._read()
        found = self._ramps.get(index)
        if found is None:
            found = self._ramps[index] = self._ramp(index)
        return found

    def _ramp(self, index: int) -> float:
        while not (value := self.number(index, 0, 0)):
            if index not in _INSTEAD:
                return _STEP
            index = _INSTEAD[index]
        if self._servo.quirks.ramps_are_times and index in _TIMES:
            return _RAMP_FROM / (value * _MS)
        return value * self.units.speed

    def profile_speed(self) -> float:
        """Maximum profile velocity (607Fh), rad/s."""
        fastest = inf
        if (0x607F, 0) in self._objects:
            fastest = self.number(0x607F) * self.units.speed
        return min(fastest, self.limits.top_speed)

    def _torque_band(self) -> tuple[float, float]:
        # A current limit is in per mille of the rated current, like a torque limit of the rated
        # torque.
        number, most = self.number, 0xFFFF
        both = min(number(0x6072, 0, most), number(0x6073, 0, most))
        unit = self.units.torque
        return min(both, number(0x60E1, 0, most)) * unit, min(both, number(0x60E0, 0, most)) * unit

    def _soft_limits(self) -> tuple[float, float]:
        low, high = self.number(0x607D, 1, _NO_LIMITS[0]), self.number(0x607D, 2, _NO_LIMITS[1])
        if (low, high) == _NO_LIMITS or low >= high:
            return -inf, inf
        return self.angle(low), self.angle(high)

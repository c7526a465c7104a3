"""Motion settings in the object dictionary of a simulated drive, in SI at the motor shaft."""

from __future__ import annotations

from math import inf, nan, pi
from typing import NamedTuple

from winchkit.schema.devices.servo import ServoSpec
from winchkit.sim.drive.object_dictionary import ObjectDictionary
from winchkit.sim.drive.units import units_of

__all__ = ["Settings"]

_RPM = 2 * pi / 60
_RAMP_FROM = 3000 * _RPM
"""Final speed of ramps that are declared as times, rad/s."""
_TIMES = (0x6083, 0x6084, 0x6085, 0x609A)
_STEP = 1e6
"""Ramp of a drive without such an object, rad/s²."""
_MS = 1e-3
_NO_LIMITS = (-(2**31), 2**31 - 1)
_INSTEAD = {0x6084: 0x6083, 0x6085: 0x6084, 0x60C6: 0x6085}
"""Ramps that replace a missing one."""
_UNWATCHED = 0xFFFFFFFF


class _Limits(NamedTuple):
    torque: tuple[float, float]
    angle: tuple[float, float]
    top_speed: float
    period: float


class Settings:
    """Present units, zero, limits and ramps.

    ``zero`` is the motor angle (rad) at which the position counts 0; homing moves it.
    """

    def __init__(self, objects: ObjectDictionary, servo: ServoSpec) -> None:
        self.number = objects.number
        self._objects, self._servo = objects, servo
        self.zero = 0.0
        self._valid_for = (-1, nan)
        self.read_units()

    def read_units(self) -> None:
        """Read the units again after a change."""
        self.units = units_of(self._objects, self._servo)

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
        while not (value := self.number(index, 0, 0)):
            if index not in _INSTEAD:
                return _STEP
            index = _INSTEAD[index]
        if self._servo.quirks.ramps_are_times and index in _TIMES:
            return _RAMP_FROM / (value * _MS)
        return value * self.units.speed

    def top_speed(self) -> float:
        """Maximum motor speed (6080h), rad/s."""
        return self._limits().top_speed

    def _limits(self) -> _Limits:
        """Values that every step of the motion needs, computed anew after a change."""
        present = self._objects.changes, self.zero
        if present != self._valid_for:
            self._valid_for = present
            declared = (0x6080, 0) in self._objects
            self._found = _Limits(
                self._torque_band(),
                self._soft_limits(),
                self.number(0x6080) * _RPM if declared else inf,
                self.number(0x60C2, 1, 0) * 10.0 ** self.number(0x60C2, 2, -3),
            )
        return self._found

    def profile_speed(self) -> float:
        """Maximum profile velocity (607Fh), rad/s."""
        fastest = inf
        if (0x607F, 0) in self._objects:
            fastest = self.number(0x607F) * self.units.speed
        return min(fastest, self.top_speed())

    def torque_band(self) -> tuple[float, float]:
        """Greatest negative and positive torque, both as positive numbers, N m.

        A current limit is in per mille of the rated current, like a torque limit of the rated
        torque.
        """
        return self._limits().torque

    def _torque_band(self) -> tuple[float, float]:
        number, most = self.number, 0xFFFF
        both = min(number(0x6072, 0, most), number(0x6073, 0, most))
        unit = self.units.torque
        return min(both, number(0x60E1, 0, most)) * unit, min(both, number(0x60E0, 0, most)) * unit

    def soft_limits(self) -> tuple[float, float]:
        """Lowest and highest motor angle by 607Dh, rad."""
        return self._limits().angle

    def _soft_limits(self) -> tuple[float, float]:
        low, high = self.number(0x607D, 1, _NO_LIMITS[0]), self.number(0x607D, 2, _NO_LIMITS[1])
        if (low, high) == _NO_LIMITS or low >= high:
            return -inf, inf
        return self.angle(low), self.angle(high)

    def period(self) -> float:
        """Interpolation period (60C2h), s; 0 where the drive does not interpolate."""
        return self._limits().period

    def following_window(self) -> float:
        """Following error window (6065h), rad."""
        window = self.number(0x6065, 0, _UNWATCHED)
        return inf if window == _UNWATCHED else window * self.units.angle

    def following_time(self) -> float:
        """Following error time-out (6066h), s."""
        return self.number(0x6066, 0, 0) * _MS

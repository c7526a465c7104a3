"""Units of a simulated drive: SI values of its counts at the motor shaft."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from winchkit.schema.devices.drive_unit import product_of
from winchkit.schema.devices.servo import ServoSpec
from winchkit.sim.drive.object_dictionary import ObjectDictionary

_TURN = 2 * pi
SCALES = (0x608F, 0x6091, 0x6092, 0x6076, 0x60A8, 0x60A9)
"""Objects that determine units."""
_ANGLES = {0x10: 1.0, 0x41: pi / 180, 0xB4: _TURN}
"""Radian, degree and revolution by their codes of CiA 303-2, in rad."""
_TIMES = {0x03: 1.0, 0x47: 60.0}
"""Second and minute, in s."""


@dataclass(frozen=True)
class CountUnits:
    """SI value of one count."""

    angle: float
    """Of 6064h and 607Ah, rad."""
    speed: float
    """Of 606Ch and 60FFh, rad/s; of accelerations, rad/s²."""
    torque: float
    """Of 6077h, which is in per mille of the rated torque, N m."""


def units_of(objects: ObjectDictionary, servo: ServoSpec) -> CountUnits:
    """Units by 608Fh, 6091h, 6092h, 60A8h, 60A9h and 6076h; the device file for what is absent.

    A device file may also declare that the drive does not use its scale objects. By CiA 402 a
    position has the unit of the feed constant per shaft turn, or else of encoder increments.
    """
    by_drive = servo.units == "drive"

    def ratio(index: int) -> float | None:
        above, below = objects.number(index, 1, 0), objects.number(index, 2, 0)
        return above / below if by_drive and above and below else None

    def code(index: int) -> int:
        return objects.number(index, 0, 0) if by_drive else 0

    gear = ratio(0x6091) or 1.0
    encoder = ratio(0x608F) or float(servo.increments_per_turn)
    angle = _angle_of(code(0x60A8)) or _TURN / (ratio(0x6092) or encoder)
    if servo.position_unit is not None:
        said = product_of(servo.position_unit, "position")
        angle = said.factor * encoder**said.encoder * (_TURN / encoder) ** said.increments
    speed = gear * _speed_of(code(0x60A9))
    if not speed:
        said = product_of(servo.speed_unit, "speed")
        speed = said.factor * encoder**said.encoder * (angle * gear) ** said.increments
    rated = objects.number(0x6076, 0, 0) * 1e-3 or servo.rated_torque
    return CountUnits(angle * gear, speed, rated * 1e-3)


def _angle_of(code: int) -> float:
    """Angle (rad) of an SI unit code; 0 for increments and units other than angles."""
    return _prefix(code) * _ANGLES.get(code >> 16 & 0xFF, 0.0)


def _speed_of(code: int) -> float:
    """Speed (rad/s) of an SI unit code; 0 for increments and units other than angular speeds."""
    time = _TIMES.get(code >> 8 & 0xFF)
    return _angle_of(code) / time if time else 0.0


def _prefix(code: int) -> float:
    exponent = code >> 24 & 0xFF
    return 10.0 ** (exponent - 256 if exponent > 127 else exponent)


def wrapped(value: float, bits: int) -> int:
    """Round to a signed integer that wraps around like a position counter."""
    half = 1 << (bits - 1)
    return (round(value) + half) % (1 << bits) - half

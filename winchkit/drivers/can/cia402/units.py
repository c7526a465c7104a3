"""Conversion between a drive's units and SI at the motor shaft."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, nan, pi

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.errors import NotPermitted
from winchkit.schema.devices.drive_unit import product_of
from winchkit.schema.devices.servo import ServoSpec

_TURN = 2 * pi
_I32, _I16 = 2**31 - 1, 2**15 - 1
_COARSEST = 16
"""Position units a turn: with fewer, the objects cannot be meant."""
_PER_MILLE = 1e-3
"""Unit of 6071h, 6077h and 6078h: thousandths of the rated torque (6076h) and current (6075h)."""

_ANGLES = {0x10: 1.0, 0x41: pi / 180, 0xB4: _TURN}
"""rad of the rotary units of CiA 303-2: radian, degree, revolution."""
_TIMES = {0x03: 1.0, 0x47: 60.0}
"""s of second and minute."""


@dataclass(frozen=True)
class CountScale:
    """SI value of one count."""

    angle: float
    """rad."""
    velocity: float
    """rad/s."""
    torque: float
    """N m; a per mille of the rated torque."""
    current: float = nan
    """A; a per mille of the rated current, NaN where the drive does not report it."""

    @property
    def rated_torque(self) -> float:
        """N m."""
        return self.torque / _PER_MILLE

    def angle_counts(self, angle: float) -> int:
        """Counts of a motor angle (rad); raises NotPermitted beyond 32 bits."""
        return _counts(angle, self.angle, _I32, "angle", "rad")

    def unwrapped_counts(self, angle: float) -> int:
        """Counts of a motor angle (rad) of any number of turns; raises NotPermitted for none."""
        if not isfinite(angle):
            raise NotPermitted(f"motor angle {angle:g} rad is no target")
        return round(angle / self.angle)

    def velocity_counts(self, velocity: float) -> int:
        """Counts of a motor speed (rad/s); raises NotPermitted beyond 32 bits."""
        return _counts(velocity, self.velocity, _I32, "velocity", "rad/s")

    def torque_counts(self, torque: float) -> int:
        """Counts of a motor torque (N m); raises NotPermitted beyond 16 bits."""
        return _counts(torque, self.torque, _I16, "torque", "N m")


def _counts(value: float, unit: float, most: int, name: str, symbol: str) -> int:
    counts = value / unit
    if not abs(counts) < most + 0.5:
        raise NotPermitted(
            f"motor {name} {value:g} {symbol} is beyond the drive's range of "
            f"±{unit * most:g} {symbol}"
        )
    return round(counts)


@dataclass(frozen=True)
class UnitObjects:
    """Objects of a drive that define its units; None where it has none, or it is zero."""

    encoder: float | None = None
    """608Fh: increments a motor turn."""
    gear: float | None = None
    """6091h: motor turns a shaft turn."""
    feed: float | None = None
    """6092h: position units a shaft turn."""
    position: int | None = None
    """60A8h: SI unit of positions."""
    velocity: int | None = None
    """60A9h: SI unit of velocities."""
    rated_torque: float | None = None
    """6076h, N m."""
    rated_current: float | None = None
    """6075h, A."""


def units_by(read: Callable[[int, int], int | None]) -> UnitObjects:
    """Everything that says something of units, by what reads an object or has none."""

    def ratio(index: int) -> float | None:
        above, below = read(index, 1), read(index, 2)
        return above / below if above and below else None

    def milli(index: int) -> float | None:
        value = read(index, 0)
        return value * 1e-3 if value else None

    return UnitObjects(
        encoder=ratio(0x608F),
        gear=ratio(0x6091),
        feed=ratio(0x6092),
        position=read(0x60A8, 0),
        velocity=read(0x60A9, 0),
        rated_torque=milli(0x6076),
        rated_current=milli(0x6075),
    )


def scale_of(units: UnitObjects, servo: ServoSpec) -> CountScale:
    """Scale at the motor shaft, with values of the device file where the drive has none.

    Positions count ``feed / gear`` units a motor turn (CiA 402-2, position actual value), or
    ``encoder / gear`` without a feed constant, unless 60A8h names a rotary SI unit. Speeds are
    in the unit of 60A9h, else in the device file's. Raises NotPermitted for a scale that no
    encoder has.
    """
    said = units if servo.units == "drive" else UnitObjects()
    gear = said.gear or 1.0
    encoder = said.encoder or float(servo.increments_per_turn)
    named = _rotary(said.position, per_time=False)
    if named is not None:
        angle = named * gear
    elif servo.position_unit is not None:
        angle = _declared(servo.position_unit, "position", _TURN / encoder, encoder)
    else:
        angle = _TURN * gear / (said.feed or encoder)
    if not 0 < angle <= _TURN / _COARSEST:
        by, correct = "608Fh, 6091h and 6092h", 'them, or set servo.units = "file"'
        if servo.units == "file":
            by, correct = "its device file", "position_unit or increments_per_turn"
        raise NotPermitted(
            f"by {by} a motor turn has {_TURN / angle:g} position units, too few to move by; "
            f"correct {correct} in the device file"
        )
    speed = _rotary(said.velocity, per_time=True)
    if speed is not None:
        velocity = speed * gear
    else:
        velocity = _declared(servo.speed_unit, "speed", angle, encoder)
    torque = (units.rated_torque or servo.rated_torque) * _PER_MILLE
    return CountScale(angle, velocity, torque, (units.rated_current or nan) * _PER_MILLE)


def _declared(text: str, of: str, increment: float, encoder: float) -> float:
    """SI value of a unit of a device file, by the angle of an increment (rad)."""
    unit = product_of(text, of)
    return float(unit.factor * increment**unit.increments * encoder**unit.encoder)


def read_scale(node: SdoNode, servo: ServoSpec) -> CountScale:
    """Scale of a drive; raises NotPermitted, NoReply, DeviceRefused."""
    try:
        return scale_of(units_by(node.read_if_there), servo)
    except NotPermitted as error:
        raise NotPermitted(f"{node.place(0x608F, 1)}: {error}") from error


def _rotary(unit: int | None, *, per_time: bool) -> float | None:
    """SI value of a rotary unit code: prefix, numerator, denominator; None for any other."""
    if not unit:
        return None
    prefix, above, below = unit >> 24 & 0xFF, unit >> 16 & 0xFF, unit >> 8 & 0xFF
    power = prefix - 256 if prefix > 127 else prefix
    if above not in _ANGLES or (per_time and below not in _TIMES) or (not per_time and below):
        return None
    return _ANGLES[above] * 10.0**power / (_TIMES[below] if per_time else 1.0)

"""Profile velocities, ramps and homing parameters of a drive (6081h to 6085h, 6098h to 609Ah)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo import parse_object
from winchkit.drivers.can.cia402.units import CountScale
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import ServoSpec

_RAMP_SPEED = 3000 * 2 * pi / 60
"""Speed that a ramp declared as a time reaches from standstill, rad/s."""
_MS = 1e-3
"""s: unit of 6083h to 6085h where a drive takes ramps as times."""
METHODS = range(-128, 128)
HERE = (37, 35)
"""Methods that take the present position for the zero: the present number and the old one."""
_BY_RAMP = (2, 6)
"""Values of 605Ah with which a quick stop uses 6085h."""


@dataclass(frozen=True)
class HomingSpec:
    """How a drive finds its zero; SI at the motor shaft."""

    method: int
    """6098h, e.g. 17 and 18 for the limit switches, 33 and 34 for the index, 37 for "here"."""
    fast: float
    """Speed on the way to the switch, rad/s."""
    slow: float
    """Speed on the way to the zero, rad/s."""
    acceleration: float
    """rad/s^2."""
    offset: float = 0.0
    """Motor angle that the zero position gets (607Ch), rad."""


def set_profile(
    node: SdoNode,
    servo: ServoSpec,
    scale: CountScale,
    *,
    speed: float | None = None,
    acceleration: float | None = None,
) -> None:
    """Set speed (6081h, rad/s) and ramps (6083h, 6084h, rad/s²) of the profile modes."""
    if speed is not None:
        node.write_verified(0x6081, 0, scale.velocity_counts(_positive(speed, "speed", "rad/s")))
    if acceleration is not None:
        counts = _ramp(servo, scale, acceleration)
        for index in (0x6083, 0x6084):
            if node.read_if_there(index) is not None:
                node.write_verified(index, 0, counts)


def set_quick_stop(node: SdoNode, servo: ServoSpec, scale: CountScale, acceleration: float) -> None:
    """Set the ramp of quick stops (6085h, rad/s²); raises NotPermitted if 605Ah ignores it."""
    option = node.read_if_there(0x605A)
    if option not in _BY_RAMP or node.read_if_there(0x6085) is None:
        raise NotPermitted(
            f"{node.place(0x605A)} is {'missing' if option is None else option}: quick stops use "
            "6085h with 2 and 6 only, and the drive must have it; set options.quick_stop = 2"
        )
    node.write_verified(0x6085, 0, _ramp(servo, scale, acceleration))


def keeps_zero(node: SdoNode, servo: ServoSpec) -> bool:
    """Whether a drive has the objects by which a homing gives the present place a position."""
    needed = ((0x6098, 0), parse_object(servo.home_offset))
    return all(node.read_if_there(*key) is not None for key in needed)


def check_homing(node: SdoNode, servo: ServoSpec, homing: HomingSpec) -> None:
    """Read every object that a homing needs, before anything moves; raises NotPermitted."""
    if homing.method not in METHODS:
        raise NotPermitted(f"{node.place(0x6098)}: there is no homing method {homing.method}")
    needed = [(0x6098, 0)]
    if homing.method not in HERE:
        needed += [(0x6099, 1), (0x6099, 2)]
    if homing.offset:
        needed.append(parse_object(servo.home_offset))
    for index, sub in needed:
        if node.read_if_there(index, sub) is None:
            raise NotPermitted(
                f"{node.place(index, sub)}: the drive has no such object, which this homing needs; "
                "move the winch to a known place and give its length there (`winchkit home --here`)"
            )


def set_homing(node: SdoNode, servo: ServoSpec, scale: CountScale, homing: HomingSpec) -> None:
    """Write a homing's parameters and read them back.

    A method that moves nothing needs neither speeds (a drive may refuse a speed above its own
    limit) nor the acceleration (609Ah), which any drive may lack. Raises NotPermitted, NoReply,
    DeviceRefused (a method that the drive lacks).
    """
    check_homing(node, servo, homing)
    node.write_verified(0x6098, 0, homing.method)
    if homing.method not in HERE:
        for sub, speed in ((1, homing.fast), (2, homing.slow)):
            counts = scale.velocity_counts(_positive(speed, "homing speed", "rad/s"))
            node.write_verified(0x6099, sub, counts)
        if node.read_if_there(0x609A) is not None:
            node.write_verified(0x609A, 0, _ramp(servo, scale, homing.acceleration))
    home_offset = parse_object(servo.home_offset)
    if node.read_if_there(*home_offset) is not None:
        node.write_verified(*home_offset, scale.angle_counts(homing.offset))


def _ramp(servo: ServoSpec, scale: CountScale, acceleration: float) -> int:
    """Counts of an acceleration, or of the time that a drive wants instead; never none."""
    _positive(acceleration, "acceleration", "rad/s^2")
    if servo.quirks.ramps_are_times:
        return max(1, round(_RAMP_SPEED / acceleration / _MS))
    return max(1, round(acceleration / scale.velocity))


def _positive(value: float, name: str, unit: str) -> float:
    if not value > 0:
        raise NotPermitted(f"motor {name} {value:g} {unit} is not above zero")
    return value

"""Speeds and ramps that a drive makes itself, in profile modes and homing."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from winchkit.drivers.can.node import SdoNode
from winchkit.drivers.can.scale import Scale
from winchkit.errors import NotPermitted
from winchkit.schema.device_servo import ServoSpec

__all__ = ["HomingSpec", "set_homing", "set_profile"]

_RAMP_SPEED = 3000 * 2 * pi / 60
"""Speed that a ramp declared as a time reaches from standstill, rad/s."""
_MS = 1e-3
_METHOD = range(-128, 128)


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
    scale: Scale,
    *,
    speed: float | None = None,
    acceleration: float | None = None,
) -> None:
    """Set speed (6081h, rad/s) and ramps (6083h, 6084h, rad/s^2) of the profile modes.

    Raises NotPermitted, NoReply, DeviceRefused.
    """
    if speed is not None:
        node.write_verified(0x6081, 0, scale.velocity_counts(_positive(speed, "speed", "rad/s")))
    if acceleration is not None:
        counts = _ramp(servo, scale, acceleration)
        for index in (0x6083, 0x6084):
            if node.read_if_there(index) is not None:
                node.write_verified(index, 0, counts)


def set_homing(node: SdoNode, servo: ServoSpec, scale: Scale, homing: HomingSpec) -> None:
    """Write a homing's parameters and read them back.

    Raises NotPermitted, NoReply, DeviceRefused (a method that the drive lacks).
    """
    if homing.method not in _METHOD:
        raise NotPermitted(f"{node.place(0x6098)}: there is no homing method {homing.method}")
    node.write_verified(0x6098, 0, homing.method)
    for sub, speed in ((1, homing.fast), (2, homing.slow)):
        counts = scale.velocity_counts(_positive(speed, "homing speed", "rad/s"))
        node.write_verified(0x6099, sub, counts)
    if node.read_if_there(0x609A) is not None:
        node.write_verified(0x609A, 0, _ramp(servo, scale, homing.acceleration))
    if node.read_if_there(0x607C) is not None:
        node.write_verified(0x607C, 0, scale.angle_counts(homing.offset))
    elif homing.offset:
        raise NotPermitted(f"{node.place(0x607C)}: the drive has no home offset")


def _ramp(servo: ServoSpec, scale: Scale, acceleration: float) -> int:
    """Counts of an acceleration, or of the time that a drive wants instead; never none."""
    _positive(acceleration, "acceleration", "rad/s^2")
    if servo.quirks.ramps_are_times:
        return max(1, round(_RAMP_SPEED / acceleration / _MS))
    return max(1, round(acceleration / scale.velocity))


def _positive(value: float, name: str, unit: str) -> float:
    if not value > 0:
        raise NotPermitted(f"motor {name} {value:g} {unit} is not above zero")
    return value

"""What a simulated drive's counts mean at the motor shaft, in SI."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from winchkit.schema.device import ServoSpec
from winchkit.sim.object_dictionary import ObjectDictionary

__all__ = ["Units", "units_of", "wrapped"]

_TURN = 2 * pi


@dataclass(frozen=True)
class Units:
    """SI value of one count."""

    angle: float
    """rad of 6064h and 607Ah."""
    speed: float
    """rad/s of 606Ch, 60FFh and, per second, of the accelerations."""
    torque: float
    """N m of 6077h, which counts per mille of the rated torque."""


def units_of(objects: ObjectDictionary, servo: ServoSpec) -> Units:
    """Units by 608Fh, 6091h and 6076h; the device file says where the EDS lacks one."""

    def ratio(index: int, default: float) -> float:
        if (index, 1) not in objects or (index, 2) not in objects:
            return default
        below = objects.number(index, 2)
        return objects.number(index, 1) / below if below else default

    per_shaft_turn = ratio(0x608F, float(servo.increments_per_turn))
    angle = _TURN * ratio(0x6091, 1.0) / per_shaft_turn
    speeds = {"increments/s": angle, "rpm": _TURN / 60, "0.1 rpm": _TURN / 600}
    rated = objects.number(0x6076) * 1e-3 if (0x6076, 0) in objects else servo.rated_torque
    return Units(angle, speeds[servo.speed_unit], rated * 1e-3)


def wrapped(value: float, bits: int) -> int:
    """Round to a signed integer that wraps around like a position counter."""
    half = 1 << (bits - 1)
    return (round(value) + half) % (1 << bits) - half

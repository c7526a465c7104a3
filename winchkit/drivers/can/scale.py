"""A drive's own units against SI at the motor shaft."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from winchkit.drivers.can.node import SdoNode
from winchkit.errors import NotPermitted
from winchkit.schema.device import ServoSpec

__all__ = ["Scale", "read_scale"]

_I32 = range(-(2**31), 2**31)


@dataclass(frozen=True)
class Scale:
    """SI value of one count."""

    angle: float
    """rad."""
    velocity: float
    """rad/s."""
    torque: float
    """N m."""

    def angle_counts(self, angle: float) -> int:
        """Counts of a motor angle (rad); raises NotPermitted beyond 32 bits."""
        return _counts(angle, self.angle, "angle", "rad")

    def velocity_counts(self, velocity: float) -> int:
        """Counts of a motor speed (rad/s); raises NotPermitted beyond 32 bits."""
        return _counts(velocity, self.velocity, "velocity", "rad/s")


def _counts(value: float, unit: float, name: str, symbol: str) -> int:
    counts = value / unit
    if not (_I32.start <= counts <= _I32.stop - 1):
        raise NotPermitted(
            f"motor {name} {value:g} {symbol} is beyond the drive's range of "
            f"±{unit * _I32.stop:g} {symbol}"
        )
    return round(counts)


def read_scale(node: SdoNode, servo: ServoSpec) -> Scale:
    """Scale from 608Fh, 6091h and 6076h, the device file standing in for what is absent.

    608Fh counts increments per shaft turn as the drive sees it, 6091h motor turns per such turn.
    """
    increments = node.read_if_there(0x608F, 1)
    turns = node.read_if_there(0x608F, 2)
    motor, shaft = node.read_if_there(0x6091, 1), node.read_if_there(0x6091, 2)
    per_turn = increments / turns if increments and turns else float(servo.increments_per_turn)
    if motor and shaft:
        per_turn *= shaft / motor
    rated = node.read_if_there(0x6076)
    torque = rated * 1e-3 if rated else servo.rated_torque
    angle = 2 * pi / per_turn
    velocity = {"increments/s": angle, "rpm": 2 * pi / 60, "0.1 rpm": 2 * pi / 600}
    return Scale(angle, velocity[servo.speed_unit], torque * 1e-3)

"""Between motor and rope, quick enough for every control cycle."""

from __future__ import annotations

from typing import Protocol

__all__ = ["LineModel", "RopeMap"]

_FAR = 5e-3


class LineModel(Protocol):
    """The part of ``winchkit.model.line.Line`` that moving a winch needs."""

    def cable_length(self, motor_angle: float) -> float:
        """Free length at a motor angle, m."""

    def motor_angle(self, cable_length: float) -> float:
        """Motor angle (rad) at a free length."""

    def arm(self, motor_angle: float) -> float:
        """Rope wound in per motor angle, m/rad; positive angle times arm winds in."""


class RopeMap:
    """Cable length and arm near the last angle, renewed after every 5 mm of rope.

    Within them the arm of a drum changes by far less than a thousandth.
    """

    def __init__(self, line: LineModel) -> None:
        self.line = line
        self._angle = float("nan")
        self._length = self._arm = float("nan")

    def at(self, motor_angle: float) -> tuple[float, float]:
        """Cable length (m) and arm (m/rad) at a motor angle (rad)."""
        change = (motor_angle - self._angle) * self._arm
        if not abs(change) < _FAR:
            self._angle = motor_angle
            self._length = self.line.cable_length(motor_angle)
            self._arm = self.line.arm(motor_angle)
            change = 0.0
        return self._length - change, self._arm

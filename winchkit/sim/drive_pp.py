"""Trapezoids of profile position: the move under way, and one set-point in reserve."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt

__all__ = ["Move", "Moves"]


@dataclass(frozen=True)
class Move:
    """A set-point as it was when it was taken, SI."""

    target: float
    """rad."""
    speed: float
    acceleration: float
    deceleration: float


class Moves:
    """The moves of the mode PP."""

    def __init__(self) -> None:
        self.current: Move | None = None
        self.next: Move | None = None
        """The set-point in reserve."""

    def reset(self) -> None:
        """Forget the moves."""
        self.current = self.next = None

    @property
    def last(self) -> float | None:
        """The target taken last, while it is not reached."""
        last = self.next or self.current
        return None if last is None else last.target

    def accept(self, move: Move, *, at_once: bool) -> bool:
        """Take a set-point; False where one is in reserve already."""
        if at_once or self.current is None:
            self.current, self.next = move, None
            return True
        if self.next is not None:
            return False
        self.next = move
        return True

    def step(
        self, move: Move, angle: float, speed: float, fastest: float, dt: float
    ) -> tuple[float, float]:
        """Angle and speed after ``dt`` s of the current move, no faster than ``fastest``."""
        left = move.target - angle
        # The speed from which whole steps of dt still end at the target.
        brake = move.deceleration * dt
        allowed = brake * (sqrt(0.25 + 2 * abs(left) / (brake * dt)) - 0.5)
        wanted = copysign(min(move.speed, fastest, allowed), left) if left else 0.0
        faster = abs(wanted) > abs(speed) and wanted * speed >= 0
        step = (move.acceleration if faster else move.deceleration) * dt
        speed = wanted if abs(wanted - speed) <= step else speed + copysign(step, wanted - speed)
        if abs(left) <= abs(speed) * dt and abs(speed) <= step:
            self.current, self.next = self.next, None
            return move.target, 0.0
        return angle + speed * dt, speed

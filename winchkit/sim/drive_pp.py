"""Profile position: a trapezoid to a target, with one set-point in reserve."""

from __future__ import annotations

from math import copysign, sqrt

__all__ = ["ProfilePosition"]


class ProfilePosition:
    """Set-points of the mode PP, rad."""

    def __init__(self) -> None:
        self.target: float | None = None
        """Where the move under way goes."""
        self.next: float | None = None
        """The set-point in reserve."""

    def reset(self) -> None:
        """Forget the moves."""
        self.target = self.next = None

    @property
    def last(self) -> float | None:
        """The set-point taken last, while it is not reached."""
        return self.target if self.next is None else self.next

    def accept(self, target: float, *, at_once: bool) -> bool:
        """Take a set-point; False where one is in reserve already."""
        if at_once or self.target is None:
            self.target, self.next = target, None
            return True
        if self.next is not None:
            return False
        self.next = target
        return True

    def step(
        self,
        angle: float,
        speed: float,
        fastest: float,
        rates: tuple[float, float],
        dt: float,
    ) -> tuple[float, float]:
        """Angle and speed after ``dt`` s; ``rates`` are acceleration and deceleration."""
        acceleration, deceleration = rates
        goal = angle if self.target is None else self.target
        left = goal - angle
        # The speed from which whole steps of dt still end at the target.
        brake = deceleration * dt
        allowed = brake * (sqrt(0.25 + 2 * abs(left) / (brake * dt)) - 0.5)
        wanted = copysign(min(fastest, allowed), left) if left else 0.0
        faster = abs(wanted) > abs(speed) and wanted * speed >= 0
        step = (acceleration if faster else deceleration) * dt
        speed = wanted if abs(wanted - speed) <= step else speed + copysign(step, wanted - speed)
        if abs(left) <= abs(speed) * dt and abs(speed) <= step:
            self.target, self.next = self.next, None
            return goal, 0.0
        return angle + speed * dt, speed

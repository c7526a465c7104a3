"""Time along a planned motion of a platform, the same for all of its winches."""

from __future__ import annotations

import threading

from winchkit.robot.bench.trajectory import PlatformTrajectory

_SHORTEST_STOP = 0.1
"""Time in which the platform comes to rest at least, s."""


class PathTime:
    """Time along a planned motion, the same for all winches in a cycle. It slows down in a stop:
    the platform decelerates on its path, and all cables come to rest together."""

    def __init__(self, planned: PlatformTrajectory, deceleration: float) -> None:
        """``deceleration`` of a stop, m/s^2 along the path."""
        self.duration = planned.duration
        self.stopped = False
        """Whether a stop was ordered before the end."""
        self.stop_time = 0.0
        """Of the ordered stop, s."""
        self._planned, self._deceleration = planned, deceleration
        self._cycle: float | None = None
        self.now, self.rate = 0.0, 1.0
        """Time along the motion (s), and its rate."""
        self._lock = threading.Lock()

    def at(self, time: float) -> tuple[float, float]:
        """Time along the motion (s) and its rate at the time of motion ``time`` (s); the first
        winch that asks in a cycle advances it."""
        with self._lock:
            if self._cycle is None:
                self._cycle = time
            step, self._cycle = time - self._cycle, time
            if step > 0 and self.now < self.duration:
                before = self.rate
                if self.stopped:
                    self.rate = max(0.0, before - step / self.stop_time)
                self.now = min(self.duration, self.now + step * (before + self.rate) / 2)
            return self.now, self.rate

    @property
    def ended(self) -> bool:
        """Whether the platform has come to the end, or to rest on the way."""
        return self.now >= self.duration or self.rate == 0.0

    def slow_down(self) -> None:
        """Come to rest on the path; a second order changes nothing."""
        with self._lock:
            if self.stopped or self.now >= self.duration:
                return
            if self._cycle is None:
                self.rate = 0.0  # nothing has moved yet
            speed = abs(float(self._planned.profile.at(self.now)[1]))
            self.stop_time = max(_SHORTEST_STOP, speed / self._deceleration)
            self.stopped = True

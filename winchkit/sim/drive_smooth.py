"""The set-point filter of a simulated drive: a moving average over time."""

from __future__ import annotations

from collections import deque

__all__ = ["MovingAverage"]


class MovingAverage:
    """Mean of a signal over the last ``duration`` s; without a duration the signal itself."""

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._parts: deque[tuple[float, float]] = deque()
        self._time = self._sum = 0.0

    def begin(self, value: float) -> None:
        """Start anew, as if the signal had always had this value."""
        self._parts.clear()
        self._parts.append((self._duration, value))
        self._time, self._sum = self._duration, self._duration * value

    def step(self, value: float, dt: float) -> float:
        """Mean after another ``dt`` s with this value."""
        if dt >= self._duration:
            self.begin(value)
            return value
        self._parts.append((dt, value))
        self._time += dt
        self._sum += dt * value
        while (surplus := self._time - self._duration) > 0:
            length, oldest = self._parts.popleft()
            dropped = min(length, surplus)
            self._time -= dropped
            self._sum -= dropped * oldest
            if dropped < length:
                self._parts.appendleft((length - dropped, oldest))
                break
        return self._sum / self._time

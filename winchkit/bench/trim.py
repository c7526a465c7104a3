"""Small moves at the end of a move, for what tension and past have made of the rope on the way.

The tension at the new place, the friction of a reversal, a play that was taken up are known once
the rope stands there, not when the move is planned. A correction while the rope moves would feed
the tension back to the motor, and a rope on its load would swing; at rest it only waits.
"""

from __future__ import annotations

from winchkit.bench.rope import RopeMap
from winchkit.model.trajectory import Trajectory, plan
from winchkit.schema.bench import LimitSpec

__all__ = ["Trim"]

_CALM = 0.5
"""Waited for the tension before the length is judged, s."""
_CLOSE = 1e-4
"""Of rope, within which nothing is corrected, m."""
_TRIES = 3
_MOST = 0.1
"""Of rope, beyond which the profile's effects are not to be believed, m."""
_SPEED, _ACCELERATION, _JERK = 0.05, 0.2, 1.0
"""Of a correction, m/s, m/s^2, m/s^3, where the winch's own are not lower."""


class Trim:
    """Corrects where a move to a length has ended; evaluated once a cycle."""

    def __init__(self, rope: RopeMap, length: float, limits: LimitSpec) -> None:
        """End at a cable length, m."""
        self._rope, self._length, self._limits = rope, length, limits
        self._plan: Trajectory | None = None
        self._angle = self._slope = 0.0
        self._since: float | None = None
        self._tries = 0
        self.done = False

    def at(self, time: float, angle: float) -> tuple[float, float, float]:
        """Motor angle (rad), its velocity (rad/s) and the winding speed (m/s).

        ``time`` in s, ``angle`` (rad) where the move has ended; they are evaluated once a cycle.
        """
        if self._since is None:
            self._since, self._angle = time, angle
        elapsed = time - self._since
        if self._plan is None:
            if not self.done and elapsed >= _CALM:
                self._judge(time)
            return self._angle, 0.0, 0.0
        position, speed, _ = (float(value) for value in self._plan.at(elapsed))
        if elapsed < self._plan.duration:
            return self._angle + position * self._slope, speed * self._slope, -speed
        self._angle += self._plan.distance * self._slope
        self._plan, self._since = None, time
        return self._angle, 0.0, 0.0

    def _judge(self, time: float) -> None:
        """Plan the next correction, if there is anything to correct."""
        length, arm = self._rope.at(self._angle)
        missing = self._length - length
        if not _CLOSE < abs(missing) <= _MOST or self._tries == _TRIES:
            self.done = True
            return
        self._tries += 1
        # Positive angle times arm winds in, and what is missing is to be paid out.
        self._slope, self._since = -1.0 / arm, time
        limits = self._limits
        ramp = min(_ACCELERATION, limits.acceleration)
        self._plan = plan(missing, min(_SPEED, limits.speed), ramp, _JERK)

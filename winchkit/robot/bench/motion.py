"""Motion sources of the winches of a robot: one time along the path for all of them."""

from __future__ import annotations

import threading
from collections.abc import Sequence

from winchkit.arrays import Array
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.motion import GAIN, SETTLE_TIME, SETTLED, Target
from winchkit.robot.bench.correction import CableCorrection
from winchkit.robot.bench.trajectory import PlatformTrajectory

_SHORTEST_STOP = 0.1
"""Time in which the platform comes to rest at least, s."""


class PathTime:
    """Time along a planned motion, the same for all winches in a cycle.

    A stop along the path lets it advance more and more slowly: the platform decelerates on its
    path, and all cables come to rest together.
    """

    def __init__(self, planned: PlatformTrajectory, deceleration: float) -> None:
        """``deceleration`` of a stop, m/s^2 along the path."""
        self.duration = planned.duration
        self.stopped = False
        """Whether a stop was ordered before the end."""
        self.stop_time = 0.0
        """Of the ordered stop, s."""
        self._planned, self._deceleration = planned, deceleration
        self._cycle: float | None = None
        self._now, self._rate = 0.0, 1.0
        self._lock = threading.Lock()

    def at(self, time: float) -> tuple[float, float]:
        """Time along the motion (s) and its rate at the time of motion ``time`` (s).

        The first winch that asks in a cycle advances it.
        """
        with self._lock:
            if self._cycle is None:
                self._cycle = time
            step, self._cycle = time - self._cycle, time
            if step > 0 and self._now < self.duration:
                before = self._rate
                if self.stopped:
                    self._rate = max(0.0, before - step / self.stop_time)
                self._now = min(self.duration, self._now + step * (before + self._rate) / 2)
            return self._now, self._rate

    @property
    def ended(self) -> bool:
        """Whether the platform has come to the end, or to rest on the way."""
        return self._now >= self.duration or self._rate == 0.0

    def slow_down(self) -> None:
        """Come to rest on the path; a second order changes nothing."""
        with self._lock:
            if self.stopped or self._now >= self.duration:
                return
            if self._cycle is None:
                self._rate = 0.0  # nothing has moved yet
            speed = abs(float(self._planned.profile.at(self._now)[1]))
            self.stop_time = max(_SHORTEST_STOP, speed / self._deceleration)
            self.stopped = True


class CableMotion:
    """Motor angles of one winch along the motion of the platform."""

    joins = False

    def __init__(
        self,
        clock: PathTime,
        coefficients: Array,
        step: float,
        cable: CableMap,
        *,
        holds: bool,
        trim: CableCorrection | None = None,
    ) -> None:
        """Take cubic polynomials (4, k) of the motor angle (rad), each for ``step`` (s).

        ``trim`` corrects the cable forces at the end.
        """
        self.holds = holds
        self.clock = clock
        self.trim = trim
        self._trimming = False
        self._pieces: Sequence[Sequence[float]] = coefficients.T.tolist()
        self._step = step
        self._cable = cable
        self._end: float | None = None

    def start(self, time: float, _angle: float, _winding_speed: float) -> None:
        """Begin at rest at the first angle of the plan."""
        self.clock.at(time)

    def target(self, time: float, angle: float, now: float) -> Target:
        """Angle and velocity at the present time along the motion."""
        if self._trimming and self.trim is not None:
            return self.trim.target(time, angle, now)
        along, rate = self.clock.at(time)
        planned, velocity = self._planned(along)
        ended = self.clock.ended
        velocity = 0.0 if ended else velocity * rate
        arm = self._cable.at(angle)[1]
        done = ended and self._settled(time, (planned - angle) * arm)
        if done and self.trim is not None and not self.clock.stopped:
            self._trimming = True
            self.trim.start(time, planned, 0.0)
            done = False
        return Target(velocity + GAIN * (planned - angle), planned, velocity * arm, done=done)

    def _settled(self, time: float, missing: float) -> bool:
        """Whether the winch is at the end of the motion, but for ``missing`` (m) of cable."""
        if self._end is None:
            self._end = time
        return abs(missing) <= SETTLED or time - self._end >= SETTLE_TIME

    def run_down(self) -> CableRunDown:
        """The stop of all cables along the path."""
        return CableRunDown(self)

    def _planned(self, along: float) -> tuple[float, float]:
        """Motor angle (rad) and velocity (rad/s) at a time along the motion (s)."""
        index = min(int(along / self._step), len(self._pieces) - 1)
        a, b, c, d = self._pieces[index]
        t = along - index * self._step
        return ((a * t + b) * t + c) * t + d, (3 * a * t + 2 * b) * t + c


class CableRunDown:
    """Ramp to rest of one winch on the path of the platform."""

    holds = False
    joins = True

    def __init__(self, motion: CableMotion) -> None:
        """Slow the common time down from the next cycle on."""
        self._motion = motion

    @property
    def duration(self) -> float:
        """s."""
        trim = self._motion.trim
        return max(self._motion.clock.stop_time, 0.0 if trim is None else trim.correction.duration)

    def start(self, _time: float, _angle: float, _winding_speed: float) -> None:
        """Order the stop for all winches of the robot."""
        self._motion.clock.slow_down()
        if self._motion.trim is not None:
            self._motion.trim.correction.end()

    def target(self, time: float, angle: float, now: float) -> Target:
        """As along the motion, until it rests."""
        return self._motion.target(time, angle, now)

"""Motion sources of the winches of a robot: one time along the path for all of them."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.arrays import Array
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.motion import GAIN, SETTLE_TIME, SETTLED, Setpoint
from winchkit.robot.bench.correction import CableCorrection
from winchkit.robot.bench.path_time import PathTime


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
        along: bool = False,
    ) -> None:
        """Take cubic polynomials (4, k) of the motor angle (rad), each for ``step`` (s); ``trim``
        corrects the cable forces at the end, or ``along`` the motion."""
        self.holds = holds
        self.clock = clock
        self.trim = trim
        self._trimming = self._along = trim is not None and along
        self._pieces: Sequence[Sequence[float]] = coefficients.T.tolist()
        self._step = step
        self._cable = cable
        self._end: float | None = None

    def start(self, time: float, angle: float, _winding_speed: float) -> None:
        """Begin at rest at the first angle of the plan."""
        self.clock.at(time)
        if self._along and self.trim is not None:
            self.trim.start(time, angle, 0.0)

    def target(self, time: float, angle: float, now: float) -> Setpoint:
        """Angle and velocity at the present time along the motion, with the correction."""
        along, rate = self.clock.at(time)
        planned, velocity = self._planned(along)
        ended = self.clock.ended
        velocity = 0.0 if ended else velocity * rate
        arm = self._cable.at(angle)[1]
        trim = self.trim
        if trim is not None and self._trimming:
            wound, speed = trim.at(time, now)
            planned, velocity = planned + wound / arm, velocity + speed / arm
        done = ended and self._settled(time, (planned - angle) * arm)
        if done and trim is not None:
            if not self._trimming and not self.clock.stopped:
                self._trimming = True
                trim.start(time, angle, 0.0)
            done = trim.correction.ended or not self._trimming
        return Setpoint(velocity + GAIN * (planned - angle), planned, velocity * arm, done=done)

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

    def target(self, time: float, angle: float, now: float) -> Setpoint:
        """As along the motion, until it rests."""
        return self._motion.target(time, angle, now)

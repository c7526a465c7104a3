"""Motion sources: generators of a winch's setpoints, evaluated once a cycle, without a bus.

A ``winding_speed`` is of the cable in m/s, positive winding in; angles are of the motor.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.dead_man import DeadMan
from winchkit.errors import NotPermitted
from winchkit.model.trajectory import JERK_TIME, Trajectory, plan
from winchkit.schema.bench import LimitSpec

_new = tuple.__new__
_CALM = 0.5
"""Time at rest before the length is compared with its target, s: the tension settles."""
_CLOSE = 1e-4
"""Error of the cable length below which nothing is corrected, m."""
_TRIES = 3
"""Corrections: each leaves some per cent of the error (the elongation's), so that three reach
`_CLOSE` from `_MOST`."""
_MOST = 0.1
"""Error of the cable length above which nothing is corrected, m: the profile is wrong then."""
_SPEED, _ACCELERATION, _JERK = 0.05, 0.2, 1.0
"""Limits of a correction, m/s, m/s^2, m/s^3, where those of the winch are not lower."""


class Trim:
    """Corrects where a move to a length has ended; evaluated once a cycle."""

    def __init__(self, cable: CableMap, length: float, limits: LimitSpec) -> None:
        """End at a cable length, m."""
        self._cable, self._length, self._limits = cable, length, limits
        self._plan: Trajectory | None = None
        self._angle = self._slope = 0.0
        self._since: float | None = None
        self._tries = 0
        self.done = False

    def at(self, time: float, angle: float) -> tuple[float, float, float]:
        """Motor angle (rad), its velocity (rad/s) and the winding speed (m/s), once a cycle."""
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
        length, arm = self._cable.at(self._angle)
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


GAIN = 8.0
"""Gain of the position loop around a speed-controlled drive, 1/s."""
_MARGIN = 2e-3
"""Distance of the cable length that is kept from a limit, m."""
SETTLED = 1e-4
"""Error of the cable length at which a move counts as done, m."""
SETTLE_TIME = 1.0
"""A move counts as done this long after its end at the latest, s."""


class Setpoint(NamedTuple):
    """Setpoint of a drive in one cycle."""

    velocity: float
    """Of the motor, rad/s."""
    angle: float | None
    """Of the motor, for a position-controlled drive, rad."""
    winding_speed: float
    """Of the cable, m/s, positive winding in."""
    done: bool = False
    start: bool = False
    """Whether the drive is to make a motion of its own, a homing."""


class MotionSource(Protocol):
    """Generator of the setpoint of each cycle, until one is ``done``."""

    holds: bool
    """Whether the winch stays enabled, holding its place, after the source is done."""
    joins: bool
    """Whether it can take over a cable that moves."""

    def start(self, time: float, angle: float, winding_speed: float) -> None:
        """Begin at a motor angle (rad) and a winding speed (m/s)."""

    def target(self, time: float, angle: float, now: float) -> Setpoint:
        """Target at ``time`` (s), the motor being at ``angle`` (rad).

        Time of motion advances by whole periods of control, those in which no cycle began included
        (of drives that follow positions: left out, since they waited); ``now`` (s) is the true
        time, for whatever expires.
        """


class Stop(MotionSource, Protocol):
    """A motion source that ends at rest."""

    @property
    def duration(self) -> float:
        """Time to rest, s; known once started."""


@runtime_checkable
class PathStop(Protocol):
    """A motion source with a ramp to rest of its own, on the path that it shares with others."""

    def run_down(self) -> Stop:
        """Ramp to rest from the present motion."""


@runtime_checkable
class Held(Protocol):
    """A motion source that goes on for as long as its commander refreshes the permission."""

    dead_man: DeadMan


class Ramp:
    """Speed of the cable that follows a commanded one with limited acceleration."""

    def __init__(self, acceleration: float, speed: float = 0.0) -> None:
        self.speed = speed
        self._acceleration = acceleration
        self._time: float | None = None

    def follow(self, requested: float, time: float) -> float:
        """Speed at ``time``; the first call starts the clock."""
        before, self._time = self._time, time
        missing = requested - self.speed
        if missing and before is not None:
            step = (time - before) * self._acceleration
            self.speed += max(-step, min(step, missing))
        return self.speed


class Jog:
    """Moves at a commanded speed that must be renewed; ramps to rest once it has expired."""

    holds = False
    joins = True

    def __init__(
        self, cable: CableMap, limits: LimitSpec, winding_speed: float, dead_man: DeadMan
    ) -> None:
        self.dead_man = dead_man
        self._cable, self._limits = cable, limits
        self._ramp = Ramp(limits.acceleration)
        self._angle = self._last = 0.0
        self.request(winding_speed)

    def request(self, winding_speed: float) -> None:
        """Go at ``winding_speed`` (m/s) for as long as the dead-man permits."""
        self.requested = max(-self._limits.speed, min(self._limits.speed, winding_speed))

    def start(self, time: float, angle: float, winding_speed: float) -> None:
        """Begin with the speed that the cable has."""
        self._ramp = Ramp(self._limits.acceleration, winding_speed)
        self._angle, self._last = angle, time

    def target(self, time: float, angle: float, now: float) -> Setpoint:
        """Follow the commanded speed, slow down before a length limit, end at rest once expired."""
        live = self.dead_man.live(now)
        length, arm = self._cable.at(angle)
        requested = self._within(self.requested, length) if live else 0.0
        speed = self._ramp.follow(requested, time)
        velocity = speed / arm
        self._angle += velocity * (time - self._last)
        self._last = time
        # What Target(...) makes, without the call of its constructor.
        return _new(Setpoint, (velocity, self._angle, speed, not live and speed == 0.0, False))

    def _within(self, requested: float, length: float) -> float:
        """Commanded speed, limited to the one from which the winch stops before a length limit."""
        if self._limits.length is None:
            return requested
        low, high = self._limits.length
        room = (length - low if requested > 0 else high - length) - _MARGIN
        fastest = fastest_within(room, self._limits)
        return math.copysign(fastest, requested) if fastest < abs(requested) else requested


def fastest_within(room: float, limits: LimitSpec) -> float:
    """Largest speed (m/s) from which a winch, with its response time, stops within the room (m)."""
    lag = limits.acceleration * limits.response_time
    return math.sqrt(lag * lag + 2 * limits.acceleration * max(0.0, room)) - lag


class RunDown:
    """From a speed to rest with the winch's acceleration."""

    holds = False
    joins = True

    def __init__(self, cable: CableMap, limits: LimitSpec) -> None:
        self.duration = 0.0
        """Time to rest, s; known once started."""
        self._cable, self._acceleration = cable, limits.acceleration
        self._ramp = Ramp(self._acceleration)
        self._angle = self._last = 0.0

    def start(self, time: float, angle: float, winding_speed: float) -> None:
        """Begin from the target angle and the speed that were in force."""
        self._ramp = Ramp(self._acceleration, winding_speed)
        self._ramp.follow(0.0, time)
        self.duration = abs(winding_speed) / self._acceleration
        self._angle, self._last = angle, time

    def target(self, time: float, angle: float, _now: float) -> Setpoint:
        """Setpoint with the speed reduced by one cycle's deceleration."""
        before, speed = self._ramp.speed, self._ramp.follow(0.0, time)
        arm = self._cable.at(angle)[1]
        self._angle += (before + speed) / 2 / arm * (time - self._last)
        self._last = time
        return Setpoint(speed / arm, self._angle, speed, done=speed == 0.0)


class PlannedMove:
    """A planned S-curve to a cable length; holds there when asked to."""

    joins = False

    def __init__(
        self,
        line: CableMap,
        limits: LimitSpec,
        length: float,
        *,
        speed: float | None = None,
        acceleration: float | None = None,
        holds: bool = False,
        trim: Trim | None = None,
    ) -> None:
        """Raise NotPermitted beyond the winch's limits; ``trim`` corrects the end."""
        self.holds = holds
        self._trim = trim
        self.length = length
        self._line = line
        self._limits = limits
        self._speed, self._acceleration = within_limits(limits, length, speed, acceleration)
        self._start = 0.0
        self._from = length
        self._knots: list[float] = []
        self._stretched = 0.0
        self._ended = False

    def prepare(self, angle: float) -> None:
        """Plan from a motor angle (rad); called off the control thread, before ``start``."""
        self._from = self._line.cable_length(angle)
        jerk = self._acceleration / JERK_TIME
        self._plan = plan(self.length - self._from, self._speed, self._acceleration, jerk)
        count = max(2, math.ceil(abs(self.length - self._from) / 0.02) + 1)
        step = (self.length - self._from) / (count - 1)
        self._knots = [self._line.motor_angle(self._from + k * step) for k in range(count)]

    @property
    def duration(self) -> float:
        """Time of the planned move, s; known once prepared."""
        return max(self._plan.duration, self._stretched)

    def stretch(self, duration: float) -> None:
        """Extend the move to ``duration`` (s) where it is shorter, at lower speeds."""
        self._stretched = duration

    def start(self, time: float, angle: float, _winding_speed: float) -> None:
        """Begin at rest; plans anew where the winch has moved since ``prepare``."""
        if not self._knots or abs(self._knots[0] - angle) > 0.5:
            self.prepare(angle)
        self._start = time

    def target(self, time: float, angle: float, _now: float) -> Setpoint:
        """Setpoint of the planned move, with the position loop's correction for speed control."""
        if self._trim is not None and self._ended:
            return self._trimmed(self._trim, time, angle)
        elapsed = time - self._start
        pace = self._plan.duration / self.duration if self._stretched else 1.0
        position, speed, _ = (float(value) for value in self._plan.at(elapsed * pace))
        speed *= pace
        planned, slope = self._angle_at(position)
        velocity = speed * slope + GAIN * (planned - angle)
        late = elapsed - self.duration
        arrived = late >= 0 and abs(planned - angle) <= SETTLED * abs(slope)
        self._ended = arrived or late >= SETTLE_TIME
        done = self._ended and self._trim is None
        return Setpoint(velocity, planned, -speed, done=done)

    def _trimmed(self, trim: Trim, time: float, angle: float) -> Setpoint:
        """Setpoint of the correction that follows the planned move."""
        planned, velocity, speed = trim.at(time, self._knots[-1])
        return Setpoint(velocity + GAIN * (planned - angle), planned, speed, done=trim.done)

    def _angle_at(self, position: float) -> tuple[float, float]:
        """Motor angle at a distance from the start, and its derivative by that distance."""
        knots = self._knots
        span = self._plan.distance / (len(knots) - 1)
        if span == 0.0:
            return knots[-1], 0.0
        index = min(int(position / span), len(knots) - 2)
        slope = (knots[index + 1] - knots[index]) / span
        return knots[index] + slope * (position - index * span), slope


def commanded_and_moved(asked: float, moved: float) -> str:
    """What was commanded, and what the motor moved (m of cable, positive wound in), in words."""
    way = "wind in" if asked > 0 else "pay out"
    made = round(math.copysign(1.0, asked) * moved, 3) + 0.0
    return f"it was commanded to {way} {abs(asked):.3f} m and moved {made:.3f} m"


def within_limits(
    limits: LimitSpec, length: float, speed: float | None, acceleration: float | None
) -> tuple[float, float]:
    """Speed (m/s) and acceleration (m/s²) of a move to a length (m), by default the limits."""
    fast = _within("speed", speed, limits.speed, "m/s")
    ramp = _within("acceleration", acceleration, limits.acceleration, "m/s^2")
    if limits.length is not None and not limits.length[0] <= length <= limits.length[1]:
        raise NotPermitted(
            f"a cable length of {length:g} m is beyond the limits {limits.length[0]:g} m to "
            f"{limits.length[1]:g} m; change its limits.length only if the cable allows it"
        )
    if not math.isfinite(length):
        raise NotPermitted("a cable length must be a finite number of metres")
    return fast, ramp


def _within(name: str, asked: float | None, limit: float, unit: str) -> float:
    """The asked value, or the limit; raises NotPermitted beyond it."""
    if asked is None:
        return limit
    if not 0 < asked <= limit:
        raise NotPermitted(
            f"{name} {asked:g} {unit} is not within the winch's limit of {limit:g} {unit}"
        )
    return asked


class StartGate:
    """Opens for all members at once, in the first cycle in which each of them is ready."""

    def __init__(self, ready: Sequence[Callable[[], bool]]) -> None:
        self._ready = ready
        self._asked = -math.inf
        self._open = False

    def open(self, time: float) -> bool:
        """Whether to start in the cycle of this time of motion (s)."""
        # Feedback keeps coming in within a cycle: all members get the answer of the first.
        if not self._open and time != self._asked:
            self._asked = time
            self._open = all(ready() for ready in self._ready)
        return self._open

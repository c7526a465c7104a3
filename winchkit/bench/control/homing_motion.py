"""The motion of a homing, made by the drive itself, as the control loop sees it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from winchkit.arguments import number
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.motion import Setpoint
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.modes import HomingState

_SETTLE = 0.06
"""For which bits of an earlier homing may still stand, s."""
_JUMP = 1.0
"""A change of the motor angle in one cycle that is no motion but a new zero, rad."""


@dataclass(frozen=True)
class HomingRequest:
    """Request for a homing."""

    method: int | None = None
    """6098h; None searches nothing."""
    at: float | None = None
    """Cable length (m) at the zero to be found; at the present place without a search."""
    speed: float | None = None
    """Of the cable while searching, m/s."""

    def __post_init__(self) -> None:
        """Raise UsageError for what is no number."""
        for name in ("method", "at", "speed"):
            value = getattr(self, name)
            if value is not None:
                number("home", name, value)


class HomingMotion:
    """A motion that the drive makes itself; says how fast the cable goes, for supervision."""

    holds = False
    joins = False

    def __init__(self, axis: Cia402Axis, cable: CableMap, farthest: float = math.inf) -> None:
        """Give up once ``farthest`` (m) of cable have run in the search."""
        self.failure = ""
        """Why it found nothing, in words."""
        self._axis, self._cable, self._left = axis, cable, farthest
        self._begun = self._time = self._angle = math.nan

    def start(self, time: float, angle: float, _winding_speed: float) -> None:
        """Begin; the drive is enabled in the mode HM."""
        self._begun = self._time = time
        self._angle = angle

    def target(self, time: float, angle: float, _now: float) -> Setpoint:
        """Keep bit 4 set until the drive says that it is over."""
        step, change = time - self._time, angle - self._angle
        self._time, self._angle = time, angle
        moves = step > 0 and abs(change) < _JUMP
        speed = change / step * self._cable.at(angle)[1] if moves else 0.0
        self._left -= abs(speed) * step
        state = self._axis.homing
        over = time - self._begun >= _SETTLE and state.over
        if over and state is not HomingState.DONE:
            self.failure = "the drive says that it failed"
        elif not over and self._left < 0:
            self.failure = "no zero was found on twice the way between limits.length"
        return Setpoint(0.0, None, speed, done=over or bool(self.failure), start=True)

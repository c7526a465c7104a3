"""Compares the change of 6064h with the integral of 606Ch: two measurements of one motion.

A counter that stands still, is set, or belongs to a broken coupling no longer changes by what the
motor turns, nor does a counter in other units than declared. Where the drive derives 606Ch from
6064h itself, both are wrong alike, and only their units are compared.

Two windows: a short one for jumps and for fast motion, and a long one, which sees slow motion,
whose way within the short one is too short. The tolerance is that of the measurement of speed:

- a share of the way (a rounded scale, a ratio);
- one step of 606Ch for the length of the window (a speed that is rounded down). The step is the
  smallest change of 606Ch so far, since a drive may round more coarsely than its unit, and before
  its first change a hundredth of the greatest speed;
- the response time times the range of the speeds in the window: a filter of first order with a
  time constant T makes the integral late by exactly T times the change of its output;
- what an acceleration within the response time turns before a late 606Ch shows any of it;
- what may have been turned otherwise within a gap without feedback.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import inf, isfinite, tau
from typing import NamedTuple

_SHORT, _LONG = 0.25, 4.0
"""Windows, s. With one of 4 s a tenth of a short one's speed is compared; a longer one would delay
what it finds by more cable than it finds earlier."""
_EVERY = 0.1
"""Between two comparisons over the long window, s: 40 of them are kept."""
_SHARE = 0.05
"""Of the way: declared scales differ by factors that a wrong gear or encoder makes."""
_STEPS = 2
"""Counts of 6064h by which the ends of a window are rounded."""
_COARSEST = 0.01
"""Share of the greatest speed: no drive that follows a speed measures it more coarsely."""
_GAP = 3.0
"""Cycles without feedback that are a gap: within it the speed may have gone straight from one value
to the other, or up and down by the acceleration."""
_SHORTEST_GAP = 0.05
"""The same at least, s: what is turned otherwise within less is less than a late 606Ch explains."""
_new = tuple.__new__


class Disagreement(NamedTuple):
    """What the two said; rad, s."""

    turned: float
    """By 6064h."""
    integral: float
    """By 606Ch."""
    span: float

    def __str__(self) -> str:
        return (
            f"6064h changed by {self.turned / tau:.3f} turns of the motor within {self.span:.2g} "
            f"s, by 606Ch it turned {self.integral / tau:.3f}"
        )


class _WindowPoint(NamedTuple):
    """Of a window; SI."""

    time: float
    angle: float
    """By 6064h."""
    integral: float
    """Of 606Ch."""
    slack: float
    """Sum of what the integral may be wrong by."""
    velocity: float


_NOTHING = _WindowPoint(-inf, 0.0, 0.0, 0.0, 0.0)


@dataclass(slots=True)
class _Tolerance:
    """SI at the motor shaft."""

    constant: float
    """rad."""
    step: float
    """Of 606Ch, rad/s."""
    response: float
    """s."""


class _Window:
    """The points of the last ``span`` (s), at least ``every`` (s) apart."""

    __slots__ = ("_every", "_next", "_since", "_span", "points")

    def __init__(self, span: float, every: float) -> None:
        self._span, self._every = span, every
        self.points: deque[_WindowPoint] = deque()
        self._next, self._since = -inf, inf

    def take(self, point: _WindowPoint, tolerance: _Tolerance) -> bool:
        """Take a point; whether the two have been apart for longer than one can be late."""
        time, angle, integral, slack, _ = point
        if time < self._next:
            return False
        self._next = time + self._every
        points = self.points
        points.append(point)
        oldest = time - self._span
        while points[0][0] < oldest:
            points.popleft()
        begun, angle_then, integral_then, slack_then, _ = points[0]
        excess = abs((angle - angle_then) - (integral - integral_then)) - (
            tolerance.constant + tolerance.step * (time - begun) + slack - slack_then
        )
        if excess > 0:
            speeds = [one.velocity for one in points]
            excess -= tolerance.response * (max(speeds) - min(speeds))
        if not excess > 0:
            self._since = inf
            return False
        if time < self._since:
            self._since = time
            return False
        # A late speed is over after a response time; a jump stays in the window for twice that.
        return time - self._since >= min(tolerance.response, self._span / 2)


class PositionAgreement:
    """The comparison for one drive; SI at the motor shaft."""

    __slots__ = (
        "_active", "_finest", "_gap", "_last", "_long", "_quarter", "_short", "_smallest",
        "_tolerance", "found",
    )  # fmt: skip

    def __init__(
        self,
        angle_step: float = 0.0,
        velocity_step: float = 0.0,
        response: float = 0.0,
        late: float = 0.0,
        fastest: float = 0.0,
        *,
        cycle: float = 0.0,
    ) -> None:
        """Take a count of 6064h (rad) and 606Ch (rad/s), the response time (s), what the motor
        turns from rest within that (rad), its greatest speed (rad/s), and the time between two
        feedbacks (s). Without a response time nothing is compared.
        """
        step = max(velocity_step, _COARSEST * fastest)
        self._tolerance = _Tolerance(_STEPS * angle_step + late, step, response)
        self._finest, self._smallest = velocity_step, inf
        self._quarter = late / (2 * response**2) if response > 0 else 0.0
        """Of the acceleration, rad/s^2: a v-t triangle of length t has the area a t^2 / 4."""
        self._gap = max(_SHORTEST_GAP, _GAP * cycle)
        self._active = response > 0
        self.found: Disagreement | None = None
        """The first disagreement since the last :meth:`forget`."""
        self.restart()

    def restart(self) -> None:
        """Begin anew: what was before does not count."""
        self._last = _NOTHING
        self._short, self._long = _Window(_SHORT, 0.0), _Window(_LONG, _EVERY)

    def suspend(self) -> None:
        """Compare nothing: while a drive homes, its position jumps to the new zero."""
        self._active = False

    def resume(self) -> None:
        """Compare again."""
        self._active = self._tolerance.response > 0
        self.restart()

    def forget(self) -> None:
        """A reset has shown what was found."""
        self.found = None
        self.restart()

    def take(self, time: float, angle: float, velocity: float) -> bool:
        """Take a feedback (s, rad, rad/s); whether the two disagree by now."""
        if not self._active:
            return False
        then, _, integral, slack, before = self._last
        span = time - then
        turned = (velocity + before) / 2 * span
        if span < 0 or not isfinite(turned):
            self.restart()
            self._last = _WindowPoint(time, angle, 0.0, 0.0, velocity)
            return self.found is not None
        slack += _SHARE * abs(turned)
        if span > self._gap:
            slack += (abs(velocity - before) / 2 + self._quarter * span) * span
        self._last = point = _new(_WindowPoint, (time, angle, integral + turned, slack, velocity))
        if velocity != before:
            self._learn_step(abs(velocity - before))
        for window in (self._short, self._long):
            if window.take(point, self._tolerance) and self.found is None:
                begun = window.points[0]
                self.found = Disagreement(
                    angle - begun.angle, point.integral - begun.integral, time - begun.time
                )
        return self.found is not None

    def _learn_step(self, change: float) -> None:
        """A change of 606Ch shows how finely it is rounded."""
        if change < self._smallest:
            self._smallest, self._tolerance.step = change, max(change, self._finest)

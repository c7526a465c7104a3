"""What the supervisor compares: observations of a cycle, and what it remembers of earlier ones."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from operator import itemgetter
from types import MappingProxyType
from typing import NamedTuple

from winchkit.schema.bench import LimitSpec

__all__ = ["FACTS", "Instrumented", "Memory", "Supervised", "WinchInput", "facts_of"]

_RATE_TIME = 0.05
"""Shortest span over which a change of tension counts, s."""
_LEAST_CYCLES = 6
"""A drive acts on a synchronous target at the next SYNC and shows it at the one after."""
_RIPPLE = 0.01
"""Share of limits.speed: within the ripple of a velocity loop."""
_OVERSHOOT = 0.05
"""Share of the commanded speed: of a velocity loop after an acceleration."""
_STEPS, _REST_STEPS = 4, 3
"""Resolution steps of 606Ch below which a difference, or a speed at rest, is noise."""


class Instrumented(NamedTuple):
    """Newest reading of a sensor as the supervisor needs it; the same until another one comes."""

    value: float
    """SI; NaN where the device flags it."""
    since: float
    """When its age begins to count, s: when it was received, or when this computer went on after
    a standstill; minus infinity before the first."""
    max_age: float
    """s."""
    quality: str
    time: float
    """Of the sample, s."""
    problem: str = ""
    """Why nothing comes, in words."""
    gross: float = math.nan
    """Before any tare."""
    received: float = -math.inf
    """When it came, s."""


class WinchInput(NamedTuple):
    """What is known of one winch in this cycle; SI.

    A named tuple, since one is made of every winch in every cycle: a frozen dataclass takes
    several times as long to make.
    """

    feedback_age: float
    """Since the SYNC of the newest complete feedback, s; infinity before the first."""
    missed_syncs: int
    """SYNCs that were sent since then and are not answered, the one just sent left out."""
    heartbeat_lost: bool
    boot_ups: int
    operational: bool
    mode_kept: bool
    fault: str
    """The drive's fault in words; empty while it has none."""
    winding_speed: float
    """Actual winding speed of the cable by the motor, positive winds in, m/s."""
    commanded: float
    """Commanded winding speed, m/s."""
    cable_length: float
    moving: bool
    """Whether the drive is or is being enabled."""
    tension: Instrumented | None = None
    nmt: str = ""
    """NMT state in words, where it is not operational."""
    uncommanded: str = ""
    """What the drive did to its power state that no control word asked for."""
    second_master: str = ""
    """A command to its drive that was not sent here; empty while there is none."""
    disabled: bool = False
    """Whether the winch is commanded to be disabled, and was at rest when that began."""
    follows: bool = False
    """Whether the drive is to follow the commanded speed or position in this cycle."""
    target_speed: float = math.nan
    """Winding speed of the velocity target that was sent last, m/s; NaN in a position mode."""
    following_error: float = 0.0
    """Target less actual position in cable, of a position-controlled drive, m."""
    length: float = math.nan
    """Reading of the length instrument, m."""
    emergencies: tuple[int, ...] = ()
    """Emergency codes in force without a fault."""
    emergency_text: str = ""
    unstable: str = ""
    """What makes the load cell's readings at rest unsteady; empty while nothing does."""
    frozen: str = ""
    """What shows that the load cell is frozen; empty while nothing does."""
    turns_known: bool = True
    """Whether the motor angle counts every turn; if not, the cable length is NaN."""
    sensors: Mapping[str, Instrumented] = MappingProxyType({})
    """Newest reading of each instrument by its role; ``tension`` is that of the cell."""
    now: float = 0.0
    """Time of the cycle, s."""


FACTS = (
    "second_master",
    "heartbeat_lost",
    "boot_ups",
    "operational",
    "mode_kept",
    "fault",
    "uncommanded",
    "emergencies",
    "unstable",
    "frozen",
    "turns_known",
)
"""What of a :class:`WinchInput` is no measured number and seldom changes."""
facts_of = itemgetter(*map(WinchInput._fields.index, FACTS))


@dataclass(frozen=True)
class Supervised:
    """What one winch is held to."""

    limits: LimitSpec
    stale: float
    """Feedback older than this that has also missed several SYNCs is stale, s."""
    cycle: float = 0.004
    """Period of control, s."""
    resolution: float = 0.0
    """Of the measured cable speed (606Ch), m/s."""
    safe_length: float = math.inf
    """Cable length at which the last two dead wraps are left on the drum, m."""

    @cached_property
    def shortest(self) -> float:
        """Lower length limit, m."""
        return -math.inf if self.limits.length is None else self.limits.length[0]

    @cached_property
    def longest(self) -> float:
        """Upper length limit, m."""
        return math.inf if self.limits.length is None else self.limits.length[1]

    @cached_property
    def rest_speed(self) -> float:
        """Cable speed above which a motor does not rest, m/s."""
        return max(_REST_STEPS * self.resolution, _RIPPLE * self.limits.speed)

    @cached_property
    def ripple(self) -> float:
        """Cable speed within which a velocity loop follows at the least, m/s."""
        return max(_STEPS * self.resolution, _RIPPLE * self.limits.speed)

    @cached_property
    def response_cycles(self) -> int:
        """Cycles within which the measured speed follows."""
        return max(_LEAST_CYCLES, round(self.limits.response_time / self.cycle))

    def trips_on(self, code: int) -> bool:
        """Whether the bench file declares that this emergency code trips."""
        text = f"{code:04x}"
        declared = {item.lower() for item in self.limits.emergency_trips}
        return bool(declared & {text, f"{text[:2]}xx"})


@dataclass
class Memory:
    """What the supervisor remembers of one winch."""

    own: Supervised
    boot_ups: float = math.nan
    """Dealt with so far; unknown before the first observation."""
    since: dict[str, float] = field(default_factory=dict)
    """When a condition that is debounced began to hold, s."""
    gross: float = math.nan
    """Tension of the cable, N; NaN where the cell's newest reading is no number that counts.

    A tare neither hides an overload nor makes the cable slack."""
    tension_rate: float = 0.0
    """N/s, over at least 50 ms."""
    unresponsive: bool = False
    """Whether the drive did not slow down as it was commanded."""
    slip: float = 0.0
    """Change of the length sensor less that by the motor since the motion began, m."""
    moved: float = 0.0
    """Cable that ran since then, m."""
    quiet: object = None
    """The facts under which no condition on facts held when they were tested last."""
    _tension: tuple[float, float] | None = None
    _track: deque[float] = field(default_factory=deque)
    _began: tuple[float, float] | None = None
    _last: float = math.nan

    def observe(self, item: WinchInput) -> None:
        """Take the observations of a cycle."""
        if math.isnan(self.boot_ups):
            self.boot_ups = item.boot_ups
        cell = item.tension
        if cell is None:
            self.gross = math.nan
        else:
            value, gross = cell.value, cell.gross
            counts = item.now - cell.since <= cell.max_age and not math.isnan(value)
            self.gross = (gross if math.isfinite(gross) else value) if counts else math.nan
            if cell.time == cell.time:
                self._follow_tension(cell)
        self._follow_slowing(item)
        if item.length == item.length:
            self._follow_length(item)

    def _follow_tension(self, cell: Instrumented) -> None:
        before = self._tension
        if before is None:
            self._tension = (cell.time, cell.value)
            return
        span = cell.time - before[0]
        if span >= _RATE_TIME:
            self.tension_rate = (cell.value - before[1]) / span
            self._tension = (cell.time, cell.value)

    def _follow_slowing(self, item: WinchInput) -> None:
        """While the commanded speed falls, compare with the fastest commanded of a response time.

        A lag of first order with a time constant T follows a ramp T later, and its end by
        exp(-t/T): with T below half the response time it is never faster than that, while a drive
        whose targets do not reach it keeps its speed, and soon is.
        """
        self.unresponsive = False
        target, track, own = item.target_speed, self._track, self.own
        if math.isnan(target):
            if track:
                track.clear()
            return
        track.append(target)
        if len(track) <= own.response_cycles:
            return
        track.popleft()
        speed = item.winding_speed
        excess = speed - target if speed > 0 else target - speed
        if excess <= own.ripple:
            return  # not faster than commanded now, and so not than any of the window
        sign = math.copysign(1.0, speed)
        fastest = max(track) if sign > 0 else -min(track)
        if sign * target >= fastest:
            return
        margin = max(own.ripple, _OVERSHOOT * fastest)
        self.unresponsive = sign * speed > max(0.0, fastest) + margin

    def _follow_length(self, item: WinchInput) -> None:
        if not item.moving or self._began is None:
            self._began, self.slip, self.moved = (item.length, item.cable_length), 0.0, 0.0
            self._last = item.cable_length
            return
        length, cable = self._began
        self.moved += abs(item.cable_length - self._last)
        self._last = item.cable_length
        self.slip = (item.length - length) - (item.cable_length - cable)

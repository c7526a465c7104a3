"""Quantities of the supervisor: measurements of a cycle and states derived from earlier ones."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite, isnan
from operator import itemgetter
from types import MappingProxyType
from typing import NamedTuple

from winchkit.drivers.can.cia402.feedback import AxisFeedback
from winchkit.schema.bench import LimitSpec

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
_MISSED_SYNCS = 5
"""A late cycle of the host makes feedback old; a drive that is silent also misses SYNCs."""
_MISSING = 0.02
"""Commanded cable that a motor has to move half of, m: a brake that opens, a position loop that
catches up, and friction at the lowest speeds are below."""
_SLIP = 0.05
"""Least tolerance of the cable slip, m, and ..."""
_SLIP_SHARE = 0.05
"""... share of the moved length: a length sensor's filter and a profile's error are below."""


_RUN_TIME, _RUN_WAY = 0.05, 2e-3
"""A motion is one in a direction when it has gone on for so long (s) and so far (m): an elastic
load that bounces turns the motor back for less."""


class Instrumented(NamedTuple):
    """Newest reading of a sensor; the same object until the next one."""

    value: float
    """SI; NaN where the device flags it."""
    since: float
    """Time from which its age counts, s: when it was received, or when this computer went on after
    a standstill; minus infinity before the first."""
    max_age: float
    """s."""
    quality: str
    time: float
    """Time of the sample, s."""
    problem: str = ""
    """Fault that prevents new readings, in words; empty without one."""
    gross: float = math.nan
    """Gross value, without tare."""
    received: float = -math.inf
    """Time of reception, s."""


class WinchInput(NamedTuple):
    """Measurements and states of one winch in a cycle, SI; a named tuple is made the fastest."""

    feedback_age: float
    """Since the SYNC of the newest complete feedback, s; infinity before the first."""
    missed_syncs: int
    """SYNCs that were sent since then and are not answered, the one just sent left out."""
    heartbeat_lost: str
    """What is missing of the drive's heartbeat or its replies to node guarding, in words; empty
    while it is in time."""
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
    """Change of the power state that no control word requested."""
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
    way: tuple[float, float] = (0.0, 0.0)
    """Cable commanded and moved since the motion began, or rest did, m, positive wound in."""
    length: float = math.nan
    """Reading of the length instrument, m."""
    emergencies: tuple[int, ...] = ()
    """Emergency codes in force without a fault."""
    emergency_text: str = ""
    unstable: str = ""
    """Finding that the load cell's readings at rest are unsteady; empty without one."""
    frozen: str = ""
    """Evidence that the load cell is frozen; empty without it."""
    length_doubt: str = ""
    """Why the cable length is not known, and NaN, in words; empty where it is."""
    position_jump: str = ""
    """Change of 6064h that no motion explains, in words; empty without one."""
    position_disagreement: str = ""
    """Change of 6064h that 606Ch contradicts, in words; empty without one."""
    sensors: Mapping[str, Instrumented] = MappingProxyType({})
    """Newest reading of each instrument by its role; ``tension`` is that of the cell."""
    now: float = 0.0
    """Time of the cycle, s."""
    feedback: AxisFeedback | None = None
    """Newest feedback of the drive, from which the above is."""


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
    "length_doubt",
    "position_jump",
    "position_disagreement",
)
"""What of a :class:`WinchInput` is no measured number and seldom changes."""
facts_of = itemgetter(*map(WinchInput._fields.index, FACTS))


class Quantities(NamedTuple):
    """Quantities with upper bounds; NaN exceeds no bound; SI."""

    unanswered: float = 0.0
    """Age of the feedback, s; zero while fewer than 5 SYNCs are unanswered."""
    speed: float = 0.0
    """Size of the cable speed by the motor, m/s."""
    unresponsive: float = 0.0
    """1 where the drive did not slow down as it was commanded, else 0."""
    deviation: float = 0.0
    """Size of the difference of measured and commanded speed, m/s."""
    runaway: float = 0.0
    """Excess of the speed over the commanded one, or speed against its direction, m/s."""
    following_error: float = 0.0
    """Absolute following error, m."""
    missing: float = 0.0
    """Excess of the commanded cable over the moved one beyond what a drive may be late, m."""
    crept: float = 0.0
    """Cable moved by the motor since the motion or rest began, either way, m."""
    paid_out: float = 0.0
    """Cable length, m."""
    wound_in: float = 0.0
    """Negative cable length, m."""
    slip: float = 0.0
    """Excess of the cable slip over the tolerance of sensor and profile, m."""
    expired: float = 0.0
    """Age of the cell's reading beyond its longest age, s."""
    unreadable: float = 0.0
    """1 where the cell's reading is in time and no number, else 0."""
    tension: float = 0.0
    """Tension of the cable, N."""
    slackness: float = 0.0
    """Negative tension, N."""
    tension_rate: float = 0.0
    """Size of the change of the tension, N/s."""


_NOTHING: tuple[float, ...] = Quantities()


@dataclass(frozen=True)
class Supervised:
    """Bounds of one winch."""

    limits: LimitSpec
    stale: float
    """Feedback older than this that has also missed several SYNCs is stale, s."""
    cycle: float = 0.004
    """Period of control, s."""
    resolution: float = 0.0
    """Resolution of the measured cable speed (606Ch), m/s."""
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
class SupervisorMemory:
    """State of the supervisor for one winch."""

    own: Supervised
    boot_ups: float = math.nan
    """Dealt with so far; unknown before the first observation."""
    since: dict[str, float] = field(default_factory=dict)
    """Start of each condition that is being debounced, s."""
    gross: float = math.nan
    """Tension of the cable, N; NaN where the cell's newest reading is no number that counts.

    A tare neither hides an overload nor makes the cable slack."""
    tension_rate: float = 0.0
    """N/s, over at least 50 ms."""
    unresponsive: bool = False
    """Whether the drive did not slow down as it was commanded."""
    reversed: bool = False
    """Of an unresponsive drive: whether it turns the other way than it was ever commanded."""
    slip: float = 0.0
    """Change of the length sensor less that by the motor since the motion began, m."""
    moved: float = 0.0
    """Path of the cable since then, m."""
    run: float = 0.0
    """Cable wound in since the motor last turned the other way, m; negative paid out."""
    quantities: tuple[float, ...] = _NOTHING
    """Quantities of the newest observations: a plain tuple in the order of :class:`Quantities`,
    which takes less time to make."""
    quiet: object = None
    """The facts under which no condition on facts held when they were tested last."""
    _cell: Instrumented | None = None
    _tension: tuple[float, float] | None = None
    _track: deque[float] = field(default_factory=deque)
    _began: tuple[float, float] | None = None
    _last: float = math.nan
    _observed: float = math.nan
    _turned: float = math.nan
    """When the motor began to turn this way, s."""
    _ran: float = math.nan
    """When it last did, s."""

    def observe(self, item: WinchInput) -> None:
        """Take the observations of a cycle."""
        if isnan(self.boot_ups):
            self.boot_ups = item.boot_ups
        cell, expired, unreadable = item.tension, 0.0, False
        gross = rate = math.nan
        if cell is not None:
            if cell is not self._cell:
                # The reading that it has taken already leads to the same rate again.
                self._cell = cell
                if not isnan(cell.time):
                    self._follow_tension(cell)
            value, since, max_age, _, _, _, total, _ = cell
            age, number = item.now - since, not isnan(value)
            expired, in_time = age - max_age, age <= max_age
            if number and in_time:
                gross = total if isfinite(total) else value
                rate = abs(self.tension_rate)
            else:
                unreadable = in_time
        self.gross = gross
        speed, commanded, length = item.winding_speed, item.commanded, item.cable_length
        self._follow_slowing(item.target_speed, speed)
        self._follow_direction(item.now, speed)
        if item.length == item.length:
            self._follow_length(item)
        size = abs(speed)
        asked, moved = item.way
        self.quantities = (
            item.feedback_age if item.missed_syncs >= _MISSED_SYNCS else 0.0,
            size,
            self.unresponsive,
            abs(speed - commanded),
            size if speed * commanded < 0 else size - abs(commanded),
            abs(item.following_error),
            abs(asked - moved)
            - max(_MISSING, abs(asked) / 2)
            - self.own.limits.response_time * abs(commanded),
            abs(moved),
            length,
            -length,
            abs(self.slip) - (_SLIP + _SLIP_SHARE * self.moved),
            expired,
            unreadable,
            gross,
            -gross,
            rate,
        )

    @property
    def winds(self) -> float:
        """Cable wound in by a motion that has gone on long enough to be one, m; else zero."""
        lasts = self._observed - self._turned >= _RUN_TIME
        return self.run if lasts and abs(self.run) > _RUN_WAY else 0.0

    def _follow_direction(self, now: float, speed: float) -> None:
        """Follow the cable that runs one way; it ends with the way back, or a standstill."""
        before, self._observed = self._observed, now
        way = speed * (now - before)
        if way * self.run > 0:
            self.run += way
            self._ran = now
        elif way or not now - self._ran <= _RUN_TIME:
            # A speed that is rounded to zero now and then is no standstill.
            self.run, self._turned, self._ran = way, before, now

    def _follow_tension(self, cell: Instrumented) -> None:
        before = self._tension
        if before is None:
            self._tension = (cell.time, cell.value)
            return
        span = cell.time - before[0]
        if span >= _RATE_TIME:
            self.tension_rate = (cell.value - before[1]) / span
            self._tension = (cell.time, cell.value)

    def _follow_slowing(self, target: float, speed: float) -> None:
        """While the commanded speed falls, compare with the fastest commanded of a response time.

        A lag of first order with a time constant T follows a ramp T later, and its end by
        exp(-t/T): with T below half the response time it is never faster than that, while a drive
        whose targets do not reach it keeps its speed, and soon is.
        """
        self.unresponsive = False
        track, own = self._track, self.own
        if isnan(target):
            if track:
                track.clear()
            return
        track.append(target)
        if len(track) <= own.response_cycles:
            return
        track.popleft()
        excess = speed - target if speed > 0 else target - speed
        if excess <= own.ripple:
            return  # not faster than commanded now, and so not than any of the window
        sign = math.copysign(1.0, speed)
        fastest = max(track) if sign > 0 else -min(track)
        if sign * target >= fastest:
            return
        margin = max(own.ripple, _OVERSHOOT * fastest)
        self.unresponsive = sign * speed > max(0.0, fastest) + margin
        self.reversed = fastest <= 0.0 and sign * target < 0.0

    def _follow_length(self, item: WinchInput) -> None:
        if not item.moving or self._began is None:
            self._began, self.slip, self.moved = (item.length, item.cable_length), 0.0, 0.0
            self._last = item.cable_length
            return
        length, cable = self._began
        self.moved += abs(item.cable_length - self._last)
        self._last = item.cable_length
        self.slip = (item.length - length) - (item.cable_length - cable)

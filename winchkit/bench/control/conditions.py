"""The conditions that the supervisor tests on each winch, as a table.

A row names its variable and limit in words (``docs/safety.md`` prints them), says what the
condition forbids and whether it is latched although nothing moved, and has a test and a message.
Most tests compare a quantity with a bound (:class:`Exceeds`); those on facts are functions.
Debouncing and latching are the supervisor's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from winchkit.bench.control.motion import commanded_and_moved
from winchkit.bench.control.observation import (
    Instrumented,
    Quantities,
    Supervised,
    SupervisorMemory,
    WinchInput,
)
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.control.tension_control import SLACK_TIME

_LENGTH_TOLERANCE = 5e-3
"""Overshoot of a position loop at a length limit, m."""
_SPEED_TOLERANCE = 1.2
"""Overshoot of a velocity loop with the usual damping is below 20 % of its step."""
_REST_TIME = 0.1
"""A brake that closes lets the motor settle for less, s."""
_CREPT = 0.02
"""m: as of a motion that is missing; a brake that settles moves far less."""
_DEVIATION = 0.25
"""Share of ``limits.speed``: well above the lag of a velocity loop at the limit's acceleration."""
_DEVIATION_TIME = 0.25
"""A holding brake opens, and static friction is overcome, in less, s."""
_RUNAWAY_TIME = 0.03
"""An overshoot of a velocity loop is over, s; no brake and no friction makes a motor faster."""
_FOLLOWING_TIME = 0.25
"""At ``limits.speed``, the lag of a position loop of gain 4/s, s."""
_FOLLOWING_DEBOUNCE = 0.05
"""s: a step of the load's inertia, or one late SYNC, is over."""
_SLIP_TIME = 0.5
"""s: lag of a length instrument behind the motor, with its filter, is over."""

_AGAINST = (
    "its direction is reversed (polarity 607Eh, motor phases, encoder), or the load drives it"
)

Test = Callable[[WinchInput, Supervised, SupervisorMemory], bool]
Words = Callable[[WinchInput, Supervised, SupervisorMemory], str]
When = Literal["", "moving", "disabled", "follows"]
"""A field of :class:`WinchInput`; empty for always."""


class Exceeds:
    """The test whether a quantity is above a bound."""

    def __init__(self, quantity: str, bound: Callable[[Supervised], float | None]) -> None:
        """Take the name of a field of :class:`Quantities`, and its bound; None for no bound."""
        self.place = Quantities._fields.index(quantity)
        """Index of the quantity in :class:`Quantities`."""
        self._bound = bound

    def bound(self, own: Supervised) -> float:
        """Bound of a winch; infinite where it has none."""
        found = self._bound(own)
        return math.inf if found is None else found

    def __call__(self, _item: WinchInput, own: Supervised, memory: SupervisorMemory) -> bool:
        """Whether the quantity of the newest observations is above the bound."""
        return memory.quantities[self.place] > self.bound(own)


@dataclass(frozen=True, slots=True)
class Condition:
    """A row of the table."""

    kind: str
    variable: str
    limit: str
    holds: Test
    words: Words
    blocks: Direction = Direction.BOTH
    """Directions that it forbids; NONE is a warning."""
    latches: bool = False
    """Latched although nothing moved. What forbids a motion under way is latched in any case."""
    debounce: float = 0.0
    """Time for which it must hold (debounce), s."""
    by_facts: bool = False
    """Whether it looks at nothing but ``observation.FACTS``, and at boot-ups dealt with. Such a
    condition has no ``when``: the supervisor leaves it out while the facts are those under which it
    did not hold, whatever the winch does."""
    when: When = ""
    """State of the winch in which the condition is tested."""
    needs: str = ""
    """The key of ``[winch.A.limits]`` or the instrument without which it is not tested."""

    def __post_init__(self) -> None:
        if self.by_facts and self.when:
            raise ValueError(f"condition '{self.kind}' has both by_facts and when: leave one out")


def _cell(item: WinchInput) -> Instrumented:
    assert item.tension is not None, "tested only where there is a cell"
    return item.tension


def _deviation_limit(own: Supervised) -> float:
    return _DEVIATION * own.limits.speed


def _following_limit(own: Supervised) -> float:
    return own.limits.following_error or _FOLLOWING_TIME * own.limits.speed


def _slack_limit(own: Supervised) -> float | None:
    slack = own.limits.tension_slack
    return None if slack is None else -slack


def _stale_words(item: WinchInput, _own: Supervised, _memory: SupervisorMemory) -> str:
    cell = _cell(item)
    age = item.now - cell.since
    since = "yet" if math.isinf(age) else f"for {age:.2f} s"
    reason = f": {cell.problem}" if cell.problem else ""
    return f"no load cell reading {since} (limit {cell.max_age:.2f} s){reason}"


def _missing_words(item: WinchInput, *_: object) -> str:
    reason = (
        f"the motor turns against its command; {_AGAINST}"
        if item.winding_speed * item.commanded < -_DEVIATION * item.commanded**2
        else "the motor does not turn as commanded, or its encoder does not count; check brake, "
        "load, encoder and drive limits"
    )
    return f"{commanded_and_moved(*item.way)}: {reason}"


def _slowing_words(item: WinchInput, own: Supervised, memory: SupervisorMemory) -> str:
    speeds = f"{item.winding_speed:.3f} m/s, commanded {item.target_speed:.3f} m/s"
    if memory.reversed:
        return f"the motor turns against its command: {speeds}; {_AGAINST}"
    return (
        f"the drive does not slow down as commanded: {speeds}, within "
        f"{own.limits.response_time:g} s (limits.response_time); it does not receive its targets, "
        "or they have no effect"
    )


CONDITIONS: tuple[Condition, ...] = (
    Condition(
        "second master",
        "RPDOs, SDO writes, NMT commands to the drive, heartbeats of this host, not sent here",
        "none",
        lambda item, _own, _memory: bool(item.second_master),
        lambda item, *_: (
            f"somebody else commands the drive: {item.second_master} was not sent here; end the "
            "other master or tool on the bus, then reset"
        ),
        latches=True,
        by_facts=True,
    ),
    Condition(
        "boot-up",
        "boot-up messages since commissioning",
        "none",
        lambda item, _own, memory: item.boot_ups > memory.boot_ups,
        lambda *_: "the drive has restarted and lost its PDO mapping; look why, then reset",
        latches=True,
        by_facts=True,
    ),
    Condition(
        "heartbeat",
        "age of the drive's heartbeat, or of its reply to node guarding",
        "2.5 heartbeat periods",
        lambda item, _own, _memory: bool(item.heartbeat_lost),
        lambda item, *_: f"{item.heartbeat_lost}, then reset",
        latches=True,
        by_facts=True,
    ),
    Condition(
        "nmt",
        "NMT state in the drive's heartbeat",
        "operational",
        lambda item, _own, _memory: not item.operational,
        lambda item, *_: (
            f"the drive left the NMT state operational (it is {item.nmt}): another master, or "
            "its own monitoring; look why, then reset"
        ),
        latches=True,
        by_facts=True,
    ),
    Condition(
        "feedback",
        "age of the newest complete feedback",
        "2 heartbeat periods, and 5 SYNCs unanswered",
        Exceeds("unanswered", lambda own: own.stale),
        lambda item, own, _memory: (
            f"no complete feedback for {item.feedback_age * 1e3:.0f} ms (limit "
            f"{own.stale * 1e3:.0f} ms); check the bus load and the drive"
        ),
    ),
    Condition(
        "fault",
        "power state and error code of the drive",
        "no fault",
        lambda item, _own, _memory: bool(item.fault),
        lambda item, *_: f"drive fault: {item.fault}; clear the cause, then reset",
        by_facts=True,
    ),
    Condition(
        "mode",
        "mode of operation that the drive shows (6061h)",
        "the mode that it was given",
        lambda item, _own, _memory: not item.mode_kept,
        lambda *_: "the drive has changed its mode of operation; reset",
        by_facts=True,
    ),
    Condition(
        "state",
        "power state of the drive against the control words sent",
        "no change that was not commanded",
        lambda item, _own, _memory: bool(item.uncommanded),
        lambda item, *_: f"{item.uncommanded}; find out what did it, then reset",
        latches=True,
        by_facts=True,
    ),
    Condition(
        "position",
        "change of 6064h between two answers",
        "what 1.5 x limits.speed turns within that time and 0.25 s",
        lambda item, _own, _memory: bool(item.position_jump),
        lambda item, *_: (
            f"{item.position_jump}, faster than it can turn: the counter was set, or the encoder "
            "fails; the cable length is not known; look why, reset, then home the winch"
        ),
        latches=True,
        by_facts=True,
    ),
    Condition(
        "counter",
        "change of 6064h against the integral of 606Ch, within 0.25 s and within 4 s",
        "5 %, one step of 606Ch, its range times limits.response_time, and "
        "limits.acceleration x response_time² / 2",
        lambda item, _own, _memory: bool(item.position_disagreement),
        lambda item, *_: (
            f"{item.position_disagreement}: the counter stands still, was set or lost its encoder, "
            "606Ch is wrong, or the device file's increments_per_turn or speed_unit; the cable "
            "length is not known; mend it, reset, then home the winch"
        ),
        latches=True,
        by_facts=True,
    ),
    Condition(
        "motion at rest",
        "cable speed by the motor while the drive is commanded to be disabled",
        "3 steps of 606Ch, at least 1 % of limits.speed",
        Exceeds("speed", lambda own: own.rest_speed),
        lambda item, own, _memory: (
            f"the motor turns although rest is commanded: {item.winding_speed:.3f} m/s of "
            f"cable (limit {own.rest_speed:.3f} m/s); check the brake and who turns it, reset"
        ),
        latches=True,
        debounce=_REST_TIME,
        when="disabled",
    ),
    Condition(
        "creep at rest",
        "cable moved by the motor since the winch was disabled, in steps below 2 mm",
        "20 mm",
        Exceeds("crept", lambda _own: _CREPT),
        lambda item, *_: (
            f"the motor has turned by {item.way[1]:.3f} m of cable since rest was commanded (limit "
            f"{_CREPT:.3f} m): the brake slips, or somebody turns it; secure the load, then reset"
        ),
        latches=True,
        when="disabled",
    ),
    Condition(
        "slowing down",
        "measured cable speed while the commanded speed falls",
        "the fastest commanded within limits.response_time, and 5 %",
        Exceeds("unresponsive", lambda _own: 0.0),
        _slowing_words,
        when="follows",
    ),
    Condition(
        "deviation",
        "measured against commanded cable speed",
        "25 % of limits.speed",
        Exceeds("deviation", _deviation_limit),
        lambda item, own, _memory: (
            f"the motor does not follow: {item.winding_speed:.3f} m/s, commanded "
            f"{item.commanded:.3f} m/s (limit of the difference "
            f"{_deviation_limit(own):.3f} m/s for "
            f"{_DEVIATION_TIME:g} s); check load, brake and drive limits"
        ),
        debounce=_DEVIATION_TIME,
        when="follows",
    ),
    Condition(
        "runaway",
        "measured cable speed against the direction and above the size of the commanded one",
        "25 % of limits.speed",
        Exceeds("runaway", _deviation_limit),
        lambda item, own, _memory: (
            f"the motor turns faster than commanded, or the other way: {item.winding_speed:.3f} "
            f"m/s, commanded {item.commanded:.3f} m/s (limit of the difference "
            f"{_deviation_limit(own):.3f} m/s); check direction, scale and load"
        ),
        debounce=_RUNAWAY_TIME,
        when="follows",
    ),
    Condition(
        "following error",
        "target position less measured position, in cable",
        "limits.following_error, else 0.25 s at limits.speed",
        Exceeds("following_error", _following_limit),
        lambda item, own, _memory: (
            f"following error {abs(item.following_error) * 1e3:.0f} mm of cable (limit "
            f"{_following_limit(own) * 1e3:.0f} mm); check load, brake and drive limits"
        ),
        debounce=_FOLLOWING_DEBOUNCE,
        when="follows",
    ),
    Condition(
        "missing motion",
        "cable commanded less cable moved by the motor, since the motion began",
        "half of the commanded, at least 20 mm, and limits.response_time at the commanded speed",
        Exceeds("missing", lambda _own: 0.0),
        _missing_words,
        debounce=_DEVIATION_TIME,
        when="follows",
    ),
    Condition(
        "speed",
        "cable speed by the motor",
        "1.2 x limits.speed",
        Exceeds("speed", lambda own: own.limits.speed * _SPEED_TOLERANCE),
        lambda item, own, _memory: (
            f"cable speed {item.winding_speed:.3f} m/s is beyond limits.speed "
            f"{own.limits.speed:g} m/s by more than a fifth"
        ),
    ),
    Condition(
        "length",
        "cable length by the motor, lower limit",
        "limits.length, with 5 mm of tolerance",
        Exceeds("wound_in", lambda own: -(own.shortest - _LENGTH_TOLERANCE)),
        lambda item, own, _memory: (
            f"cable length {item.cable_length:.3f} m is below limits.length {own.shortest:g} m; "
            "only paying out is allowed"
        ),
        blocks=Direction.WIND_IN,
        needs="length",
    ),
    Condition(
        "length",
        "cable length by the motor, upper limit",
        "limits.length, with 5 mm of tolerance",
        Exceeds("paid_out", lambda own: own.longest + _LENGTH_TOLERANCE),
        lambda item, own, _memory: (
            f"cable length {item.cable_length:.3f} m is above limits.length {own.longest:g} m; "
            "only winding in is allowed"
        ),
        blocks=Direction.PAY_OUT,
        needs="length",
    ),
    Condition(
        "dead wraps",
        "cable length by the motor",
        "the length at which the last two wraps are left on the drum, by the profile",
        Exceeds("paid_out", lambda own: own.safe_length),
        lambda item, own, _memory: (
            f"cable length {item.cable_length:.3f} m leaves fewer than two dead wraps on the drum "
            f"(from {own.safe_length:.3f} m on); only winding in is allowed"
        ),
        blocks=Direction.PAY_OUT,
    ),
    Condition(
        "cable slip",
        "change of the length sensor against the change by the motor, since the motion began",
        "50 mm and 5 % of the moved length",
        Exceeds("slip", lambda _own: 0.0),
        lambda _item, _own, memory: (
            f"the length sensor and the motor disagree by {memory.slip * 1e3:.0f} mm after "
            f"{memory.moved:.2f} m of motion; the cable slips, sticks or the profile is wrong"
        ),
        debounce=_SLIP_TIME,
        when="moving",
        needs="length instrument",
    ),
    Condition(
        "cell stale",
        "age of the load cell's newest reading",
        "the device file's longest age",
        Exceeds("expired", lambda _own: 0.0),
        _stale_words,
        needs="cell",
    ),
    Condition(
        "cell",
        "flags of the load cell's reading",
        "a number",
        Exceeds("unreadable", lambda _own: 0.0),
        lambda item, *_: f"the load cell reads no number ({_cell(item).quality}); check it",
        needs="cell",
    ),
    Condition(
        "cell frozen",
        "raw counts of the load cell, against their noise and the predicted tension (SPRT)",
        "10⁻⁹ for a live cell to stand still so long",
        lambda item, _own, _memory: bool(item.frozen),
        lambda item, *_: item.frozen,
        needs="cell",
        by_facts=True,
    ),
    Condition(
        "cell unstable",
        "stability bit and noise of the load cell at rest",
        "stable 5 s after a motion; 5 times the noise of the last blocks of 200 conversions",
        lambda item, _own, _memory: bool(item.unstable),
        lambda item, *_: f"the load cell is unstable: {item.unstable}",
        blocks=Direction.NONE,
        needs="cell",
        by_facts=True,
    ),
    Condition(
        "tension high",
        "gross reading of the load cell",
        "limits.tension_high",
        Exceeds("tension", lambda own: own.limits.tension_high),
        lambda _item, own, memory: (
            f"tension {memory.gross:.1f} N is above tension_high {own.limits.tension_high:g} N; "
            "only paying out is allowed until it falls"
        ),
        blocks=Direction.WIND_IN,
        needs="tension_high",
    ),
    Condition(
        "slack",
        "gross reading of the load cell",
        "limits.tension_slack",
        Exceeds("slackness", _slack_limit),
        lambda _item, own, memory: (
            f"tension {memory.gross:.1f} N is below tension_slack {own.limits.tension_slack:g} N; "
            "only winding in is allowed until it rises"
        ),
        blocks=Direction.PAY_OUT,
        debounce=SLACK_TIME,
        needs="tension_slack",
    ),
    Condition(
        "tension rate",
        "change of the load cell's reading over 50 ms",
        "limits.tension_rate",
        Exceeds("tension_rate", lambda own: own.limits.tension_rate),
        lambda _item, own, memory: (
            f"tension changes by {memory.tension_rate:.0f} N/s, limit "
            f"{own.limits.tension_rate:g} N/s"
        ),
        needs="tension_rate",
    ),
    Condition(
        "emergency",
        "emergency messages of the drive without a fault",
        "codes of limits.emergency_trips",
        lambda item, own, _memory: any(own.trips_on(code) for code in item.emergencies),
        lambda item, *_: f"the drive sent {item.emergency_text}; clear the cause, then reset",
        latches=True,
        needs="emergency_trips",
        by_facts=True,
    ),
    Condition(
        "emergency",
        "emergency messages of the drive without a fault",
        "none in force",
        lambda item, _own, _memory: bool(item.emergencies),
        lambda item, *_: f"the drive sent {item.emergency_text}",
        blocks=Direction.NONE,
        by_facts=True,
    ),
    Condition(
        "length unknown",
        "record of positions, boot-up messages, volatile objects and range of 6064h, drum capacity",
        "every turn counted since the zero was found (see When the cable length is not known)",
        lambda item, _own, _memory: bool(item.length_doubt),
        lambda item, *_: (
            f"the cable length is not known: {item.length_doubt}; limits.length is not kept, home "
            "the winch"
        ),
        blocks=Direction.NONE,
        by_facts=True,
    ),
)
"""Tested in this order, on each winch that has what a row needs and is what it is tested on."""

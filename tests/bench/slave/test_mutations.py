"""Each condition of the supervisor's table, switched off in turn, makes a test fail.

A case says what a winch does from a moment on, when the condition has to hold, and what it does
just within the limit. The limits are written down here a second time, from docs/safety.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest

from winchkit.bench.control.conditions import CONDITIONS, Condition
from winchkit.bench.control.observation import Instrumented, Supervised, WinchInput
from winchkit.bench.control.snapshot import Direction
from winchkit.bench.control.supervisor import Supervisor
from winchkit.schema.bench import LimitSpec

_CYCLE = 0.004
_BEFORE, _WITHIN = 1.0, 1.0
"""How long all is well, and how long the limit is nearly reached, s."""
_LIMITS = LimitSpec(
    speed=0.3,
    acceleration=1.0,
    length=(0.5, 5.0),
    tension_high=500.0,
    tension_slack=20.0,
    tension_rate=2000.0,
    following_error=0.02,
    emergency_trips=("4210", "71xx"),
)
_OWN = Supervised(_LIMITS, stale=0.1, cycle=_CYCLE, resolution=1e-4, safe_length=4.5)

State = dict[str, Any]
Change = Callable[[float], State]


def well(now: float, change: State) -> WinchInput:
    """A winch that winds in as commanded, apart from a change."""
    tension = change.get("tension", 100.0)
    cell = Instrumented(
        value=change.get("value", tension),
        since=now - change.get("age", 0.01),
        max_age=0.3,
        quality="good",
        time=now,
        gross=tension,
    )
    base: State = {
        "feedback_age": 0.002,
        "missed_syncs": 0,
        "heartbeat_lost": "",
        "boot_ups": 1,
        "operational": True,
        "mode_kept": True,
        "fault": "",
        "winding_speed": 0.1,
        "commanded": 0.1,
        "cable_length": 2.0,
        "moving": True,
        "follows": True,
        "target_speed": 0.1,
        "length": 2.0,
        "now": now,
    }
    own = {key: value for key, value in change.items() if key in WinchInput._fields}
    return WinchInput(**{**base, **own, "tension": cell})


def resting(change: State) -> Change:
    """The same while the winch is disabled."""
    rest = {"moving": False, "follows": False, "commanded": 0.0, "winding_speed": 0.0}
    return lambda _t: {**rest, "target_speed": math.nan, "disabled": True, **change}


def always(**change: Any) -> Change:
    return lambda _t: change


@dataclass(frozen=True)
class Case:
    """One condition."""

    kind: str
    variable: str
    """Distinguishes rows of one kind."""
    beyond: Change
    within: Change
    """Just within the limit, for a second."""
    after: float = 0.0
    """Debounce, s."""
    debounced: bool = True
    """Whether it must not hold earlier."""
    blocks: Direction = Direction.BOTH
    latched: bool = True
    before: Change = field(default=lambda _t: {})


def _slowing(speed: float) -> Change:
    """The target falls by 1 m/s^2 from 0.1 m/s; the winch keeps a speed, or lags by 30 ms."""

    def change(t: float) -> State:
        target = max(0.0, 0.1 - t)
        lagging = max(0.0, min(0.1, 0.1 - (t - 0.03)))
        actual = max(speed, lagging)
        return {"target_speed": target, "commanded": target, "winding_speed": actual}

    return change


def _rate(rate: float) -> Change:
    return lambda t: {"tension": 100.0 + rate * min(t, 0.15)}


_SLOW = {"follows": False, "target_speed": math.nan}
_OUT = {"commanded": -0.1, "winding_speed": -0.1, "target_speed": math.nan}
"""It pays out."""
_OUT_UNMEASURED = {**_OUT, "length": math.nan}
_STANDS = {"commanded": 0.0, "target_speed": math.nan}
CASES = (
    Case("second master", "", always(second_master="an SDO write of 6040h"), always()),
    Case("position", "", always(position_jump="6064h changed by 9.00 turns"), always()),
    Case("counter", "", always(position_disagreement="6064h changed by 0.000 turns"), always()),
    Case("boot-up", "", always(boot_ups=2), always(boot_ups=1)),
    Case("heartbeat", "", always(heartbeat_lost="gone"), always()),
    Case("nmt", "", always(operational=False, nmt="pre-operational"), always()),
    Case(
        "feedback",
        "",
        always(feedback_age=0.101, missed_syncs=5),
        always(feedback_age=0.101, missed_syncs=4),
    ),
    Case("feedback", "", always(feedback_age=0.101, missed_syncs=25), always(feedback_age=0.099)),
    Case("fault", "", always(fault="error 7121h motor blocked"), always()),
    Case("mode", "", always(mode_kept=False), always()),
    Case("state", "", always(uncommanded="the drive left operation enabled"), always()),
    Case(
        "motion at rest",
        "",
        resting({"winding_speed": 0.0031}),
        resting({"winding_speed": 0.0029}),
        after=0.1,
    ),
    Case(
        "creep at rest",
        "",
        resting({"way": (0.0, -0.0201)}),
        resting({"way": (0.0, -0.0199)}),
    ),
    Case("slowing down", "", _slowing(0.1), _slowing(0.0), after=0.065),
    Case("deviation", "", always(winding_speed=0.024), always(winding_speed=0.026), after=0.25),
    Case("runaway", "", always(winding_speed=0.176), always(winding_speed=0.174), after=0.03),
    Case(
        "runaway",
        "",
        always(winding_speed=-0.076),
        always(winding_speed=-0.074, **_STANDS),
        after=0.03,
    ),
    Case(
        "following error",
        "",
        always(following_error=-0.021),
        always(following_error=0.019),
        after=0.05,
    ),
    Case("missing motion", "", always(way=(0.1, 0.043)), always(way=(0.1, 0.045)), after=0.25),
    Case(
        "missing motion", "", always(way=(-0.03, -0.003)), always(way=(-0.03, -0.005)), after=0.25
    ),
    Case("speed", "", always(winding_speed=-0.361, **_SLOW), always(winding_speed=-0.359, **_SLOW)),
    Case(
        "length",
        "lower",
        always(cable_length=0.494, length=math.nan),
        always(cable_length=0.496, length=math.nan),
        blocks=Direction.WIND_IN,
    ),
    Case(
        "length",
        "upper",
        always(cable_length=5.006, **_OUT_UNMEASURED),
        always(cable_length=5.004, **_OUT_UNMEASURED),
        blocks=Direction.PAY_OUT,
        before=always(**_OUT_UNMEASURED),
    ),
    Case(
        "dead wraps",
        "",
        always(cable_length=4.51, **_OUT_UNMEASURED),
        always(cable_length=4.49, **_OUT_UNMEASURED),
        blocks=Direction.PAY_OUT,
        before=always(**_OUT_UNMEASURED),
    ),
    Case("cable slip", "", always(length=2.051), always(length=2.049), after=0.5),
    Case("cell stale", "", always(age=0.31), always(age=0.29)),
    Case("cell", "", always(value=math.nan), always()),
    Case("cell frozen", "", always(frozen="the load cell is frozen"), always()),
    Case(
        "cell unstable",
        "",
        always(unstable="its stability bit is not set"),
        always(),
        blocks=Direction.NONE,
        latched=False,
    ),
    Case(
        "length unknown",
        "",
        always(length_doubt="its record was not closed"),
        always(),
        blocks=Direction.NONE,
        latched=False,
    ),
    Case(
        "tension high", "", always(tension=501.0), always(tension=499.0), blocks=Direction.WIND_IN
    ),
    Case(
        "slack",
        "",
        always(tension=19.0, **_OUT),
        always(tension=21.0, **_OUT),
        after=0.2,
        blocks=Direction.PAY_OUT,
        before=always(**_OUT),
    ),
    Case("tension rate", "", _rate(2100.0), _rate(1900.0), after=0.104, debounced=False),
    Case("emergency", "codes of", always(emergencies=(0x4210,)), always(emergencies=(0x4310,))),
    Case("emergency", "codes of", always(emergencies=(0x7121,)), always(emergencies=(0x7221,))),
    Case(
        "emergency",
        "none in force",
        always(emergencies=(0x4310,)),
        always(),
        blocks=Direction.NONE,
        latched=False,
    ),
)
"""Every row of the table, at least once."""


def rows_of(case: Case) -> list[Condition]:
    """The rows that a case is about."""
    return [
        row
        for row in CONDITIONS
        if row.kind == case.kind and case.variable in f"{row.variable} {row.limit}"
    ]


def seen(
    conditions: Sequence[Condition], case: Case, change: Change, duration: float
) -> tuple[bool, bool]:
    """Whether the condition was ever reported with what it blocks, and whether it latched."""
    supervisor = Supervisor({"A": _OWN}, conditions)
    now, found = 100.0, False
    for _ in range(round(_BEFORE / _CYCLE)):
        supervisor.check(now, {"A": well(now, case.before(0.0))})
        now += _CYCLE
    assert not supervisor.tripped, supervisor.tripped
    begin = now
    while now <= begin + duration + 1e-9:
        reported = supervisor.check(now, {"A": well(now, change(now - begin))})
        trips = (*reported, *supervisor.warnings)
        found |= any((t.kind, t.blocks) == (case.kind, case.blocks) for t in trips)
        now += _CYCLE
    return found, any(trip.kind == case.kind for trip in supervisor.tripped)


def check(conditions: Sequence[Condition], case: Case) -> None:
    """What the case demands of a table of conditions."""
    assert seen(conditions, case, case.beyond, case.after + 2 * _CYCLE) == (True, case.latched)
    if case.after and case.debounced:
        early = seen(conditions, case, case.beyond, case.after - 3 * _CYCLE)
        assert early == (False, False), "not debounced"
    assert seen(conditions, case, case.within, _WITHIN) == (False, False)


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c.kind} {c.variable}".strip())
def test_a_condition_holds_beyond_its_limit_and_not_within(case: Case) -> None:
    check(CONDITIONS, case)


@pytest.mark.parametrize("row", CONDITIONS, ids=lambda row: f"{row.kind}: {row.variable}")
def test_a_condition_that_is_switched_off_makes_a_test_fail(row: Condition) -> None:
    cases = [case for case in CASES if row in rows_of(case)]
    assert cases, "no case is about this row"
    without = [other for other in CONDITIONS if other is not row]
    for case in cases:
        with pytest.raises(AssertionError):
            check(without, case)

"""The verdict of the supervisor's tests: of bounds by their formulas, of facts by every row.

The formulas of docs/safety.md stand here a second time, on the observations themselves. A table
with them in place of the quantities has no bounds that the supervisor could test first.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.bench.control.conditions import CONDITIONS, Condition, Exceeds
from winchkit.bench.control.observation import (
    FACTS,
    Instrumented,
    Supervised,
    SupervisorMemory,
    WinchInput,
)
from winchkit.bench.control.supervisor import Supervisor
from winchkit.schema.bench import LimitSpec

CYCLE = 0.004
LIMITS = LimitSpec(
    speed=0.4,
    length=(1.0, 9.0),
    tension_high=500.0,
    tension_slack=20.0,
    tension_rate=2000.0,
    following_error=0.02,
)
BENCHES = (
    Supervised(LIMITS, stale=0.1, cycle=CYCLE, resolution=1e-3, safe_length=8.5),
    Supervised(LimitSpec(speed=0.4), stale=0.1, cycle=CYCLE),
)
Formula = Callable[[WinchInput, Supervised, SupervisorMemory], bool]


def _in_time(item: WinchInput) -> bool:
    cell = item.tension
    return cell is not None and item.now - cell.since <= cell.max_age


def _gross(item: WinchInput) -> float:
    """Tension of the cable; NaN where the reading does not count."""
    cell = item.tension
    if cell is None or not _in_time(item) or math.isnan(cell.value):
        return math.nan
    return cell.gross if math.isfinite(cell.gross) else cell.value


def _runaway(item: WinchInput) -> float:
    speed, commanded = item.winding_speed, item.commanded
    against = abs(speed) if speed * commanded < 0 else 0.0
    return max(abs(speed) - abs(commanded), against)


def _stale(item: WinchInput) -> bool:
    cell = item.tension
    return cell is not None and item.now - cell.since > cell.max_age


FORMULAS: dict[tuple[str, str], Formula] = {
    ("feedback", "age"): lambda item, own, _: (
        item.feedback_age > own.stale and item.missed_syncs >= 5
    ),
    ("motion at rest", ""): lambda item, own, _: abs(item.winding_speed) > own.rest_speed,
    ("creep at rest", ""): lambda item, _own, _: abs(item.way[1]) > 0.02,
    ("slowing down", ""): lambda _item, _own, memory: memory.unresponsive,
    ("deviation", ""): lambda item, own, _: (
        abs(item.winding_speed - item.commanded) > 0.25 * own.limits.speed
    ),
    ("runaway", ""): lambda item, own, _: _runaway(item) > 0.25 * own.limits.speed,
    ("following error", ""): lambda item, own, _: (
        abs(item.following_error) > (own.limits.following_error or 0.25 * own.limits.speed)
    ),
    ("missing motion", ""): lambda item, own, _: (
        abs(item.way[0] - item.way[1])
        - max(0.02, abs(item.way[0]) / 2)
        - own.limits.response_time * abs(item.commanded)
        > 0
    ),
    ("speed", ""): lambda item, own, _: abs(item.winding_speed) > own.limits.speed * 1.2,
    ("length", "lower"): lambda item, own, _: item.cable_length < own.shortest - 5e-3,
    ("length", "upper"): lambda item, own, _: item.cable_length > own.longest + 5e-3,
    ("dead wraps", ""): lambda item, own, _: item.cable_length > own.safe_length,
    ("cable slip", ""): lambda _item, _own, memory: abs(memory.slip) > 0.05 + 0.05 * memory.moved,
    ("cell stale", ""): lambda item, _own, _: _stale(item),
    ("cell", ""): lambda item, _own, _: (
        item.tension is not None and math.isnan(item.tension.value) and _in_time(item)
    ),
    ("tension high", ""): lambda item, own, _: _gross(item) > (own.limits.tension_high or math.inf),
    ("slack", ""): lambda item, own, _: _gross(item) < (own.limits.tension_slack or -math.inf),
    ("tension rate", ""): lambda item, own, memory: (
        not math.isnan(_gross(item))
        and abs(memory.tension_rate) > (own.limits.tension_rate or math.inf)
    ),
}
"""By kind of condition and a word of its variable."""


def _formula(row: Condition) -> Formula:
    (found,) = (
        formula
        for (kind, word), formula in FORMULAS.items()
        if kind == row.kind and word in row.variable
    )
    return found


def near(*bounds: float) -> st.SearchStrategy[float]:
    """Values at bounds, beside them by one unit in the last place, between them, and unknown."""
    beside = [math.nextafter(bound, way) for bound in bounds for way in (-math.inf, math.inf)]
    between = st.floats(1.5 * min(bounds), 1.5 * max(bounds))
    return st.one_of(st.sampled_from([*bounds, *beside, math.nan, 0.0, -0.0]), between)


SPEEDS = near(-0.48, -0.4, -0.1, -0.004, 0.003, 0.004, 0.1, 0.4, 0.48, math.inf)
CELLS = st.none() | st.fixed_dictionaries(
    {
        "value": near(20.0, 100.0, 500.0),
        "since": st.sampled_from([-math.inf, 1.0, 1.9, 1.99]),
        "max_age": st.sampled_from([0.01, 0.1, math.inf]),
        "quality": st.just("good"),
        "time": near(1.0, 1.02, 1.08),
        "gross": near(20.0, 100.0, 500.0),
    }
).map(lambda fields: Instrumented(**fields))
INPUTS = st.fixed_dictionaries(
    {
        "feedback_age": near(0.0, 0.1),
        "missed_syncs": st.integers(0, 7),
        "heartbeat_lost": st.just(""),
        "boot_ups": st.just(0),
        "operational": st.just(True),
        "mode_kept": st.sampled_from([True, True, True, False]),
        "fault": st.sampled_from(["", "", "", "error 3210h"]),
        "winding_speed": SPEEDS,
        "commanded": SPEEDS,
        "cable_length": near(0.995, 1.0, 8.5, 9.0, 9.005),
        "moving": st.booleans(),
        "tension": CELLS,
        "disabled": st.booleans(),
        "follows": st.booleans(),
        "target_speed": SPEEDS,
        "following_error": near(-0.1, -0.02, 0.02, 0.1),
        "way": st.sampled_from([(0.0, 0.0), (0.1, 0.0), (-0.1, -0.049), (0.03, 0.011)]),
        "length": near(1.0, 1.05, 9.0),
        "now": st.just(2.0),
    }
).map(lambda fields: WinchInput(**fields))


@pytest.mark.slow
@pytest.mark.parametrize("own", BENCHES, ids=("all limits", "speed only"))
@settings(max_examples=100, deadline=None)
@given(cycles=st.lists(st.tuples(INPUTS, st.integers(1, 30)), min_size=1, max_size=6))
def test_the_verdict_is_that_of_the_formulas(
    own: Supervised, cycles: list[tuple[WinchInput, int]]
) -> None:
    """For each of several observations, each held for some cycles."""
    plain_rows = [
        replace(row, holds=_formula(row)) if isinstance(row.holds, Exceeds) else row
        for row in CONDITIONS
    ]
    tested, plain = Supervisor({"A": own}), Supervisor({"A": own}, plain_rows)
    now = 0.0
    for item, count in cycles:
        for _ in range(count):
            now += CYCLE
            blocked = tested.check(now, {"A": item})
            assert blocked == plain.check(now, {"A": item})
            assert (tested.tripped, tested.warnings) == (plain.tripped, plain.warnings)


def test_every_quantity_is_compared() -> None:
    compared = {row.kind for row in CONDITIONS if isinstance(row.holds, Exceeds)}
    assert compared == {kind for kind, _ in FORMULAS}
    assert all(isinstance(row.holds, Exceeds) or row.by_facts for row in CONDITIONS)


READINGS = st.lists(
    st.tuples(
        st.sampled_from([0.0, 0.004, 0.03, 0.06]),
        near(20.0, 100.0, 500.0),
        st.integers(1, 5),
        st.sampled_from([True, True, True, False]),
    ),
    min_size=1,
    max_size=12,
)


@settings(max_examples=200, deadline=None)
@given(readings=READINGS, moving=INPUTS)
def test_a_reading_that_stays_leads_to_the_same_rate_again(
    readings: list[tuple[float, float, int, bool]], moving: WinchInput
) -> None:
    """One memory sees the same object for several cycles, the other an equal one in each."""
    same, equal = SupervisorMemory(BENCHES[0]), SupervisorMemory(BENCHES[0])
    now, newest = 1.0, 1.0
    for step, value, cycles, stamped in readings:
        newest += step
        time = newest if stamped else math.nan
        cell = Instrumented(value, newest, 0.1, "good", time, gross=value, received=newest)
        for _ in range(cycles):
            now = max(now + CYCLE, newest)
            same.observe(moving._replace(tension=cell, now=now))
            equal.observe(moving._replace(tension=cell._replace(), now=now))
            assert repr(same.quantities) == repr(equal.quantities)
            assert repr((same.gross, same.tension_rate)) == repr((equal.gross, equal.tension_rate))


OWN = Supervised(
    LimitSpec(
        speed=0.5,
        length=(1.0, 9.0),
        tension_high=500.0,
        tension_slack=20.0,
        emergency_trips=("42xx",),
    ),
    stale=0.1,
)
NOW = 50.0
GOOD = WinchInput(
    feedback_age=0.004,
    missed_syncs=0,
    heartbeat_lost="",
    boot_ups=0,
    operational=True,
    mode_kept=True,
    fault="",
    winding_speed=0.1,
    commanded=0.1,
    cable_length=5.0,
    moving=True,
    now=NOW,
    tension=Instrumented(100.0, NOW - 0.01, 0.1, "good", 0.0, gross=100.0),
)
OTHERWISE = {
    "second_master": ("", "NMT command stop"),
    "moving": (True, False),
    "follows": (False, True),
    "disabled": (False, True),
    "winding_speed": (0.1, 0.0, 0.3),
    "heartbeat_lost": ("", "gone"),
    "boot_ups": (0, 1, 2),
    "operational": (True, False),
    "mode_kept": (True, False),
    "fault": ("", "error 3210h"),
    "uncommanded": ("", "the drive was enabled"),
    "emergencies": ((), (0x4210,), (0x5530,)),
    "unstable": ("", "noise"),
    "frozen": ("", "stands still"),
    "length_doubt": ("", "its record was not closed"),
    "position_jump": ("", "6064h changed by 9.00 turns"),
    "position_disagreement": ("", "6064h changed by 0.000 turns"),
    "cable_length": (5.0, 0.5, 9.5),
    "tension": (GOOD.tension, None, Instrumented(600.0, NOW - 0.01, 0.1, "good", 0.0, gross=600.0)),
}
"""Values of the fields that change from cycle to cycle."""


class _Told:
    """Notes which fields a test asks for."""

    def __init__(self, item: WinchInput) -> None:
        self._item, self.asked = item, set[str]()

    def __getattr__(self, name: str) -> object:
        self.asked.add(name)
        return getattr(self._item, name)


@pytest.mark.parametrize(
    "row", [row for row in CONDITIONS if row.by_facts], ids=lambda row: f"{row.kind} {row.limit}"
)
def test_a_condition_on_facts_asks_for_nothing_else(row: Condition) -> None:
    told = _Told(GOOD._replace(emergencies=(0x4210,)))
    memory = _Told(SupervisorMemory(OWN, boot_ups=0))  # type: ignore[arg-type]
    row.holds(told, OWN, memory)  # type: ignore[arg-type]
    assert told.asked
    assert told.asked <= set(FACTS)
    assert memory.asked <= {"boot_ups"}


def _unmarked(row: Condition) -> Condition:
    """The same row, which itself looks whether the winch is what it is tested on."""

    def holds(item: WinchInput, own: Supervised, memory: SupervisorMemory) -> bool:
        applies = not row.when or getattr(item, row.when)
        return bool(applies) and row.holds(item, own, memory)

    return replace(row, by_facts=False, when="", holds=holds)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_the_verdict_is_that_of_every_row_in_every_cycle(seed: int) -> None:
    """The same rows with none marked are tested in every cycle."""
    chance = random.Random(seed)
    unmarked = [_unmarked(row) for row in CONDITIONS]
    marked = Supervisor({"A": OWN, "B": OWN})
    plain = Supervisor({"A": OWN, "B": OWN}, unmarked)
    items = {"A": GOOD, "B": GOOD}
    found = set[str]()
    for cycle in range(1000):
        if chance.random() < 0.3:
            name, field = chance.choice("AB"), chance.choice(list(OTHERWISE))
            items[name] = items[name]._replace(**{field: chance.choice(OTHERWISE[field])})
        if chance.random() < 0.02:
            boot_ups = {name: chance.choice((0, item.boot_ups)) for name, item in items.items()}
            for each in (marked, plain):
                each.acknowledge(boot_ups)
                each.clear()
        now = cycle * OWN.cycle
        blocked = marked.check(now, items)
        assert blocked == plain.check(now, items)
        assert (marked.tripped, marked.warnings) == (plain.tripped, plain.warnings)
        found |= {trip.kind for trip in (*blocked, *marked.warnings)}
    assert {"boot-up", "fault", "emergency", "length"} <= found


def test_a_flag_of_the_cell_counts_once_the_cell_is_there() -> None:
    """The cell's conditions are not tested without a cell, whatever they would have said."""
    supervisor = Supervisor({"A": OWN})
    without = GOOD._replace(tension=None, frozen="stands still")
    assert supervisor.check(0.0, {"A": without}) == ()
    assert [
        trip.kind for trip in supervisor.check(0.004, {"A": without._replace(tension=GOOD.tension)})
    ] == ["cell frozen"]


def test_a_reading_that_does_not_count_is_no_overload() -> None:
    """Too old, or no number: it trips as such, and not by its tension."""
    old = Instrumented(600.0, NOW - 0.2, 0.1, "good", 0.0, gross=600.0)
    none = Instrumented(math.nan, NOW - 0.01, 0.1, "fault", 0.0, gross=600.0)
    for tension, kind in ((old, "cell stale"), (none, "cell")):
        supervisor = Supervisor({"A": OWN})
        blocked = supervisor.check(0.0, {"A": GOOD._replace(tension=tension)})
        assert [trip.kind for trip in blocked] == [kind]

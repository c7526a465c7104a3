"""Conditions on facts are tested where the facts have changed: the verdict is that of every row."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from winchkit.bench.control.conditions import CONDITIONS, Condition
from winchkit.bench.control.observation import (
    FACTS,
    Instrumented,
    Supervised,
    SupervisorMemory,
    WinchInput,
)
from winchkit.bench.control.supervisor import Supervisor
from winchkit.schema.bench import LimitSpec

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

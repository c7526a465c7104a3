"""Tension control on a simulated cable: convergence, and bounds whatever the load cell reads."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fake_axis import CYCLE, Rig
from winchkit.bench.control.dead_man import DeadMan
from winchkit.bench.control.snapshot import Phase, Trip
from winchkit.bench.control.tension_control import (
    TensionControl,
    TensionReading,
    TensionSetting,
    greatest_stiffness,
)
from winchkit.errors import UsageError
from winchkit.schema.bench import LimitSpec
from winchkit.schema.profiles.winch import CableSpec

LIMITS = LimitSpec(0.5, 1.0, (0.5, 9.0), response_time=0.06)
ARM = 0.005
"""Of the fake drum, m/rad."""


class Held:
    """A winch whose cable is fixed at its far end, an elastic spring, read with a delay."""

    def __init__(self, setting: TensionSetting, stiffness: float, present: float) -> None:
        self.rig = Rig(LIMITS)
        self.rig.axes["A"].lag = 0.02
        self.stiffness, self.present = stiffness, present
        self.read: Callable[[float], TensionReading] = self._true
        self.dead_man = DeadMan(math.inf)
        self.control = TensionControl(
            self.rig.cable(), LIMITS, setting, self._reading, self._trip, dead_man=self.dead_man
        )
        self._past: list[float] = []

    @property
    def wound(self) -> float:
        """Cable wound in since the beginning, m."""
        return self.rig.axes["A"].angle * ARM

    @property
    def tension(self) -> float:
        return max(0.0, self.present + self.stiffness * self.wound)

    def _true(self, _now: float) -> TensionReading:
        self._past.append(self.tension)
        late = max(0, len(self._past) - 1 - round(0.04 / CYCLE))
        return TensionReading(self._past[late], 0.04)

    def _reading(self, now: float) -> TensionReading:
        return self.read(now)

    def _trip(self, words: str) -> None:
        self.rig.supervisor.latch(Trip("tension control", "A", words, latches=True))

    def run(self, duration: float) -> list[float]:
        """Hold it for so long; returns the tension of every cycle, N."""
        self.dead_man.refresh(self.rig.now, self.rig.now + duration)
        self.rig.controller().begin(self.control)
        seen = []
        for _ in range(round(duration / CYCLE)):
            self.rig.step()
            seen.append(self.tension)
        return seen


def setting(tension: float = 200.0, stiffness: float = 2e4, travel: float = 0.05) -> TensionSetting:
    return TensionSetting(tension, travel, 0.02, stiffness, 0.12, 0.25)


@settings(max_examples=4, deadline=None)
@given(stiffness=st.floats(5e3, 2e4), present=st.floats(50.0, 400.0), wanted=st.floats(60.0, 400.0))
def test_the_tension_converges_without_overshoot_up_to_the_declared_stiffness(
    stiffness: float, present: float, wanted: float
) -> None:
    held = Held(setting(wanted, travel=0.1), stiffness, present)
    seen = held.run(12.0)
    assert seen[-1] == pytest.approx(wanted, abs=2.0)
    low, high = sorted((present, wanted))
    margin = 0.05 * (high - low) + 0.5
    assert low - margin <= min(seen)
    assert max(seen) <= high + margin


def test_it_starts_without_a_step() -> None:
    held = Held(setting(), 2e4, 100.0)
    held.run(1.0)
    steps = [abs(b - a) for a, b in zip(held.rig.speeds, held.rig.speeds[1:], strict=False)]
    assert max(steps) <= LIMITS.acceleration * CYCLE + 1e-9


@settings(max_examples=6, deadline=None)
@given(
    values=st.lists(
        st.one_of(st.floats(-1e4, 1e4), st.just(math.nan), st.just(0.0)), min_size=1, max_size=6
    ),
    age=st.floats(0.0, 0.4),
    travel=st.floats(0.01, 0.1),
)
def test_whatever_the_cell_reads_the_winch_stays_within_the_travel(
    values: list[float], age: float, travel: float
) -> None:
    held = Held(setting(travel=travel), 2e4, 100.0)
    begin = held.rig.now

    def read(now: float) -> TensionReading:
        return TensionReading(values[min(int(now - begin), len(values) - 1)], age)

    held.read = read
    farthest = 0.0
    held.dead_man = DeadMan(held.rig.now + 6)
    held.control.dead_man = held.dead_man
    held.rig.controller().begin(held.control)
    for _ in range(round(6 / CYCLE)):
        held.rig.step()
        farthest = max(farthest, abs(held.wound))
    assert farthest <= travel
    if age > 0.25:
        assert farthest == 0.0, "too old a reading moves nothing"


@pytest.mark.parametrize(("reads", "stiffness"), [(0.0, 0.0), (30.0, 2e4)])
def test_a_broken_cable_and_a_cell_that_stands_still_trip_at_the_travel(
    reads: float, stiffness: float
) -> None:
    held = Held(setting(travel=0.02), stiffness, reads)
    held.read = lambda _now: TensionReading(reads, 0.0)
    held.run(4.0)
    assert [trip.kind for trip in held.rig.supervisor.tripped] == ["tension control"]
    assert "20 mm of cable" in held.rig.supervisor.tripped[0].message
    assert held.rig.controller().phase is Phase.DISABLED
    assert 0.01 < abs(held.wound) <= 0.02


def test_silence_of_the_commander_ends_it_at_rest() -> None:
    held = Held(setting(400.0), 2e4, 100.0)
    held.control.dead_man = DeadMan(held.rig.now + 0.2)
    held.rig.controller().begin(held.control)
    held.rig.run(1.0)
    assert held.rig.controller().phase is Phase.DISABLED
    assert held.rig.axes["A"].velocity == 0.0


def test_the_stiffness_is_bounded_by_what_is_known_of_the_cable() -> None:
    steel = greatest_stiffness(CableSpec(diameter=4e-3), 2.0, None)
    assert steel == pytest.approx(210e9 * math.pi * 4e-6 / 2.0)
    known = CableSpec(axial_stiffness=1e5, dead_length=1.0)
    assert greatest_stiffness(known, 1.0, None) == pytest.approx(5e4)
    assert greatest_stiffness(known, 1.0, 7.0) == 7.0
    with pytest.raises(UsageError, match="neither axial_stiffness nor diameter"):
        greatest_stiffness(CableSpec(), 2.0, None)


class Breaking(Held):
    """Its cable breaks at a time: nothing pulls any more."""

    breaks = math.inf

    @property
    def tension(self) -> float:
        return 0.4 if self.rig.now >= self.breaks else super().tension


def half(tension: float = 200.0, **kwargs: float) -> TensionSetting:
    """Without a declared ``tension_slack``."""
    return replace(setting(tension, **kwargs), slack=tension / 2)


@pytest.mark.parametrize("after", [0.5, 4.0])
@pytest.mark.parametrize("present", [120.0, 400.0])
def test_a_cable_that_breaks_under_control_trips_within_a_third_of_a_second(
    after: float, present: float
) -> None:
    held = Breaking(half(travel=0.1), 2e4, present)
    held.breaks = held.rig.now + after
    held.rig.controller().begin(held.control)
    while not held.rig.supervisor.tripped:
        held.rig.step()
        assert held.rig.now < held.breaks + 0.3
    assert held.rig.now >= held.breaks
    (trip,) = held.rig.supervisor.tripped
    assert trip.kind == "tension control"
    assert "0.4 N, below 100.0 N" in str(trip)
    held.rig.run(0.5)
    assert held.rig.controller().phase is Phase.DISABLED


def test_a_cable_that_is_slack_at_first_is_wound_in_by_what_its_stiffness_explains() -> None:
    """200 N at 20 kN/m are 10 mm; the winch takes 0.2 s more to trip."""
    held = Held(half(travel=0.1), 0.0, 0.0)
    held.run(6.0)
    (trip,) = held.rig.supervisor.tripped
    assert "below 100.0 N" in str(trip)
    assert 0.01 < held.wound < 0.01 + 0.02 * 0.3


@settings(max_examples=6, deadline=None)
@given(softer=st.floats(1.0, 10.0), present=st.floats(1.0, 60.0), slack=st.floats(0.0, 6e-3))
def test_a_cable_softer_than_its_bound_and_a_little_slack_comes_to_the_tension(
    softer: float, present: float, slack: float
) -> None:
    """Slack of less than the 6 mm that 120 N at 20 kN/m explain; more of it trips, as above."""
    held = Held(half(120.0, travel=0.1), 2e4 / softer, present - slack * 2e4 / softer)
    held.run(40.0)
    assert not held.rig.supervisor.tripped
    assert held.tension == pytest.approx(120.0, abs=20.0)


def test_a_load_that_swings_is_no_broken_cable() -> None:
    held = Held(half(), 2e4, 200.0)
    begin = held.rig.now

    def swinging(now: float) -> TensionReading:
        relieved = (now - begin) % 1.0 > 0.85
        return TensionReading(20.0 if relieved else 200.0, 0.01)

    held.read = swinging
    held.run(5.0)
    assert not held.rig.supervisor.tripped

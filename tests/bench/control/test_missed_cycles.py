"""Periods of control without a cycle: each is counted, none has two, and motions take no longer."""

from __future__ import annotations

import math
import threading
import time
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fake_axis import CYCLE, Rig
from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.control.supervisor import Supervisor
from winchkit.schema.bench import LimitSpec

# In cycles; never a whole number of them, where rounding would decide.
DELAYS = st.integers(0, 60).map(lambda tenths: (tenths + 0.37) / 10)
PROMPT = 1e-3


class _StalledClock:
    """Each sleep ends late, as the script says, in cycles; at its end time stands still."""

    def __init__(self, script: list[float]) -> None:
        self.time, self.over = 100.0, threading.Event()
        self._script = list(script)

    def now(self) -> float:
        return self.time

    def sleep(self, duration: float) -> None:
        if not self._script:
            self.over.set()
            time.sleep(PROMPT)
            return
        self.time += max(0.0, duration) + self._script.pop(0) * CYCLE


def _run(script: list[float], work: list[float]) -> list[BenchSnapshot]:
    """The cycles of a loop whose sleeps end late, and whose cycles take their time (cycles)."""
    clock, seen = _StalledClock(script), list[BenchSnapshot]()
    loop = ControlLoop([], {}, Supervisor({}), clock, CYCLE)

    def sample(snapshot: BenchSnapshot) -> None:
        if len(seen) <= len(script):
            seen.append(snapshot)
            clock.time += work[len(seen) - 1] * CYCLE if len(seen) <= len(work) else 0.0

    loop.samplers.append(sample)
    loop.start()
    assert clock.over.wait(5.0)
    loop.close()
    return seen


@settings(deadline=None, max_examples=10)
@given(st.lists(st.tuples(DELAYS | st.just(PROMPT), DELAYS | st.just(PROMPT)), min_size=1))
def test_every_period_without_a_cycle_is_counted(delays: list[tuple[float, float]]) -> None:
    seen = _run([late for late, _ in delays], [took for _, took in delays])
    begin = seen[0].time
    periods = [math.floor((one.time - begin) / CYCLE + 1e-6) for one in seen]
    assert len(set(periods)) == len(periods), "two cycles in one period"
    for count, (one, period) in enumerate(zip(seen, periods, strict=True), start=1):
        assert one.overruns == period + 1 - count


def test_a_gap_of_more_than_two_cycles_is_reported_by_the_cycle_that_ends_it() -> None:
    seen = _run([PROMPT, 1.5, PROMPT, 10.3, PROMPT, 0.9, PROMPT], [])
    gaps = [(b.time - a.time) / CYCLE for a, b in pairwise(seen)]
    counted = [b.overruns - a.overruns for a, b in pairwise(seen)]
    assert [gap > 2.05 for gap in gaps] == [False, True, False, True, False, False, False]
    assert counted == [0, 1, 0, 10, 0, 0, 0]


_LIMITS = LimitSpec(speed=0.5, acceleration=1.0, length=(3.0, 4.2), response_time=0.06)


def step(rig: Rig, missed: int = 0) -> None:
    """A cycle after ``missed`` ones that did not begin; the drive kept its speed meanwhile."""
    rig.now += missed * CYCLE
    rig.now += CYCLE
    rig.cells["A"].read(100.0, rig.now)
    rig.loop.step(rig.now, missed)


@pytest.mark.parametrize("every", [0, 2, 3, 5])
def test_braking_before_a_limit_is_not_later_where_cycles_are_missed(every: int) -> None:
    """Four cycles of five missed, as often as ``every`` says: it rests before the limit of 3 m."""
    rig = Rig(_LIMITS, cell=True)
    rig.jog(0.5)
    shortest = 4.0
    for number in range(1500):
        step(rig, 4 if every and number % every == 0 else 0)
        shortest = min(shortest, 4.0 - 0.005 * rig.axes["A"].angle)
    assert not rig.supervisor.tripped
    assert 3.0 - 1e-3 < shortest < 3.03
    assert rig.axes["A"].velocity == pytest.approx(0.0, abs=0.2)


@pytest.mark.parametrize(("position_mode", "changes"), [(False, 5), (True, 1)])
def test_a_ramp_goes_on_in_missed_cycles_unless_the_drive_waited(
    position_mode: bool, changes: int
) -> None:
    """A drive that follows positions stands at its last one until the next comes."""
    rig = Rig(_LIMITS, cell=True)
    rig.jog(0.5)
    rig.axes["A"].position_mode = position_mode
    for _ in range(40):
        step(rig)
    before = rig.controller().commanded
    assert 0.05 < before < 0.3
    step(rig, 4)
    grown = rig.controller().commanded - before
    assert grown == pytest.approx(changes * CYCLE * _LIMITS.acceleration, rel=1e-6)

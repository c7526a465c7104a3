"""A period of control without a cycle is counted, and no period has two cycles."""

from __future__ import annotations

import math
import threading
import time
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.control.supervisor import Supervisor

CYCLE = 0.004
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

"""A drive that hears no stop any more is stopped by its own watchdog."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

from winchkit import catalog, open_bench
from winchkit.bench.bench import Bench
from winchkit.errors import LimitTripped
from winchkit.schema.read import read_simbench
from winchkit.sim.live import LiveBench
from winchkit.sim.pace import PacedClock

pytestmark = pytest.mark.realtime


@pytest.fixture
def clock() -> PacedClock:
    return PacedClock()


@pytest.fixture
def live(clock: PacedClock) -> Iterator[LiveBench]:
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    with LiveBench(declared, clock=clock.simulation) as running:
        yield running


@pytest.fixture
def bench(live: LiveBench, clock: PacedClock) -> Iterator[Bench]:
    with open_bench(live.bench_spec, clock) as opened:
        opened.on_cycle(clock.control)
        yield opened


def test_a_lost_map_leaves_no_winch_running(
    bench: Bench, live: LiveBench, clock: PacedClock
) -> None:
    winch, truth = bench.winch["A"], live.winches["A"].plant
    bench.on_cycle(lambda _snapshot: {"A": -0.1})
    deadline = time.monotonic() + 15
    while abs(truth.motor_velocity) < 1.0:
        assert time.monotonic() < deadline, "it did not move"
        time.sleep(0.01)
    live.inject("A.servo", "map lost")
    lost = clock.now()
    while abs(truth.motor_velocity) > 0.05:
        assert time.monotonic() < deadline, "it runs on"
        time.sleep(0.01)
    # Stale after 0.2 s, half a second for the stop to be heeded, its watchdog, its ramp.
    assert clock.now() - lost < 1.5
    assert {"feedback", "deaf"} <= {trip.kind for trip in bench.snapshot.tripped}
    bench.loop.callbacks[1:] = []
    with pytest.raises(LimitTripped, match="does not heed the stop"):
        winch.move_by(0.1, 0.1)
    bench.reset()
    before = truth.cable_length
    winch.move_by(0.1, 0.1)
    assert truth.cable_length - before == pytest.approx(0.1, abs=5e-3)

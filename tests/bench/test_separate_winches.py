"""``stop_together = false``: winches that have nothing to do with each other on one bench."""

from __future__ import annotations

from dataclasses import replace

import pytest

from winchkit import catalog, open_bench
from winchkit.bench.control.snapshot import Phase
from winchkit.schema.read import read_simbench
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench


def declared() -> SimBench:
    """The shipped spiral bench twice, without instruments."""
    sim = read_simbench(catalog.find("sim", "spiral-bench"))
    one = replace(sim.bench.winch["A"], cell=None, length=None, temperature=None)
    winches = {
        name: replace(one, servo=replace(one.servo, node=number))
        for number, name in enumerate("AB", start=1)
    }
    buses = {"can": sim.bench.bus["can"]}
    bench = replace(sim.bench, winch=winches, bus=buses, cycle=0.01, stop_together=False)
    return replace(sim, bench=bench, truth=dict.fromkeys(winches, sim.truth["A"]))


def test_a_stop_of_one_leaves_the_other_going() -> None:
    clock = SimulatedClock()
    with (
        LiveBench(declared(), seed=1, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        bench.move_together({"A": 3.0, "B": 3.0}, speed=0.1, wait=False)
        while abs(bench.winch["A"].snapshot.cable_speed) < 0.05:
            bench.raise_trouble()
            clock.sleep(0.02)
        bench.winch["A"].stop()
        bench.raise_trouble()
        assert bench.winch["A"].snapshot.phase is Phase.DISABLED
        assert bench.winch["B"].moving
        assert bench.winch["B"].snapshot.cable_speed == pytest.approx(-0.1, abs=0.03)

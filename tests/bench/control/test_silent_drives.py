"""A drive that receives no RPDO any more is stopped by SDO."""

from __future__ import annotations

from dataclasses import replace

import pytest

from winchkit import catalog, open_bench
from winchkit.errors import LimitTripped
from winchkit.schema.read import read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench
from winchkit.testing.plugin import SimBenchFixture


def test_a_lost_map_leaves_no_winch_running(sim_bench: SimBenchFixture) -> None:
    sim = sim_bench("spiral-bench")
    bench, clock = sim.bench, sim.clock
    winch, truth = bench.winch["A"], sim.live.winches["A"].plant
    bench.on_cycle(lambda _snapshot: {"A": -0.1})
    deadline = clock.now() + 15
    while abs(truth.motor_velocity) < 1.0:
        assert clock.now() < deadline, "it did not move"
        clock.sleep(0.01)
    sim.fault("A.servo", "map lost")
    lost = clock.now()
    while abs(truth.motor_velocity) > 0.05:
        assert clock.now() < deadline, "it runs on"
        clock.sleep(0.01)
    # Stale after 0.1 s, a stop by RPDO that is not heard, one by SDO, its ramp.
    assert clock.now() - lost < 0.5
    assert [trip.kind for trip in bench.snapshot.tripped] == ["feedback"]
    bench.loop.callbacks.clear()
    with pytest.raises(LimitTripped, match="no complete feedback"):
        winch.move_by(pay_out=0.1, speed=0.1)
    bench.reset()
    before = truth.cable_length
    winch.move_by(pay_out=0.1, speed=0.1)
    assert truth.cable_length - before == pytest.approx(0.1, abs=5e-3)


def test_a_bench_of_a_long_cycle_closes_beside_a_dead_drive() -> None:
    """Closing lets 50 cycles pass for the quick stop, 2 s of these: that is no loop that hangs."""
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    declared = replace(declared, bench=replace(declared.bench, cycle=0.04))
    clock = SimulatedClock()
    with LiveBench(declared, simulated_time=clock) as live:
        with open_bench(live.bench_spec, clock) as bench:
            bench.winch["A"].move_by(pay_out=0.01, speed=0.1, hold=True)
            live.inject("A.servo", "silence")
            clock.sleep(1.0)
            assert bench.snapshot.tripped
            closing = clock.now()
        # A stop that is not obeyed within 5 s, then the quick stop.
        assert clock.now() - closing == pytest.approx(7.0, abs=1.5)

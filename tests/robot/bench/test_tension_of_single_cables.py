"""Of a robot's cables no more are held by their tension than the platform leaves free."""

from __future__ import annotations

from dataclasses import replace

import pytest

from winchkit.bench.open import open_bench
from winchkit.catalog import find
from winchkit.errors import NotPermitted
from winchkit.schema.read import read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench


@pytest.mark.slow
def test_two_of_eight_cables_may_hold_their_tension() -> None:
    sim = read_simbench(find("sim", "cabtive-robot"))
    sim = replace(sim, bench=replace(sim.bench, cycle=0.04))
    clock = SimulatedClock()
    with LiveBench(sim, simulated_time=clock) as live, open_bench(live.bench_spec, clock) as bench:
        clock.sleep(0.5)
        for name in "12":
            tension = bench.winch[name].tension
            bench.winch[name].hold_tension(tension, stiffness=2e5, hold=1.0)
        with pytest.raises(NotPermitted, match=r"winch 3 .* beside 1, 2: .* leaves 2 free"):
            bench.winch["3"].hold_tension(bench.winch["3"].tension, stiffness=2e5)
        assert not bench.winch["3"].moving
        bench.winch["1"].refresh()
        bench.stop()
        clock.sleep(1.0)
        tension = bench.winch["3"].tension
        bench.winch["3"].hold_tension(tension, stiffness=2e5, duration=0.5)


@pytest.mark.slow
def test_of_a_platform_that_hangs_on_four_cables_none_may() -> None:
    sim = read_simbench(find("sim", "hanging-robot"))
    clock = SimulatedClock()
    with LiveBench(sim, simulated_time=clock) as live, open_bench(live.bench_spec, clock) as bench:
        clock.sleep(0.5)
        for name, winch in bench.winch.items():
            with pytest.raises(NotPermitted, match=rf"winch {name} .* leaves 0 free"):
                winch.hold_tension(winch.tension, stiffness=2e5)
            assert not winch.moving

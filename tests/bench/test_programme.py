"""A motion programme that somebody stops, in simulated time."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit import catalog, open_bench
from winchkit.bench.programme import run_programme
from winchkit.errors import MotionError
from winchkit.runs import read_run
from winchkit.schema.programme import Programme, Step
from winchkit.schema.read import read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench


def test_a_stop_during_a_hold_ends_the_programme_and_keeps_its_log(tmp_path: Path) -> None:
    """The winch stands then, so that the stop ends no motion; the next one must not begin."""
    declared = read_simbench(catalog.find("sim", "demo-adequate"))
    steps = (Step(by=-0.1, speed=0.4), Step(hold=2.0), Step(by=-0.5, speed=0.4))
    clock, places = SimulatedClock(), []
    with (
        LiveBench(declared, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        plant = live.winches["A"].plant

        def stop(_repeat: int, _number: int, step: Step) -> None:
            if step.hold is not None:
                places.append(plant.cable_length)
                bench.stop_now()

        with pytest.raises(MotionError, match="stopped the bench between two motions"):
            run_programme(
                bench, Programme("held", steps), tmp_path, lambda _step: None, progress=stop
            )
        clock.sleep(0.5)
        assert bench.snapshot.at_rest
        assert plant.cable_length == pytest.approx(places[0], abs=1e-3)
    assert len(read_run(tmp_path / "held-10kg-1.csv")) > 5

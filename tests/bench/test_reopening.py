"""An adapter that was unplugged: everything stops, and a reset opens its bus again."""

from __future__ import annotations

from dataclasses import replace

import pytest

from winchkit import catalog, open_bench
from winchkit.bench.control.snapshot import Phase
from winchkit.errors import ConnectionLost, LimitTripped
from winchkit.schema.read import read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench


def test_a_reset_opens_a_bus_that_went_down(monkeypatch: pytest.MonkeyPatch) -> None:
    sim = read_simbench(catalog.find("sim", "spiral-bench"))
    winch = replace(sim.bench.winch["A"], cell=None, length=None, temperature=None)
    buses = {"can": sim.bench.bus["can"]}
    sim = replace(sim, bench=replace(sim.bench, winch={"A": winch}, bus=buses))
    clock = SimulatedClock()
    with (
        LiveBench(sim, seed=1, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        bus = bench._wired.buses["can"]
        bench.winch["A"].move_to(3.0, 0.1, wait=False)
        while abs(bench.winch["A"].snapshot.cable_speed) < 0.05:
            bench.raise_trouble()
            clock.sleep(0.02)

        def unplugged(_identifier: int, _data: bytes) -> None:
            raise OSError(19, "No such device")

        monkeypatch.setattr(bus._port, "send", unplugged)
        with pytest.raises(LimitTripped, match="No such device"):
            bench.winch["A"].wait()
        # The drive, which no longer receives the host, stops by itself.
        while abs(live.winches["A"].plant.motor_velocity) > 0.1:
            clock.sleep(0.05)
        with pytest.raises((LimitTripped, ConnectionLost)):
            bench.winch["A"].move_to(3.2)
        assert bus.reopened == 0
        bench.reset()
        assert bus.reopened == 1
        assert bench.winch["A"].snapshot.phase is Phase.DISABLED
        bench.winch["A"].move_by(pay_out=0.05)

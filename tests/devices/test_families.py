"""Every drive that has a device file: its simulated one is commissioned and jogged by ours."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from winchkit import catalog, open_bench
from winchkit.bench.control.snapshot import Phase
from winchkit.schema.devices.servo import ServoSpec
from winchkit.schema.read import read_device, read_simbench
from winchkit.schema.simbench import NoiseSpec, SimBench
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.paced_clock import PacedClock


def servo_of(name: str) -> ServoSpec | None:
    return read_device(catalog.find("devices", name)).servo


DRIVES = [name for name in catalog.names("devices") if servo_of(name) is not None]


def bench_with(device: str) -> SimBench:
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    wiring = declared.bench.winch["A"]
    wiring = replace(wiring, servo=replace(wiring.servo, device=device))
    bench = replace(declared.bench, winch={"A": wiring})
    return replace(declared, bench=bench, noise=NoiseSpec(), fault=())


@pytest.fixture
def clock() -> PacedClock:
    return PacedClock()


@pytest.fixture
def live(request: pytest.FixtureRequest, clock: PacedClock) -> Iterator[LiveBench]:
    with LiveBench(bench_with(request.param), seed=3, clock=clock.simulation) as running:
        yield running


def test_there_are_the_families_of_a_winch_bench() -> None:
    assert len(DRIVES) >= 8
    makers = {read_device(catalog.find("devices", name)).maker for name in DRIVES}
    assert len(makers) >= 7


@pytest.mark.realtime
@pytest.mark.parametrize("live", DRIVES, indirect=True)
def test_its_simulated_drive_is_commissioned_and_jogged(live: LiveBench, clock: PacedClock) -> None:
    with open_bench(live.bench_spec, clock) as bench:
        bench.on_cycle(clock.control)
        winch = bench.winch["A"]
        start, plant = winch.cable_length, live.winches["A"].plant
        turned, wound = plant.motor_angle, plant.cable_length
        if not winch.snapshot.length_known:
            winch.home(at=wound)
            start = winch.cable_length
        winch.jog(wind_in=0.2, duration=0.5)
        assert winch.snapshot.phase is Phase.DISABLED
        gone = start - winch.cable_length
        # The ramp at its end makes up for that at its begin.
        assert gone == pytest.approx(0.2 * 0.5, abs=0.02)
        assert wound - plant.cable_length == pytest.approx(gone, abs=2e-3)
        assert plant.motor_angle - turned > 10.0
        snapshot = winch.snapshot
        assert math.isfinite(snapshot.cable_speed)
    assert abs(plant.motor_velocity) < 1e-3

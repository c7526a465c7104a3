"""Quick stops of a moving platform: 6085h of each drive, and the time until each cable rests."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from bare_winches import bare_winches
from winchkit import open_bench
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.schema.robot_bench import RobotWiring
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

NAMES = "12345678"
DECELERATION = 0.25
ROBOT = RobotWiring("cabtive", speed=0.1, tension=(5.0, 300.0), quick_stop=DECELERATION)


@pytest.fixture(scope="module")
def slowing() -> Iterator[Bench]:
    clock = SimulatedClock()
    sim = bare_winches(NAMES, cycle=0.02, heartbeat=0.2)
    sim = replace(sim, bench=replace(sim.bench, robot=ROBOT))
    with (
        LiveBench(sim, seed=1, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        yield bench


def ramps(bench: Bench) -> np.ndarray:
    """6085h of each drive as deceleration of its cable, m/s^2."""
    out = []
    for name in NAMES:
        axis, winch = bench.axes[name], bench.winch[name]
        assert axis.drive is not None
        counts = int(axis.objects.read(0x6085))
        arm = abs(winch.cable.at(winch.snapshot.motor_angle)[1])
        out.append(counts * axis.drive.scale.velocity * arm)
    return np.array(out)


@pytest.mark.slow
def test_all_cables_of_a_platform_stop_in_the_same_time(slowing: Bench) -> None:
    platform = slowing.robot
    assert ramps(slowing) == pytest.approx(np.full(8, DECELERATION), rel=0.01), "declared"
    platform.move(platform.moved({"x": 0.08, "y": 0.03}, relative=True), wait=False)
    slowing.clock.sleep(1.0)
    seen: list[BenchSnapshot] = []
    slowing.loop.samplers.append(seen.append)
    begin = slowing.clock.now()
    slowing.stop_now()
    slowing.loop.samplers.pop()
    scaled = ramps(slowing)
    assert scaled.max() == pytest.approx(DECELERATION, rel=0.01)
    assert scaled.min() < 0.7 * DECELERATION
    speed = np.abs([[one.winch[name].cable_speed for name in NAMES] for one in seen])
    quick = speed[0] > 0.2 * speed[0].max()
    assert np.ptp(speed[0][quick]) > 0.3 * speed[0].max(), "cables of different speeds"
    moving = speed > 0.1 * speed[0]
    rest = [seen[int(np.flatnonzero(row)[-1])].time - begin for row in moving.T[quick]]
    expected = speed[0].max() / DECELERATION
    assert max(rest) - min(rest) < 0.2 * expected, "all within a fifth of the common time"
    assert max(rest) == pytest.approx(expected, abs=0.2 * expected + 0.04)


def test_a_motion_of_one_winch_has_the_declared_ramp(slowing: Bench) -> None:
    platform = slowing.robot
    platform.move(platform.moved({"x": -0.02}, relative=True))
    assert ramps(slowing).min() < 0.9 * DECELERATION
    slowest = NAMES[int(np.argmin(ramps(slowing)))]
    slowing.winch[slowest].move_by(pay_out=0.002)
    found = ramps(slowing)[NAMES.index(slowest)]
    assert found == pytest.approx(DECELERATION, rel=0.01)

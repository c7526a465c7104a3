"""Eight simulated winches that move the platform of a robot, in simulated time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from bare_winches import bare_winches
from winchkit import open_bench
from winchkit.bench.bench import Bench
from winchkit.schema.robot_bench import RobotWiring
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

NAMES = "12345678"
ROBOT = RobotWiring("cabtive", speed=0.1, tension=(5.0, 300.0), acceleration=0.3)


@pytest.fixture(scope="package")
def robot_clock() -> SimulatedClock:
    return SimulatedClock()


@pytest.fixture(scope="package")
def live(robot_clock: SimulatedClock) -> Iterator[LiveBench]:
    sim = bare_winches(NAMES, cycle=0.02, heartbeat=0.2)
    sim = replace(sim, bench=replace(sim.bench, robot=ROBOT))
    with LiveBench(sim, seed=1, simulated_time=robot_clock) as running:
        yield running


@pytest.fixture(scope="package")
def opened(live: LiveBench, robot_clock: SimulatedClock) -> Iterator[Bench]:
    with open_bench(live.bench_spec, robot_clock) as bench:
        yield bench


@pytest.fixture
def bench(opened: Bench) -> Bench:
    """At home."""
    home = opened.robot.robot.home
    opened.robot.move(home)
    return opened

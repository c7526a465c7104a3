"""What a robot's motions need is imported before the control loop starts."""

from __future__ import annotations

import subprocess
import sys

import pytest

SCRIPT = """
import sys
from dataclasses import replace
from winchkit import open_bench
from winchkit.catalog import find
from winchkit.schema.read import read_simbench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

clock = SimulatedClock()
sim = read_simbench(find("sim", "cabtive-robot"))
sim = replace(sim, bench=replace(sim.bench, cycle=0.04))
with LiveBench(sim, simulated_time=clock) as live, open_bench(live.bench_spec, clock) as bench:
    before = set(sys.modules)
    goal = bench.robot.moved({"x": 0.005, "yaw": 0.01}, relative=True)
    bench.robot.move(goal)
    print(*sorted(set(sys.modules) - before))
"""


@pytest.mark.slow
def test_a_motion_imports_nothing() -> None:
    """An import holds the interpreter lock for tens of milliseconds, and delays the loop."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []

"""Cable forces of the simulated robot before and after a correction of its preload.

    python benchmarks/robot_trim.py --seed 1 --json

The shipped ``winding-device-robot`` in simulated time. The platform moves to a random pose, one
winch winds in 3 mm, then ``bench.robot.trim`` corrects. The result is the true deviation of the
cable forces from the distribution, root mean square over the cables, of those forces that balance
each other, and how far the platform moved. The profile has no pulley friction, the simulated robot
has: the error that is left is that of the cells behind the pulleys.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace

import numpy as np

from winchkit import find, open_bench, read_simbench
from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.robot import quadratic
from winchkit.robot.forces.force_distribution import null_space
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

STIFFNESS = 250e3
"""Declared upper bound of EA, N: the simulated cables have 200 kN."""
WOUND = 3e-3
"""By which one cable is disturbed, m."""


def measured(bench: Bench, live: LiveBench) -> tuple[float, float, Array]:
    """True deviation of the forces, that of the readings (N), and the true place (m)."""
    assert live.robot is not None
    platform = bench.robot
    pose, robot = platform.pose, platform.robot
    structure = robot.structure(pose)[0]
    wanted = quadratic(structure, robot.weight(pose)[0], platform.planner.tension).value
    null = null_space(structure)

    def deviation(force: Array) -> float:
        return float(np.sqrt(np.mean((null @ null.T @ (force - wanted)) ** 2)))

    shown = np.array([bench.winch[name].tension for name in robot.names])
    with live.up_to_date():
        truth, place = live.robot.platform.tension, live.robot.platform.position
        return deviation(np.array(truth)), deviation(shown), place


def main() -> int:
    """Exit 1 where the correction leaves more than it found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    sim = read_simbench(find("sim", "winding-device-robot"))
    bus = {**sim.bench.bus, "can": replace(sim.bench.bus["can"], heartbeat=0.1)}
    sim = replace(sim, bench=replace(sim.bench, cycle=0.02, bus=bus))
    clock = SimulatedClock()
    with (
        LiveBench(sim, seed=asked.seed, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        clock.sleep(0.3)
        x, y, z = random.uniform(-0.1, 0.1, 3).tolist()
        bench.robot.move(bench.robot.moved({"x": x, "y": y, "z": z}, relative=True), 0.1)
        clock.sleep(0.5)
        moved = measured(bench, live)
        bench.winch[str(random.integers(1, 9))].move_by(wind_in=WOUND, speed=0.01)
        clock.sleep(0.5)
        disturbed = measured(bench, live)
        bench.robot.trim(axial_stiffness=STIFFNESS, duration=6.0)
        clock.sleep(0.5)
        trimmed = measured(bench, live)
    result = {
        "schema": 1,
        "moved_N": round(moved[0], 2),
        "without_N": round(disturbed[0], 2),
        "with_N": round(trimmed[0], 2),
        "readings_without_N": round(disturbed[1], 2),
        "readings_with_N": round(trimmed[1], 2),
        "displaced_mm": round(1e3 * float(np.linalg.norm(trimmed[2] - disturbed[2])), 3),
    }
    sys.stdout.write((json.dumps(result) if asked.json else f"{result}") + "\n")
    return int(trimmed[0] > disturbed[0])


if __name__ == "__main__":
    sys.exit(main())

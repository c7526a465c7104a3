"""Random trajectories of a simulated robot: platform on eight elastic cables, in simulated time.

    python benchmarks/robot_trajectories.py --trajectories 1000 --seed 1 --json

The robot is ``cabtive-robot`` with the geometry of its profile: the bench knows it, so that what is
measured is planning and motion. Each goal is random in a box about home; one that the planner
refuses is counted and replaced. Of every control cycle: distance of the true platform from the
planned line, and true cable forces at the platform. Per trajectory besides: margin of the planned
forces to the tension limits by a linear programme at places between the samples of the planner,
which uses another method.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from winchkit import find, open_bench, read_simbench
from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.errors import NotPermitted
from winchkit.robot import dynamic_wrench, wrench_feasibility
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.trajectory import PlatformTrajectory, motion_at
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

BOX = np.array([0.075, 0.075, 0.075, 0.131, 0.131, 0.131])
"""Half the edges of the box of goals about home, m and rad: those of CABTIVE's calibration."""
PLACES = 20
"""Of a trajectory at which the forces are tested."""
STATED = 2e-3
"""Stated path error, m. The plan takes the cables as stiff; one of 1.6 m and 20 kN lengthens by
2 mm where its force changes by 25 N on the way."""
NAMES = ("x", "y", "z", "roll", "pitch", "yaw")


def known_robot() -> SimBench:
    """The shipped simulated robot with the exit points, anchors and radii of its profile."""
    sim = read_simbench(find("sim", "cabtive-robot"))
    assert sim.platform is not None
    return replace(sim, platform=replace(sim.platform, geometry=0.0, winding_radius=0.0))


def forces_margin(bench: Bench, planned: PlatformTrajectory, random: np.random.Generator) -> float:
    """Least margin of feasible forces to their limits at random places, N."""
    robot = bench.robot.robot
    time = random.uniform(0.0, planned.duration, PLACES)
    distance, rate, change = planned.profile.at(time)
    motion = motion_at(planned.path, distance, rate, change)
    structure, wrench = robot.structure(motion.pose), dynamic_wrench(robot.platform, motion)
    limits = bench.robot.planner.tension
    return min(
        wrench_feasibility(matrix, load, limits).margin
        for matrix, load in zip(structure, wrench, strict=True)
    )


def deviation(places: Array, planned: PlatformTrajectory) -> float:
    """Largest distance of places of the platform (k, 3) from the planned line, m."""
    start, end = planned.pose.position[0], planned.pose.position[-1]
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length if length > 0 else np.zeros(3)
    off = places - start
    share = np.clip(off @ along, 0.0, length)
    return float(np.linalg.norm(off - np.outer(share, along), axis=1).max())


def measure(trajectories: int, seed: int) -> dict[str, Any]:
    """Move along random trajectories; the figures."""
    random, clock, started = np.random.default_rng(seed), SimulatedClock(), process_time()
    margins: list[float] = []
    errors: list[float] = []
    steps: list[float] = []
    forces: list[tuple[float, float]] = []
    refused, seconds = 0, 0.0
    with (
        LiveBench(known_robot(), seed=seed, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        assert live.robot is not None
        truth, platform = live.robot.platform, bench.robot
        home, limits = platform.coordinates(), platform.planner.tension
        places: list[Array] = []
        tension: list[Array] = []

        def sample(_snapshot: BenchSnapshot) -> None:
            places.append(truth.position)
            tension.append(truth.tension)

        bench.loop.samplers.append(sample)
        preload: Array | None = None
        here = platform.pose
        while len(errors) < trajectories:
            values = [home[name] for name in NAMES] + random.uniform(-BOX, BOX)
            goal = platform.moved(dict(zip(NAMES, values.tolist(), strict=True)), relative=False)
            try:
                (planned,) = platform.planner.plan(
                    [Waypoint(goal.position[0], goal.rotation[0])], here
                )
            except NotPermitted:
                refused += 1
                continue
            places.clear()
            tension.clear()
            preload = platform.begin(planned, hold=True, preload=preload)
            platform.wait()
            here = goal
            seconds += planned.duration
            errors.append(deviation(np.array(places), planned))
            forces.append((float(np.min(tension)), float(np.max(tension))))
            margins.append(forces_margin(bench, planned, random))
            steps.append(float(np.abs(np.diff(planned.force, axis=0)).max()))
    least, most = np.array(forces).T
    return {
        "schema": 1,
        "trajectories": len(errors),
        "refused": refused,
        "seconds": seconds,
        "slack": int(np.sum(least <= 0)),
        "above_limit": int(np.sum(most > limits.high)),
        "least_force_N": float(least.min()),
        "largest_force_N": float(most.max()),
        "forces_beyond_limits": sum(margin < 0 for margin in margins),
        "least_margin_N": min(margins),
        "off_path": sum(error > STATED for error in errors),
        "stated_path_error_mm": STATED * 1e3,
        "largest_path_error_mm": max(errors) * 1e3,
        "median_path_error_mm": float(np.median(errors)) * 1e3,
        "largest_force_step_N": max(steps),
        "cpu_s": process_time() - started,
    }


def main() -> int:
    """Run it; exit code 1 where a figure is beyond its limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trajectories", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    result = measure(asked.trajectories, asked.seed)
    if asked.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        for key, value in result.items():
            sys.stdout.write(f"{key}: {value}\n")
    bad = ("slack", "above_limit", "forces_beyond_limits", "off_path")
    return int(any(result[key] for key in bad))


if __name__ == "__main__":
    sys.exit(main())

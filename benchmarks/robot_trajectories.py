"""Random trajectories of a platform, moved by eight simulated drives in simulated time.

    python benchmarks/robot_trajectories.py --trajectories 1000 --seed 1 --json

Each goal is random in a box about home; one that the planner refuses is counted and replaced. Per
trajectory: deviation of the pose by the drives' motor angles from the planned line, and margin of
the planned forces to the tension limits by a linear programme at places between the samples of the
planner, which uses another method. The simulated drives carry a weight each and no platform: the
forces are those of the plan, not of a simulated robot.
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
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.robot.path import Waypoint
from winchkit.bench.robot.trajectory import PlatformTrajectory, motion_at
from winchkit.errors import NotPermitted
from winchkit.model.robot import dynamic_wrench, wrench_feasibility
from winchkit.schema.robot_bench import RobotWiring
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

ROBOT = RobotWiring("cabtive", speed=0.2, tension=(5.0, 300.0))
BOX = np.array([0.12, 0.12, 0.12, 0.15, 0.15, 0.15])
"""Half the edges of the box of goals about home, m and rad."""
PLACES = 20
"""Of a trajectory at which the forces are tested."""
STATED = 3e-3
"""Stated path error: lag of speed-controlled drives at a cycle of 20 ms, m."""
NAMES = ("x", "y", "z", "roll", "pitch", "yaw")


def eight_winches() -> SimBench:
    """The shipped spiral bench with eight drives, without instruments."""
    sim = read_simbench(find("sim", "spiral-bench"))
    one = sim.bench.winch["A"]
    winches = {
        str(n): replace(
            one, servo=replace(one.servo, node=n), cell=None, length=None, temperature=None
        )
        for n in range(1, 9)
    }
    bus = {"can": replace(sim.bench.bus["can"], heartbeat=0.2)}
    bench = replace(sim.bench, winch=winches, bus=bus, cycle=0.02, robot=ROBOT)
    return replace(sim, bench=bench, truth=dict.fromkeys(winches, sim.truth["A"]))


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


def deviation(bench: Bench, seen: list[BenchSnapshot], planned: PlatformTrajectory) -> float:
    """Largest distance of the platform by the motor angles from the line, m."""
    robot = bench.robot.robot
    angles = np.array([[one.winch[name].motor_angle for name in robot.names] for one in seen])
    places: Array = robot.poses_at(angles).pose.position
    start, end = planned.pose.position[0], planned.pose.position[-1]
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length if length > 0 else np.zeros(3)
    off = places - start
    return float(np.linalg.norm(off - np.outer(off @ along, along), axis=1).max())


def main() -> int:
    """Run it; exit code 1 where a figure is beyond its limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trajectories", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    clock = SimulatedClock()
    margins, errors, steps, refused = [], [], [], 0
    with (
        LiveBench(eight_winches(), seed=asked.seed, simulated_time=clock) as live,
        open_bench(live.bench_spec, clock) as bench,
    ):
        platform = bench.robot
        home = platform.coordinates()
        seen: list[BenchSnapshot] = []
        bench.loop.samplers.append(seen.append)
        while len(errors) < asked.trajectories:
            values = [home[name] for name in NAMES] + random.uniform(-BOX, BOX)
            goal = platform.moved(dict(zip(NAMES, values.tolist(), strict=True)), relative=False)
            waypoint = Waypoint(goal.position[0], goal.rotation[0])
            try:
                (planned,) = platform.planner.plan([waypoint], platform.pose)
            except NotPermitted:
                refused += 1
                continue
            seen.clear()
            platform.begin(planned, hold=True)
            platform.wait()
            errors.append(deviation(bench, seen, planned))
            margins.append(forces_margin(bench, planned, random))
            steps.append(float(np.abs(np.diff(planned.force, axis=0)).max()))
    slack = sum(margin < 0 for margin in margins)
    off = sum(error > STATED for error in errors)
    result = {
        "schema": 1,
        "trajectories": len(errors),
        "refused": refused,
        "forces_beyond_limits": slack,
        "least_margin_N": min(margins),
        "off_path": off,
        "stated_path_error_mm": STATED * 1e3,
        "largest_path_error_mm": max(errors) * 1e3,
        "largest_force_step_N": max(steps),
    }
    if asked.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        for key, value in result.items():
            sys.stdout.write(f"{key}: {value}\n")
    return int(slack > 0 or off > 0)


if __name__ == "__main__":
    sys.exit(main())

"""What a cable robot's cycle costs, side by side in one run.

``python benchmarks/robot_tick.py [--json] [--robot ipanema3]``: for one pose of eight cables the
inverse kinematics with elongation and drums, the same with Eq. 8's forces and strains found anew,
the inverse dynamics (Newton-Euler, Eq. 8, drums, motor torques), the same with the elongation under
the dynamic wrench, and the forward kinematics warm-started from a pose half a millimetre off, each
in plain Python and compiled (where numba is installed, the ``fast`` extra); inverse and forward
kinematics of many poses at once. Promised: 20 and 2 us for the first, 40 and 4 us for the inverse
dynamics, 200 and 4 us for the forward kinematics, a million poses a second; 1 ms for Eq. 8. Exits
with 1 when a promise is broken.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from importlib.util import find_spec
from time import perf_counter

import numpy as np

from winchkit.catalog import find
from winchkit.model.rotation import rotation_by
from winchkit.robot import (
    PLAIN,
    DynamicsCycle,
    LinearLaw,
    Pose,
    Robot,
    RobotCycle,
    RobotKernels,
    approximate_forces,
    compiled,
    flat_pose,
    forward,
    robot_of,
)
from winchkit.robot.dynamics.elongation_correction import ElongationCorrection
from winchkit.schema.read import read_robot

LIMITS = {
    "tick, plain": 20e-6,
    "tick, compiled": 2e-6,
    "tick with Eq. 8, plain": 1e-3,
    "tick with Eq. 8, compiled": 1e-3,
    "dynamics, plain": 40e-6,
    "dynamics, compiled": 4e-6,
    "dynamics with elongation, plain": 1e-3,
    "dynamics with elongation, compiled": 1e-3,
    "forward, plain": 200e-6,
    "forward, compiled": 4e-6,
    "inverse, a pose of many": 1e-6,
}
RATIOS = (
    ("tick, compiled", "tick, plain"),
    ("tick with Eq. 8, compiled", "tick with Eq. 8, plain"),
    ("dynamics, compiled", "dynamics, plain"),
    ("dynamics, plain", "tick with Eq. 8, plain"),
    ("forward, compiled", "forward, plain"),
    ("inverse, a pose of many", "inverse, numpy one by one"),
    ("forward, a pose of many", "forward, numpy one by one"),
)
ROUNDS = 7
STEP = 0.5e-3
PERIOD, ROTOR = 1e-3, 4e-4
MIDDLE_FORCE, STIFFNESS = 500.0, 439.13e3
MANY, BATCH = 500_000, 5_000


def fastest_of(work: Callable[[], object], times: int = 1) -> float:
    """Seconds of one call in the quickest of several rounds."""
    rounds = []
    for _ in range(ROUNDS):
        start = perf_counter()
        for _ in range(times):
            work()
        rounds.append((perf_counter() - start) / times)
    return min(rounds)


def poses(robot: Robot, count: int) -> Pose:
    """Random poses around home."""
    rng = np.random.default_rng(1)
    rotation = rotation_by(rng.uniform(-0.1, 0.1, (count, 3)))
    return Pose(robot.home.position + rng.uniform(-0.1, 0.1, (count, 3)), rotation)


def one_by_one(robot: Robot, kernels: RobotKernels, name: str) -> dict[str, float]:
    """The cycle of one pose."""
    cycle = RobotCycle(robot, kernels)
    count = len(robot.names)
    initial = approximate_forces(
        robot.structure(robot.home), robot.weight(robot.home), np.full(count, MIDDLE_FORCE)
    )[0]
    stretch = ElongationCorrection(
        robot, [LinearLaw(STIFFNESS)] * count, robot.home, initial, kernels=kernels
    )
    there = poses(robot, 1)
    pose, strains = kernels.array(flat_pose(there)), kernels.array([1e-4] * count)
    near = Pose(there.position + STEP / 3**0.5, there.rotation)
    lengths = [kernels.array(robot.lengths(at)[0].tolist()) for at in (there, near)]
    cycle.start_from(pose)
    dynamics = DynamicsCycle(robot, initial, PERIOD, inertia=[ROTOR] * count, kernels=kernels)
    rates, gains = kernels.array([0.3, -0.2, 0.1, 0.2, 0.1, 0.4]), kernels.array([1.0] * 6)

    def forth_and_back() -> None:
        cycle.pose_at(lengths[1])
        cycle.pose_at(lengths[0])

    return {
        f"tick, {name}": fastest_of(lambda: cycle.motor_angles(pose, strains), 3000),
        f"tick with Eq. 8, {name}": fastest_of(
            lambda: cycle.motor_angles(pose, stretch.update(pose).strain), 1000
        ),
        f"dynamics, {name}": fastest_of(lambda: dynamics.update(pose, rates, gains), 1000),
        f"dynamics with elongation, {name}": fastest_of(
            lambda: dynamics.update(
                pose, rates, gains, stretch.update(pose, dynamics.wrench(pose, rates, gains)).strain
            ),
            1000,
        ),
        f"forward, {name}": fastest_of(forth_and_back, 500) / 2,
    }


def at_once(robot: Robot) -> dict[str, float]:
    """Many poses, for one of them."""
    many, some, one = poses(robot, MANY), poses(robot, BATCH), poses(robot, 1)
    lengths, single = robot.lengths(some), robot.lengths(one)
    off = Pose(some.position + STEP / 3**0.5, some.rotation)
    near = Pose(one.position + STEP / 3**0.5, one.rotation)
    geometry = robot.geometry
    return {
        "inverse, numpy one by one": fastest_of(lambda: robot.lengths(one), 500),
        "inverse, a pose of many": fastest_of(lambda: robot.lengths(many)) / MANY,
        "forward, numpy one by one": fastest_of(lambda: forward(geometry, single, near), 100),
        "forward, a pose of many": fastest_of(lambda: forward(geometry, lengths, off)) / BATCH,
    }


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--robot", default="ipanema3")
    options = parser.parse_args()
    robot = robot_of(read_robot(find("profiles", options.robot)))
    seconds, warm = one_by_one(robot, PLAIN, "plain"), None
    if find_spec("numba"):
        start = perf_counter()
        kernels = compiled()
        warm = perf_counter() - start
        seconds |= one_by_one(robot, kernels, "compiled")
    seconds |= at_once(robot)
    answer = {
        "schema": 1,
        "robot": options.robot,
        "seconds": seconds,
        "limits": LIMITS,
        "times_faster": {
            f"{name} / {other}": seconds[other] / seconds[name]
            for name, other in RATIOS
            if name in seconds
        },
        "poses_per_second": 1 / seconds["inverse, a pose of many"],
        "compile_seconds": warm,
        "broken": [name for name, limit in LIMITS.items() if seconds.get(name, 0.0) > limit],
    }
    print(json.dumps(answer)) if options.json else show(answer, seconds)
    return 1 if answer["broken"] else 0


def show(answer: dict[str, object], seconds: dict[str, float]) -> None:
    """The same for people."""
    for name, value in seconds.items():
        limit = f"  (promised {LIMITS[name] * 1e6:g})" if name in LIMITS else ""
        print(f"{name:32} {value * 1e6:9.2f} us{limit}")
    print("times faster")
    for name, ratio in answer["times_faster"].items():  # type: ignore[attr-defined]
        print(f"  {name:58} {ratio:8.1f}")
    warm = answer["compile_seconds"]
    print(f"compiled in {warm:.1f} s" if warm else "numba is not installed: nothing was compiled")


if __name__ == "__main__":
    sys.exit(main())

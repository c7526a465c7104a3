"""Whether a robot's forward kinematics finds poses that have the lengths, or says that it has none.

``python benchmarks/robot_forward.py [--poses 100000] [--seed 1] [--robot NAME] [--json]``: poses in
0.9 of the frame of the exit points (of a flat frame: half of home's height above it around home),
rotated by up to 60 degrees about any axis. Their lengths are made by another geometry (touching
angle by arc cosine), and the search begins at home: by ``forward``, and by ``RobotCycle`` in plain
or compiled loops. Of each:

- ``wrong``: said to have converged, but at a pose that does not have the lengths to 0.1 um;
- ``unfound``: said not to have converged, though the lengths have a pose;
- ``another``: another pose that has the lengths too; ``told`` counts those among the first thousand
  poses that a search of all starts reports.

Then lengths with one cable 0.1 m off: ``accepted`` at a pose where a length differs by more than
the 20 mm that are allowed. Aims: 0 wrong, unfound
and accepted; exits with 1 where one is missed.
"""

from __future__ import annotations

import argparse
import json
import sys
from time import perf_counter
from typing import Any

import numpy as np

from winchkit.catalog import find
from winchkit.robot import Pose, Robot, RobotCycle, fastest, flat_pose, forward, robot_of
from winchkit.schema.read import read_robot

Array = Any
ROBOTS = ("cabtive", "ipanema3", "winding-device-8")
SHARE, TILT = 0.9, np.radians(60)
MET, SAME, OFF, AGREEMENT = 1e-7, 1e-4, 0.1, 0.02
FLAT = 0.1
"""Height of a frame over its breadth below which it is flat."""
TOLD, CONTRADICTING, COLD = 1000, 200, 5000


def turned(axis: Array, angle: Array) -> Array:
    """Rotation matrices by Rodrigues' formula."""
    x, y, z = axis.T
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    sine, versine = np.sin(angle)[:, None, None], 1 - np.cos(angle)[:, None, None]
    return np.eye(3) + sine * cross + versine * (cross @ cross)


def drawn(robot: Robot, count: int, rng: np.random.Generator) -> Pose:
    """Poses in the frame."""
    low, high = robot.geometry.exit_point.min(axis=0), robot.geometry.exit_point.max(axis=0)
    if high[2] - low[2] < FLAT * (high - low).max():
        home = float(robot.home.position[0, 2])
        half = abs(home - (low[2] + high[2]) / 2) / 2
        low[2], high[2] = home - half, home + half
    position = (low + high) / 2 + SHARE * (high - low) / 2 * rng.uniform(-1, 1, (count, 3))
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return Pose(position, turned(axis, rng.uniform(0, TILT, count)))


def true_lengths(robot: Robot, pose: Pose) -> Array:
    """Cable from where it first touches its pulley to its anchor."""
    at = robot.geometry
    anchor = pose.position[:, None] + np.einsum("pij,nj->pni", pose.rotation, at.anchor_point)
    seen, radius = anchor - at.exit_point, at.swivel_radius
    along = np.einsum("pni,ni->pn", seen, at.swivel_axis)
    away = np.sqrt(np.maximum(np.sum(seen**2, axis=2) - along**2, 0))
    centre = np.hypot(away - radius, along)
    touch = np.arctan2(along, away - radius) + np.arccos(radius / centre)
    return np.sqrt(centre**2 - radius**2) + radius * (np.pi - touch)


def judged(robot: Robot, lengths: Array, true: Pose, found: Pose) -> dict[str, int]:
    """Counts of found poses, NaN where none."""
    said = np.isfinite(found.position[:, 0])
    met = np.abs(true_lengths(robot, found) - lengths).max(axis=1) <= MET
    apart = np.linalg.norm(found.position - true.position, axis=1)
    apart += np.abs(found.rotation - true.rotation).max(axis=(1, 2))
    return {
        "wrong": int(np.count_nonzero(said & ~met)),
        "unfound": int(np.count_nonzero(~said)),
        "another": int(np.count_nonzero(said & met & (apart > SAME))),
    }


def by_cycle(robot: Robot, lengths: Array) -> Pose:
    """Poses by the loop of a control cycle, each from home."""
    kernels = fastest()
    cycle, home = RobotCycle(robot, kernels), flat_pose(robot.home)
    out = np.full((len(lengths), 12), np.nan)
    for row, given in zip(out, lengths, strict=True):
        cycle.start_from(home)
        pose = cycle.pose_at(kernels.array(given.tolist()))
        if pose is not None:
            row[:] = pose
    return Pose(out[:, :3], out[:, 3:].reshape(-1, 3, 3))


def figures(name: str, count: int, seed: int) -> dict[str, Any]:
    """All figures of one robot."""
    robot = robot_of(read_robot(find("profiles", name)))
    rng = np.random.default_rng(seed)
    true = drawn(robot, count, rng)
    with np.errstate(invalid="ignore"):
        lengths = true_lengths(robot, true)
    # An anchor within its pulley has no length: no pose of this robot.
    there = np.isfinite(lengths).all(axis=1)
    lengths, true = lengths[there], Pose(true.position[there], true.rotation[there])
    begin = perf_counter()
    found = forward(robot.geometry, lengths, robot.home).pose
    seconds = perf_counter() - begin
    told = forward(robot.geometry, lengths[:TOLD], robot.home, search=-1.0).other
    off = lengths[:CONTRADICTING].copy()
    off[np.arange(len(off)), rng.integers(0, off.shape[1], len(off))] += OFF
    accepted = forward(robot.geometry, off, robot.home)
    cold = by_cycle(robot, lengths[:COLD])
    own = Pose(true.position[:COLD], true.rotation[:COLD])
    cycle = judged(robot, lengths[:COLD], own, cold)
    return {
        "poses": len(lengths),
        **judged(robot, lengths, true, found),
        "told": int(np.count_nonzero(np.isfinite(told.position[:, 0]))),
        "accepted": int(
            np.count_nonzero(
                np.abs(true_lengths(robot, accepted.pose) - off).max(axis=1) > AGREEMENT
            )
        ),
        "microseconds": 1e6 * seconds / len(lengths),
        "cycle_wrong": cycle["wrong"],
        "cycle_none": cycle["unfound"],
    }


def misses(found: dict[str, dict[str, Any]]) -> list[str]:
    """Aims that were missed."""
    aims = ("wrong", "unfound", "accepted", "cycle_wrong")
    return [f"{name}: {aim}" for name, one in found.items() for aim in aims if one[aim]]


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--robot", choices=ROBOTS, action="append")
    parser.add_argument("--json", action="store_true", help="on one line")
    options = parser.parse_args()
    found = {name: figures(name, options.poses, options.seed) for name in options.robot or ROBOTS}
    missed = misses(found)
    print(json.dumps({**found, "missed": missed}, indent=None if options.json else 2))
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())

"""Continuity of the force distributions along a path: the largest step of a force per mm.

``python benchmarks/force_continuity.py [--json] [--robot cabtive]``: along a diagonal through home,
sampled every millimetre, the largest step of a cable force of each distribution, and where that
is, the step that is left when the millimetre is divided by ten three times: a continuous force
leaves a thousandth of it, a jump stays. Exits with 1 where more than a tenth is left, or where a
distribution has no forces within the limits on more than half of the path.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable

import numpy as np

from winchkit.catalog import find
from winchkit.robot import (
    ForceLimits,
    Forces,
    Pose,
    Robot,
    closed_form,
    improved_closed_form,
    quadratic,
    robot_of,
    steepest_force,
)
from winchkit.schema.read import read_robot

Method = Callable[[np.ndarray, np.ndarray, ForceLimits], Forces]
METHODS: dict[str, Method] = {
    "closed form": closed_form,
    "improved closed form": improved_closed_form,
    "quadratic": quadratic,
}
SPACING, REFINEMENTS = 1e-3, 3


def forces_at(
    robot: Robot, method: Method, limits: ForceLimits, distance: np.ndarray
) -> np.ndarray:
    """Cable forces at distances from home on the diagonal, NaN where there are none."""
    place = robot.home.position + distance[:, None] * np.ones(3) / 3**0.5
    pose = Pose(place, np.repeat(robot.home.rotation, len(distance), axis=0))
    pairs = zip(robot.structure(pose), robot.weight(pose), strict=True)
    found = [method(structure, wrench, limits) for structure, wrench in pairs]
    return np.array([f.value if f.feasible else np.full(len(f.value), np.nan) for f in found])


def measured(robot: Robot, method: Method, limits: ForceLimits, reach: float) -> dict[str, float]:
    """Largest step per mm, what is left of it after the refinements, and the feasible share."""
    distance = np.arange(-reach, reach, SPACING)
    force = forces_at(robot, method, limits, distance)
    share = float(np.mean(np.isfinite(force).all(axis=1)))
    first = steepest_force(force, distance) * SPACING
    left = first
    for _ in range(REFINEMENTS if np.isfinite(first) else 0):
        step = np.nanmax(np.abs(np.diff(force, axis=0)), axis=1, initial=0.0)
        k = int(np.argmax(step))
        distance = np.linspace(distance[k], distance[k + 1], 11)
        force = forces_at(robot, method, limits, distance)
        left = float(np.nanmax(np.abs(np.diff(force, axis=0))))
    return {"step_N_per_mm": first, "left_N": left, "feasible": share}


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--robot", default="cabtive")
    parser.add_argument("--reach", type=float, default=0.15, help="to both sides of home, m")
    parser.add_argument("--low", type=float, default=20.0, help="least force, N")
    parser.add_argument("--high", type=float, default=200.0, help="greatest force, N")
    options = parser.parse_args()
    robot = robot_of(read_robot(find("profiles", options.robot)))
    limits = ForceLimits(options.low, options.high)
    found = {
        name: measured(robot, method, limits, options.reach) for name, method in METHODS.items()
    }
    broken = [
        name
        for name, one in found.items()
        if not (one["feasible"] > 0.5 and one["left_N"] <= one["step_N_per_mm"] / 10)
    ]
    answer = {"schema": 1, "robot": options.robot, "distributions": found, "broken": broken}
    if options.json:
        print(json.dumps(answer))
    else:
        for name, one in found.items():
            print(
                f"{name:22} {one['step_N_per_mm']:.4f} N/mm; {one['left_N']:.2g} N of it within "
                f"1 um; forces on {one['feasible']:.0%} of the path"
            )
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())

"""The 17 poses of the IPAnema 3 paper's Table 2: what its elongation model explains of them.

``python benchmarks/ipanema3_poses.py [--json]``: the averages of the table, the rows that its
correction makes worse, and the deviation that linear cables would cause without correction, beside
the measured one. Forces by Eq. 8 with its sign put right, from the forces at a reference pose;
every cable longer by Δf (l + l0)/EA; the pose that the stretched cables lead to by least squares.

Assumed, since the paper does not say: k1 = 439.13 is N per mm of elongation and metre of cable
(EA = 439.13 kN); reference pose (0, 0, -0.5) m; forces there closest to 500 N; a platform of 50 kg;
5 m of cable between drum and frame; no swivel pulleys. These values are correlated: they are
plausible, not proven. The corrected column cannot be computed: it is the residual of the paper's
model, and the paper prints neither its forces, nor its wrench, nor the machine's other errors.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass

import numpy as np

from winchkit.catalog import find
from winchkit.robot import Pose, approximate_forces, forward, robot_of
from winchkit.schema.read import read_robot

MIDDLE_FORCE = 500.0
# x, y, z, without correction, with elongation correction, all in mm.
TABLE_2 = np.array(
    [
        [0, 0, 1250, 53.495, 34.725],
        [-110, 110, 1140, 47.643, 17.897],
        [-110, -110, 1140, 47.188, 17.491],
        [110, -110, 1360, 51.568, 19.417],
        [110, 110, 1360, 52.097, 19.715],
        [-550, 550, 700, 37.884, 23.091],
        [-550, -550, 700, 34.233, 19.265],
        [550, -550, 1800, 57.681, 29.468],
        [550, 550, 1800, 61.249, 32.561],
        [-880, 880, 370, 27.907, 32.041],
        [-880, -880, 370, 20.563, 23.727],
        [880, -880, 2130, 60.090, 37.939],
        [880, 880, 2130, 67.394, 46.593],
        [-1100, 1100, 150, 22.247, 28.910],
        [-1100, -1100, 150, 12.669, 18.210],
        [1100, -1100, 2350, 62.892, 40.109],
        [1100, 1100, 2350, 73.043, 51.618],
    ]
)


@dataclass(frozen=True)
class Outcome:
    """What linear cables would do to the 17 poses, m and N."""

    deviation: np.ndarray
    """(17,), m."""
    forces: np.ndarray
    """(17, 8), N, as Eq. 8 estimates them; below zero where it leaves what a cable can bear."""
    share_along_z: float
    """Of the squared deviation."""


def predicted(middle_force: float = MIDDLE_FORCE, per_metre: bool = True) -> Outcome:
    """Deviation from the programmed position without correction.

    ``per_metre`` off: k1 is N per mm of elongation, however long the cable.
    """
    robot = robot_of(read_robot(find("profiles", "ipanema3")))
    programmed = Pose(TABLE_2[:, :3] / 1e3, np.tile(np.eye(3), (len(TABLE_2), 1, 1)))
    middle = np.full(len(robot.names), middle_force)
    reference = approximate_forces(robot.structure(robot.home), robot.weight(robot.home), middle)
    wrench = robot.weight(robot.home)
    forces = approximate_forces(robot.structure(programmed), wrench, reference)
    stiffness = np.array([winch.cable.axial_stiffness for winch in robot.winches])
    lengths = robot.lengths(programmed)
    gauge = lengths + robot.dead_length if per_metre else 1.0
    stretched = lengths + (forces - reference) / stiffness * gauge
    moved = forward(robot.geometry, stretched, programmed).pose.position - programmed.position
    along_z = float(np.sum(moved[:, 2] ** 2) / np.sum(moved**2))
    return Outcome(np.linalg.norm(moved, axis=1), forces, along_z)


def figures() -> dict[str, object]:
    """All that is printed."""
    before, after = TABLE_2[:, 3], TABLE_2[:, 4]
    outcome = predicted()
    ours = outcome.deviation * 1e3
    return {
        "schema": 1,
        "table_2": {
            "mean_before": float(before.mean()),
            "mean_after": float(after.mean()),
            "reduction": float(1 - after.mean() / before.mean()),
            "worse_after": [int(row) + 1 for row in np.flatnonzero(after > before)],
            "z_minus_x_mm": sorted({float(z - x) for x, z in TABLE_2[:, [0, 2]]}),
        },
        "predicted_without_correction": {
            "mm": ours.round(3).tolist(),
            "mean_mm": float(ours.mean()),
            "correlation": float(np.corrcoef(ours, before)[0, 1]),
            "rms_mm": float(np.sqrt(np.mean((ours - before) ** 2))),
            "share_along_z": outcome.share_along_z,
            "lowest_force_n": float(outcome.forces.min()),
            "mean_mm_with_k1_in_n_per_mm": float(predicted(per_metre=False).deviation.mean() * 1e3),
        },
    }


def main() -> int:
    """Compute and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    answer = figures()
    if options.json:
        print(json.dumps(answer))
        return 0
    ours = predicted().deviation * 1e3
    print(" row      x      y      z   measured  with correction  predicted without   mm")
    for number, (row, mm) in enumerate(zip(TABLE_2, ours, strict=True), start=1):
        x, y, z, before, after = row
        worse = "  worse" if after > before else ""
        print(f"{number:4} {x:6g} {y:6g} {z:6g} {before:10.3f} {after:16.3f} {mm:18.1f}{worse}")
    for title in ("table_2", "predicted_without_correction"):
        for name, value in answer[title].items():  # type: ignore[attr-defined]
            if name != "mm":
                print(f"{name:16} {value}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

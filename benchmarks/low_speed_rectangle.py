"""The winding-device paper's low-speed rectangle on eight winches, with three ideas of friction.

``python benchmarks/low_speed_rectangle.py [--json] [--seeds 6]``: a platform goes round
400 x 430 mm at Z = 200 mm with 0.05 m/s in S-curves, in several runs of winches of their own.
What the cells at the drums show is made by the simulator's pulleys, whose presliding is
integrated by Runge-Kutta. The tension at the platform is estimated from them without friction,
with Coulomb friction and with the Dahl estimator, which knows its numbers from another motion of
the same winches and nothing of how the pulleys stand at the start.
The paper: 17.9 +- 20.5 N with Dahl, 96 % alike.

The paper gives the frame, the speed, the rectangle, the load and that there are three pulleys.
Assumed here: where the cables leave frame and platform, wraps, friction and its spread, noise.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from itertools import pairwise
from math import pi, sin
from typing import Any

import numpy as np

from winchkit.estimation import DahlEstimator, PulleyGroup
from winchkit.estimation.dahl_identification import PulleyRecord, identify_dahl
from winchkit.estimation.metrics import mean_relative_error, overshoot
from winchkit.model.pulleys import Bearings, over_pulleys
from winchkit.model.trajectory import plan
from winchkit.sim.physics.base import PlantState
from winchkit.sim.physics.pulley import PreslidingPulleys

Array = np.ndarray
GRAVITY = 9.80665
MASS = 1000.0 / GRAVITY
SPEED, ACCELERATION, JERK = 0.05, 0.1, 0.5
HEIGHT = 0.2
CORNERS = [(-0.2, -0.215), (0.2, -0.215), (0.2, 0.215), (-0.2, 0.215), (-0.2, -0.215)]
REST = 0.5
WRAPS = (pi / 2, pi, pi / 2)
FRICTION, STIFFNESS, SHAPE = 0.02, 3000.0, 1.0
SPREAD = 0.15
"""How far pulleys of one make differ in friction and stiffness, one standard deviation."""
CELL_NOISE, ENCODER = 2.0, 5e-6
APPROACH = 0.02
"""How far the cable may have come before the first sample, either way, m."""
PAPER = {"mean": 17.9, "std": 20.5, "similarity": 0.96}
METHODS = ("none", "coulomb", "dahl")


def robot() -> tuple[Array, Array]:
    """Exit points of a 6 x 6 x 1.2 m frame and anchor points of the platform, shape (8, 3), m."""
    exits, anchors = [], []
    for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        for side in (-1, 1):
            exits.append([3.0 * x + 0.1 * side * y, 3.0 * y - 0.1 * side * x, 1.2])
            anchors.append([0.25 * x, 0.25 * y, 0.1 * side])
    return np.array(exits), np.array(anchors)


def ropes(position: Array, acceleration: Array) -> tuple[Array, Array]:
    """Cable lengths and tensions along positions (n, 3), each of shape (n, 8)."""
    exits, anchors = robot()
    vectors = exits - (position[:, None, :] + anchors)
    lengths = np.linalg.norm(vectors, axis=2)
    unit = vectors / lengths[:, :, None]
    wrench = np.concatenate([unit, np.cross(anchors[None], unit)], axis=2).transpose(0, 2, 1)
    needed = np.zeros((len(position), 6))
    needed[:, :3] = MASS * (acceleration + np.array([0, 0, GRAVITY]))
    tension = np.einsum("nij,nj->ni", np.linalg.pinv(wrench), needed)
    assert np.all(tension > 0), "a cable would be slack"
    return lengths, tension


def rectangle(rate: float, scale: float) -> tuple[Array, Array]:
    """Positions and accelerations round the rectangle, shape (n, 3)."""
    positions, accelerations = [], []
    for start, end in pairwise(CORNERS):
        there, back = (scale * np.array([*point, 0.0]) for point in (start, end))
        way = back - there
        move = plan(float(np.linalg.norm(way)), SPEED, ACCELERATION, JERK)
        gone, _, push = move.at(np.arange(0, move.duration + REST, 1 / rate))
        along = way / np.linalg.norm(way)
        positions.append(there + gone[:, None] * along + np.array([0, 0, HEIGHT]))
        accelerations.append(push[:, None] * along)
    return np.concatenate(positions), np.concatenate(accelerations)


def learning(rate: float, seconds: float) -> tuple[Array, Array]:
    """Another motion, to identify the pulleys by: reversals of many sizes."""
    time = np.arange(0, seconds, 1 / rate)
    waves = [(0.3, 23.0), (0.25, 17.0), (0.06, 11.0)]
    position = np.column_stack([a * np.sin(2 * pi * time / t) for a, t in waves])
    acceleration = np.column_stack(
        [-a * (2 * pi / t) ** 2 * np.sin(2 * pi * time / t) for a, t in waves]
    )
    return position + np.array([0, 0, 0.3]), acceleration


@dataclass(frozen=True)
class Rub:
    """What the pulleys' friction is on the average; assumed, for the paper does not say."""

    friction: float = FRICTION
    stiffness: float = STIFFNESS
    """N/m."""
    shape: float = SHAPE


class Winch:
    """Three pulleys with numbers of their own, by the simulator, and a noisy cell."""

    def __init__(self, rng: np.random.Generator, rub: Rub) -> None:
        self.rng, self.shape = rng, rub.shape
        spread = np.maximum(0.3, 1 + SPREAD * rng.normal(0, 1, (3, 2)))
        self.numbers = [(rub.friction * float(f), rub.stiffness * float(s)) for f, s in spread]

    def readings(self, platform: Array, length: Array) -> tuple[Array, Array]:
        """What the cell shows and what the encoder says is wound in.

        Before the first sample the cable has come some way from somewhere.
        """
        pulleys = [PreslidingPulleys(*numbers, self.shape) for numbers in self.numbers]
        state, out = PlantState(), []
        approach = np.full(100, self.rng.uniform(-APPROACH, APPROACH) / 100)
        moved = np.concatenate([approach, -np.diff(length, prepend=length[0])])
        loads = np.concatenate([np.full(100, platform[0]), platform])
        for load, step in zip(loads.tolist(), moved.tolist(), strict=True):
            state.winding_speed, tension = step, load
            for index in (2, 1, 0):
                tension += pulleys[index].pulley(state, index, WRAPS[index], tension, 1.0)
            out.append(tension)
        wound = np.round((length[0] - length) / ENCODER) * ENCODER
        return np.array(out[100:]) + self.rng.normal(0, CELL_NOISE, len(length)), wound


def estimates(group: PulleyGroup, cell: Array, wound: Array, speed: Array) -> dict[str, Array]:
    """Tension at the platform by each idea of friction."""
    estimator = DahlEstimator([group], cell_std=CELL_NOISE)
    dahl = [
        estimator.update(t, x).value for t, x in zip(cell.tolist(), wound.tolist(), strict=True)
    ]
    return {
        "none": cell,
        "coulomb": over_pulleys(cell, WRAPS, -speed, Bearings(group.friction)),
        "dahl": np.array(dahl),
    }


def measure(
    *, rate: float, scale: float, seconds: float, winches: int, seed: int, rub: Rub | None = None
) -> dict[str, Any]:
    """Errors of the three ideas over all winches."""
    rub = rub or Rub()
    lengths, tensions = ropes(*rectangle(rate, scale))
    taught_lengths, taught = ropes(*learning(rate / 4, seconds))
    rng = np.random.default_rng(seed)
    found: dict[str, list[Array]] = {name: [] for name in METHODS}
    wanted, learned = [], []
    for k in range(winches):
        winch = Winch(rng, rub)
        cell, wound = winch.readings(taught[:, k], taught_lengths[:, k])
        (group,) = identify_dahl(
            [PulleyRecord(cell, taught[:, k], wound)], [WRAPS], shape=rub.shape
        ).groups
        learned.append(group)
        cell, wound = winch.readings(tensions[:, k], lengths[:, k])
        speed = -np.gradient(lengths[:, k]) * rate
        speed[np.abs(speed) < 1e-6] = 0.0
        for name, values in estimates(group, cell, wound, speed).items():
            found[name].append(values)
        wanted.append(tensions[:, k])
    return {
        "schema": 1,
        "winches": winches,
        "samples": len(lengths),
        "tension": float(np.mean(wanted)),
        "sliding_friction": float(
            rub.friction * np.mean(wanted) * sum(2 * sin(wrap / 2) for wrap in WRAPS)
        ),
        "identified": {
            "friction": float(np.mean([group.friction for group in learned])),
            "stiffness": float(np.mean([group.stiffness for group in learned])),
        },
        "methods": {name: judged(found[name], wanted) for name in METHODS},
        "paper": PAPER,
    }


def judged(found: list[Array], wanted: list[Array]) -> dict[str, float]:
    """Mean and spread of the error in N, Eq. 28 and 29, and how much alike."""
    error = np.abs(np.concatenate(found) - np.concatenate(wanted))
    relative = mean_relative_error(np.concatenate(found), np.concatenate(wanted))
    over = max(
        overshoot(values / target, 1.0) for values, target in zip(found, wanted, strict=True)
    )
    return {
        "mean": float(error.mean()),
        "std": float(error.std()),
        "overshoot": over,
        "mean_relative_error": relative,
        "similarity": 1.0 - relative,
    }


def over_runs(runs: list[dict[str, Any]]) -> dict[str, dict[str, dict[str, float | None]]]:
    """Of every figure of every method the mean over runs, and how far several runs spread."""
    out: dict[str, dict[str, dict[str, float | None]]] = {}
    for name in METHODS:
        rows = [run["methods"][name] for run in runs]
        out[name] = {
            figure: {
                "mean": float(np.mean([row[figure] for row in rows])),
                "spread": float(np.std([row[figure] for row in rows], ddof=1))
                if len(rows) > 1
                else None,
            }
            for figure in rows[0]
        }
    return out


def good(run: dict[str, Any]) -> bool:
    """Dahl is the nearest, and at least as much alike as the paper's."""
    methods = run["methods"]
    best = min(methods, key=lambda name: methods[name]["mean"])
    return best == "dahl" and methods["dahl"]["similarity"] >= PAPER["similarity"]


def show(answer: dict[str, Any]) -> None:
    """The same for people."""
    first = answer["runs"][0]
    print(
        f"{len(answer['runs'])} runs of {first['winches']} winches and {first['samples']} samples, "
        f"mean tension {first['tension']:.0f} N; +/- between the runs"
    )
    for name, row in answer["methods"].items():
        cells = [
            f"{row[figure]['mean'] * worth:.2f}"
            + (f" +/- {row[figure]['spread'] * worth:.2f}" if len(answer["runs"]) > 1 else "")
            for figure, worth in (("mean", 1), ("std", 1), ("similarity", 100), ("overshoot", 100))
        ]
        print(
            f"{name:>8}: error mean {cells[0]} N, standard deviation {cells[1]} N, "
            f"{cells[2]} % alike, overshoot {cells[3]} %"
        )
    print(
        f"   paper: error mean {PAPER['mean']} N, standard deviation {PAPER['std']} N, "
        f"{100 * PAPER['similarity']:.0f} % alike (with Dahl, one run on a machine)"
    )


def main() -> int:
    """Measure, print; 1 where Dahl is not the best or less alike than the paper's in any run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rate", type=float, default=100.0, help="Hz")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the learning motion")
    parser.add_argument("--friction", type=float, default=FRICTION, help="of the pulleys")
    parser.add_argument("--stiffness", type=float, default=STIFFNESS, help="N/m, of presliding")
    parser.add_argument("--shape", type=float, default=SHAPE, help="of presliding")
    parser.add_argument("--seed", type=int, default=1, help="of the first run")
    parser.add_argument("--seeds", type=int, default=6, help="how many runs")
    options = parser.parse_args()
    rub = Rub(options.friction, options.stiffness, options.shape)
    rate, seconds = options.rate, options.seconds
    runs = [
        measure(rate=rate, scale=1.0, seconds=seconds, winches=8, seed=seed, rub=rub)
        for seed in range(options.seed, options.seed + max(1, options.seeds))
    ]
    answer = {"schema": 1, "methods": over_runs(runs), "paper": PAPER, "runs": runs}
    if options.json:
        print(json.dumps(answer))
    else:
        show(answer)
    return 0 if all(good(run) for run in runs) else 1


if __name__ == "__main__":
    sys.exit(main())

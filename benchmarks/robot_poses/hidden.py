"""Robots with one thing hidden: poses, profiles and files that share no code with winchkit.

Tensions carry the platform: random forces around a middle, corrected so that they balance its
weight by virtual work on the generator's own rope lengths.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robot_poses.truth import GRAVITY, HOME, Noise, Row, Truth, Vector, csv, poses, turn

__all__ = ["CASES", "Case", "profile_text", "record"]

Array = NDArray[np.float64]
Beyond = Callable[[int, Row], float]
MASS = 3.0
_STEP = 1e-6


@dataclass(frozen=True)
class Case:
    """What is true of a robot beside what its profile says."""

    name: str
    answers: tuple[str, ...] = ()
    """Effects that may be named, with the line: ``exit-point/3``; none where nothing is hidden."""
    truth: Truth = field(default_factory=Truth)
    home: tuple[float, ...] = (0.0,) * 8
    """Rope more than the profile asks for at home, m."""
    mass: float = MASS
    centre: Vector = (0.0, 0.0, 0.0)
    beyond: Beyond | None = None
    """Rope length error of a line at a pose that no effect of the catalogue has, m."""


def _shifted(points: tuple[Vector, ...], line: int, by: Vector) -> tuple[Vector, ...]:
    x, y, z = (a + b for a, b in zip(points[line], by, strict=True))
    return (*points[:line], (x, y, z), *points[line + 1 :])


def _changed(values: tuple[float, ...], line: int, by: float) -> tuple[float, ...]:
    return (*values[:line], values[line] + by, *values[line + 1 :])


BASE = Truth()
SOFT = replace(BASE, stiffness=2e5, home_tension=40.0)
MOVED = replace(BASE, exit=_shifted(BASE.exit, 2, (1e-3, -2e-3, 1e-3)))
WIDER = replace(BASE, swivel=_changed(BASE.swivel, 5, 1.5e-3))
LARGER = replace(BASE, winding=_changed(BASE.winding, 1, 0.2e-3))
STILL = (0.0,) * 8
ELASTIC = "cable-elongation-linear"


def _waves(line: int, row: Row) -> float:
    return 3e-4 * math.sin(row.position[0] * 130 + line)


CASES: tuple[Case, ...] = (
    Case("none"),
    Case("elastic ropes", (ELASTIC,), SOFT),
    Case("home length", ("home-length/4",), home=_changed(STILL, 3, 0.5e-3)),
    Case("payload mass", ("payload-mass",), mass=MASS + 0.25),
    Case("payload centre", ("payload-centre",), centre=(0.02, -0.01, 0.0)),
    Case("exit point", ("exit-point/3",), MOVED),
    Case("swivel radius", ("swivel-radius/6",), WIDER),
    Case("drum radius", ("drum-radius/2", "gear-ratio/2"), LARGER),
    Case(
        "two at once", (ELASTIC, "exit-point/3"), replace(MOVED, stiffness=2e5, home_tension=40.0)
    ),
    Case("outside the catalogue", beyond=_waves),
)


def record(
    case: Case, folder: Path, name: str, *, count: int = 60, repeats: int = 15, seed: int = 1,
    noise: Noise | None = None,
) -> Path:  # fmt: skip
    """Write a run: ``count`` distinct poses, the first ``repeats`` of them driven to twice."""
    noise = noise or Noise(tension=0.3)
    rng = np.random.default_rng(seed)
    made = poses(case.truth, count, seed, noise=Noise(0, 0, 0, 0, 0, 0, 0))
    rows = [_pulled(case, row, random.Random(seed * 1000 + n)) for n, row in enumerate(made)]
    seen = [_seen(row, noise, rng) for row in (*rows, *rows[:repeats])]
    path = folder / name
    path.write_text(csv(seen, angles=True, tension=True))
    return path


def profile_text(truth: Truth | None = None) -> str:
    """A robot's profile with the generator's own numbers, as a user would write it."""
    truth = truth or BASE
    out = [
        'schema = 1\nkind = "robot"\nname = "known"\n\n'
        f'[platform]\nmass = "{MASS} kg"\n\n[home]\nposition = {_lengths(HOME)}\n'
    ]
    for i in range(8):
        upright = 1 if i < 4 else -1
        out.append(
            f'\n[[line]]\nname = "{i + 1}"\nexit_point = {_lengths(truth.exit[i])}\n'
            f"anchor_point = {_lengths(truth.anchor[i])}\n"
            f'swivel_radius = "{truth.swivel[i]!r} m"\nswivel_axis = [0, 0, {upright}]\n'
            f'[line.winch.drum]\nkind = "spiral"\nwinding_radius = "{truth.winding[i]!r} m"\n'
            f'layer_growth = "{truth.growth!r} m"\n[line.winch.gearbox]\nratio = 1.0\n'
            f"[line.winch.reference]\nwound_turns = {truth.turns}\n"
        )
    return "".join(out)


def _lengths(point: Sequence[float]) -> str:
    return "[" + ", ".join(f'"{x!r} m"' for x in point) + "]"


def _pulled(case: Case, row: Row, rng: random.Random) -> Row:
    """A row with balanced tensions, and the motor angles that go with them."""
    start = np.array([rng.uniform(25.0, 80.0) for _ in range(8)])
    slope, down = _slope(case.truth, row), np.array([0.0, 0.0, -case.mass * GRAVITY])
    rotation = np.array(turn(*row.angles))
    weight = np.concatenate([down, np.cross(rotation @ np.array(case.centre), down)])
    # Virtual work: a rope that gets longer by L' as the platform moves pulls back with T L'.
    pull = start + np.linalg.pinv(slope) @ (weight - slope @ start)
    angles = []
    for i in range(8):
        angle = case.truth.motor_angle(i, row.position, turn(*row.angles), float(pull[i]))
        extra = case.home[i] + (case.beyond(i, row) if case.beyond else 0.0)
        angles.append(angle + extra / _arm(case.truth, i, angle))
    return replace(row, motor_angle=tuple(angles), tension=tuple(pull.tolist()))


def _arm(truth: Truth, line: int, angle: float) -> float:
    whole = truth.turns * 2 * math.pi + angle
    return (truth.wound(line, whole + 1e-5) - truth.wound(line, whole - 1e-5)) / 2e-5


def _slope(truth: Truth, row: Row) -> Array:
    """Derivatives of the rope lengths by position and small turns, (6, 8)."""
    turned, out = np.array(turn(*row.angles)), np.empty((6, 8))
    for k in range(6):
        ends = []
        for sign in (1, -1):
            place, spin = np.array(row.position), np.zeros(3)
            (place if k < 3 else spin)[k % 3] += sign * _STEP
            x, y, z = spin
            small = np.eye(3) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            rows = tuple(tuple(r) for r in (small @ turned).tolist())
            px, py, pz = place.tolist()
            ends.append([truth.length(i, (px, py, pz), rows) for i in range(8)])  # type: ignore[arg-type]
        out[k] = (np.array(ends[0]) - np.array(ends[1])) / (2 * _STEP)
    return out


def _seen(row: Row, noise: Noise, rng: np.random.Generator) -> Row:
    """What instruments say of a row."""

    def off(values: Sequence[float], sigma: float) -> tuple[float, ...]:
        return tuple((np.array(values) + rng.normal(0.0, sigma, len(values))).tolist())

    x, y, z = off(row.position, noise.tracker)
    a, b, c = off(row.angles, noise.angle)
    return replace(
        row,
        motor_angle=off(row.motor_angle, noise.encoder),
        seen_position=(x, y, z),
        seen_angles=(a, b, c),
        tension=off(row.tension, noise.tension),
    )

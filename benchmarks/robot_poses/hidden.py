"""Robots with one thing hidden: poses, profiles and files that share no code with winchkit.

Tensions carry the platform: random forces around a middle, corrected so that they balance its
weight by virtual work on the generator's own cable lengths.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from robot_poses.truth import GRAVITY, HOME, Noise, Row, Truth, Vector, csv, poses, turn
from winchkit.arrays import Array

Beyond = Callable[[int, Row], float]
Seen = Callable[[Row], Row]
BASE = Truth()
MASS = 3.0
_STEP = 1e-6
_STAYS = 0.9
"""Of a tracker's wander, from one row to the next."""


@dataclass(frozen=True)
class Case:
    """What is true of a robot beside what its profile says."""

    name: str
    answers: tuple[str, ...] = ()
    """Effects that may be named, with the line: ``exit-point/3``; none where nothing is hidden."""
    truth: Truth = BASE
    home: tuple[float, ...] = (0.0,) * 8
    """Cable more than the profile asks for at home, m."""
    mass: float = MASS
    centre: Vector = (0.0, 0.0, 0.0)
    beyond: Beyond | None = None
    """Cable more than the profile asks for on a line at a pose, its tension known, m."""
    seen: Seen | None = None
    """What instruments make of a row, before their noise."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Numbers that a fit should find, SI: ``exit-point/3.x``."""
    warm: float = 0.0
    """How far temperatures range about 20 degrees Celsius; zero where they are not recorded."""
    wander: float = 0.0
    """Of the tracker, m."""
    repeats: int = 15
    outside: bool = False
    """Whether no effect of the catalogue is to be named."""
    as_geometry: bool = False
    """Whether all of the geometry together may be said to be off: it does what is hidden."""


def record(
    case: Case, folder: Path, name: str, *, count: int = 60, repeats: int | None = None,
    seed: int = 1, noise: Noise | None = None, box: float = 0.075, tilt: float = math.radians(7.5),
) -> Path:  # fmt: skip
    """Write a run: ``count`` distinct poses, the first ``repeats`` of them driven to twice."""
    noise = noise or Noise(tension=0.3, wander=case.wander)
    again = case.repeats if repeats is None else repeats
    rng, silent = np.random.default_rng(seed), Noise(0, 0, 0, 0, 0, 0, 0)
    made = poses(case.truth, count, seed, box=box, tilt=tilt, noise=silent)
    rows = [balanced(case, row, random.Random(seed * 1000 + n)) for n, row in enumerate(made)]
    shown = [case.seen(row) if case.seen else row for row in (*rows, *rows[:again])]
    astray = _wander(len(shown), noise.wander, rng)
    seen = [_seen(row, noise, rng, off) for row, off in zip(shown, astray, strict=True)]
    path = folder / name
    path.write_text(csv(seen, angles=True, tension=True, temperature=bool(case.warm)))
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


def balanced(case: Case, row: Row, rng: random.Random) -> Row:
    """A row with balanced tensions, and the motor angles that go with them."""
    start = np.array([rng.uniform(25.0, 80.0) for _ in range(8)])
    slope, down = _slope(case.truth, row), np.array([0.0, 0.0, -case.mass * GRAVITY])
    rotation = np.array(turn(*row.angles))
    weight = np.concatenate([down, np.cross(rotation @ np.array(case.centre), down)])
    # Virtual work: a cable that gets longer by L' as the platform moves pulls back with T L'.
    pull = start + np.linalg.pinv(slope) @ (weight - slope @ start)
    angles = []
    warm = 20.0 + (rng.uniform(-case.warm, case.warm) if case.warm else 0.0)
    row = replace(row, tension=tuple(pull.tolist()), temperature=warm)
    for i in range(8):
        angle = case.truth.motor_angle(i, row.position, turn(*row.angles), float(pull[i]))
        extra = case.home[i] + (case.beyond(i, row) if case.beyond else 0.0)
        angles.append(angle + extra / _arm(case.truth, i, angle))
    return replace(row, motor_angle=tuple(angles))


def _arm(truth: Truth, line: int, angle: float) -> float:
    whole = truth.turns * 2 * math.pi + angle
    return (truth.wound(line, whole + 1e-5) - truth.wound(line, whole - 1e-5)) / 2e-5


def _slope(truth: Truth, row: Row) -> Array:
    """Derivatives of the cable lengths by position and small turns, (6, 8)."""
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


def _wander(count: int, sigma: float, rng: np.random.Generator) -> Array:
    """A tracker's zero that strays and comes back, (count, 3), m: an AR(1) process."""
    if not sigma:
        return np.zeros((count, 3))
    out = np.empty((count, 3))
    out[0] = rng.normal(0.0, sigma, 3)
    for n in range(1, count):
        out[n] = _STAYS * out[n - 1] + rng.normal(0.0, sigma * math.sqrt(1 - _STAYS**2), 3)
    return out


def _seen(row: Row, noise: Noise, rng: np.random.Generator, astray: Array) -> Row:
    """What instruments say of a row."""

    def off(values: Sequence[float], sigma: float) -> tuple[float, ...]:
        return tuple((np.array(values) + rng.normal(0.0, sigma, len(values))).tolist())

    x, y, z = off(row.seen_position, noise.tracker)
    x, y, z = (seen + stray for seen, stray in zip((x, y, z), astray.tolist(), strict=True))
    a, b, c = off(row.angles, noise.angle)
    return replace(
        row,
        motor_angle=off(row.motor_angle, noise.encoder),
        seen_position=(x, y, z),
        seen_angles=(a, b, c),
        tension=off(row.tension, noise.tension),
    )

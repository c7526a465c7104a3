"""The CABTIVE robot as it truly is: a scalar, textbook geometry that shares nothing with winchkit.

Numbers in mm as the paper prints them (Tables 2, 3 nominal; 5, 6, 7 true); results in SI.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

EXIT = [
    [859.4, -143.3, -131.5, 850.6, 861.2, -130.2, -139.8, 860.4],
    [1067.8, 1063.4, 55.9, 58.7, 1071.2, 1068.8, 53.3, 56.8],
    [1106.7, 1105.8, 1101.2, 1102.5, 53.8, 51.0, 46.8, 51.5],
]
ANCHOR = [
    [43.4, -40.0, -54.6, 55.0, 32.4, -21.6, -30.9, 32.6],
    [92.4, 95.0, -93.4, -90.5, 106.0, 102.4, -99.6, -106.0],
    [-63.3, -63.1, -71.3, -66.4, -65.6, -62.9, -62.6, -63.7],
]
SWIVEL = [8.0, 7.9, 7.9, 7.8, 7.7, 8.4, 8.0, 8.5]
WINDING = [59.0, 59.0, 60.2, 59.0, 60.4, 60.1, 60.5, 60.1]
GROWTH = 0.422
HOME: Vector = (0.360, 0.558, 0.560)
UPPER = 4
TURNS = 4.0
GRAVITY = 9.80665


def _points(table: list[list[float]]) -> tuple[Vector, ...]:
    return tuple((x / 1e3, y / 1e3, z / 1e3) for x, y, z in zip(*table, strict=True))


@dataclass(frozen=True)
class Truth:
    """Everything that is true of the robot, SI."""

    exit: tuple[Vector, ...] = field(default_factory=lambda: _points(EXIT))
    anchor: tuple[Vector, ...] = field(default_factory=lambda: _points(ANCHOR))
    swivel: tuple[float, ...] = tuple(r / 1e3 for r in SWIVEL)
    winding: tuple[float, ...] = tuple(r / 1e3 for r in WINDING)
    growth: float = GROWTH / 1e3
    turns: float = TURNS
    stiffness: float = math.inf
    """EA, N: strain is tension over it."""
    home_tension: float = 0.0

    def length(self, line: int, position: Vector, rotation: Matrix) -> float:
        """Cable from the point of the axis where it first touches the pulley to its anchor."""
        upright = 1.0 if line < UPPER else -1.0
        arm = _turned(rotation, self.anchor[line])
        seen = [position[k] + arm[k] - self.exit[line][k] for k in range(3)]
        away, along, radius = math.hypot(seen[0], seen[1]), upright * seen[2], self.swivel[line]
        centre = math.hypot(away - radius, along)
        free = math.sqrt(centre**2 - radius**2)
        # The cable touches where the radius is square to it: half the angle between centre line
        # and tangent, counted from the side at which the cable arrives.
        towards = math.atan2(along, away - radius)
        touch = towards + math.acos(radius / centre)
        return free + radius * (math.pi - touch)

    def wound(self, line: int, angle: float) -> float:
        """Cable on the drum, layer by layer."""
        length, radius, left = 0.0, self.winding[line], angle
        while left > 2 * math.pi:
            length += 2 * math.pi * radius
            radius += self.growth
            left -= 2 * math.pi
        return length + left * radius

    def motor_angle(self, line: int, position: Vector, rotation: Matrix, tension: float) -> float:
        """Drum angle since home, by bisection on the cable that is wound."""
        identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        at_home = self.length(line, HOME, identity) / (1 + self.home_tension / self.stiffness)
        here = self.length(line, position, rotation) / (1 + tension / self.stiffness)
        start = 2 * math.pi * self.turns
        goal = self.wound(line, start) + at_home - here
        low, high = start - 60.0, start + 60.0
        for _ in range(70):
            middle = (low + high) / 2
            low, high = (middle, high) if self.wound(line, middle) < goal else (low, middle)
        return (low + high) / 2 - start


@dataclass(frozen=True)
class Noise:
    """Standard deviations of what is measured."""

    tracker: float = 2e-5
    encoder: float = 1e-4
    rope: float = 0.0
    """Of the cable itself, m: what no model explains."""
    angle: float = 1e-3
    swivel: float = 1e-3
    length: float = 1e-4
    tension: float = 0.0
    wander: float = 0.0
    """Of the tracker from row to row, m: slow beside a pose, so that neighbours share it."""


@dataclass(frozen=True)
class Row:
    """One pose, true and as measured."""

    position: Vector
    angles: Vector
    motor_angle: tuple[float, ...]
    seen_position: Vector
    seen_angles: Vector
    swivel: tuple[float, ...]
    length: tuple[float, ...]
    tension: tuple[float, ...]
    temperature: float = 20.0


def poses(
    truth: Truth,
    count: int,
    seed: int,
    *,
    box: float = 0.075,
    tilt: float = math.radians(7.5),
    noise: Noise | None = None,
    tension: Callable[[random.Random], float] = lambda rng: 0.0,
) -> list[Row]:
    """Random poses about home and what instruments say there."""
    rng, noise = random.Random(seed), noise or Noise()
    return [
        _row(truth, rng, box=box, tilt=tilt, noise=noise, tension=tension) for _ in range(count)
    ]


def _row(
    truth: Truth,
    rng: random.Random,
    *,
    box: float,
    tilt: float,
    noise: Noise,
    tension: Callable[[random.Random], float],
) -> Row:
    x, y, z = (h + rng.uniform(-box, box) for h in HOME)
    roll, pitch, yaw = (rng.uniform(-tilt, tilt) for _ in range(3))
    place, rotation = (x, y, z), turn(roll, pitch, yaw)
    lines = range(len(truth.exit))
    pull = [tension(rng) for _ in lines]
    motor = []
    for i in lines:
        slip = rng.gauss(0, noise.rope) / truth.winding[i]
        exact = truth.motor_angle(i, place, rotation, pull[i])
        motor.append(exact + slip + rng.gauss(0, noise.encoder))

    def seen(values: Sequence[float], sigma: float) -> tuple[float, ...]:
        return tuple(value + rng.gauss(0, sigma) for value in values)

    sx, sy, sz = seen(place, noise.tracker)
    a, b, c = seen((roll, pitch, yaw), noise.angle)
    swivel = [_swivel(truth, i, place, rotation) + 0.3 * i - 1 for i in lines]
    length = [truth.length(i, place, rotation) + 0.01 * i for i in lines]
    return Row(
        place,
        (roll, pitch, yaw),
        tuple(motor),
        (sx, sy, sz),
        (a, b, c),
        seen(swivel, noise.swivel),
        seen(length, noise.length),
        seen(pull, noise.tension),
    )


def _swivel(truth: Truth, line: int, position: Vector, rotation: Matrix) -> float:
    """Right-handed about the swivel axis, from wherever."""
    arm = _turned(rotation, truth.anchor[line])
    x, y = (position[k] + arm[k] - truth.exit[line][k] for k in range(2))
    return math.atan2(y, x) if line < UPPER else -math.atan2(y, x)


def turn(roll: float, pitch: float, yaw: float) -> Matrix:
    """Rz(yaw) Ry(pitch) Rx(roll), one axis after another."""
    columns = []
    for unit in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        x, y, z = unit
        y, z = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
        x, z = x * math.cos(pitch) + z * math.sin(pitch), z * math.cos(pitch) - x * math.sin(pitch)
        x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
        columns.append((x, y, z))
    first, second, third = zip(*columns, strict=True)
    return first, second, third


def _turned(rotation: Matrix, point: Vector) -> list[float]:
    return [sum(row[k] * point[k] for k in range(3)) for row in rotation]


def csv(
    rows: Sequence[Row],
    *,
    position: bool = True,
    angles: bool = False,
    swivel: bool = False,
    length: bool = False,
    tension: bool = False,
    temperature: bool = False,
) -> str:
    """A robot's run with the columns wanted."""
    header = ["time [s]", *(f"{i + 1}.motor_angle [rad]" for i in range(8))]
    names = ("x", "y", "z")
    header += [f"platform_{n} [m]" for n in names] if position else []
    header += [f"platform_{n} [rad]" for n in ("roll", "pitch", "yaw")] if angles else []
    header += [f"{i + 1}.swivel [rad]" for i in range(8)] if swivel else []
    header += [f"{i + 1}.cable_length [m]" for i in range(8)] if length else []
    header += [f"{i + 1}.tension [N]" for i in range(8)] if tension else []
    header += ["temperature [degC]"] if temperature else []
    lines = [",".join(header)]
    for number, row in enumerate(rows):
        cells = [float(number), *row.motor_angle]
        cells += row.seen_position if position else ()
        cells += row.seen_angles if angles else ()
        cells += row.swivel if swivel else ()
        cells += row.length if length else ()
        cells += row.tension if tension else ()
        cells += (row.temperature,) if temperature else ()
        lines.append(",".join(repr(cell) for cell in cells))
    return "\n".join(lines) + "\n"


def elastic(truth: Truth, stiffness: float, home_tension: float) -> Truth:
    """The same robot with cables that stretch."""
    return replace(truth, stiffness=stiffness, home_tension=home_tension)

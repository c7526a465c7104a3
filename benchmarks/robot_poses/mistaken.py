"""Tables of poses of the shipped robots with the mistakes of a first day in them.

The robots are read from ``profiles/*.toml`` and computed here: nothing is shared with winchkit's
geometry. The truth differs from the profile by what a calibration is for.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array

_PROFILES = Path(__file__).parents[2] / "profiles"
_UNITS = {"mm": 1e-3, "m": 1.0, "deg": np.pi / 180, "rad": 1.0}
_MOTION = {"cabtive": (0.075, 7.5), "ipanema3": (1.0, 10.0), "winding-device-8": (0.35, 8.0)}
"""Half width of the volume about home, m, and largest angle, deg."""
ROBOTS = tuple(_MOTION)
_TURN = 2 * np.pi


@dataclass(frozen=True)
class Table:
    """What the controller and the tracker wrote, a row per pose."""

    motor: Array
    """(p, n), rad."""
    position: Array
    """(p, 3), m."""
    rotation: Array
    """(p, 3, 3), platform to the tracker's axes."""
    angles: Array
    """(p, 3) as written: numbers that are read as roll, pitch and yaw in rad."""
    oriented: bool
    """Whether rotations were written."""

    def csv(self) -> str:
        """The run as winchkit reads it."""
        names = [f"{i + 1}.motor_angle [rad]" for i in range(self.motor.shape[1])]
        columns = [self.motor, self.position]
        names += [f"platform_{axis} [m]" for axis in "xyz"]
        if self.oriented:
            names += [f"platform_{angle} [rad]" for angle in ("roll", "pitch", "yaw")]
            columns.append(self.angles)
        rows = np.concatenate(columns, axis=1).tolist()
        return "\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n"


@dataclass(frozen=True)
class Mistake:
    """A mistake of a kind: what it does to a table, and the codes under which it may be named."""

    kind: str
    apply: Callable[[Table], Table]
    codes: frozenset[str]


@dataclass(frozen=True)
class Scene:
    """A robot, how it was measured, and the mistakes in its table."""

    robot: str
    known_frame: bool
    oriented: bool
    poses: int
    tracker: float
    """Standard deviation of a coordinate, m."""
    geometry: float
    """Standard deviation of the errors of exit and anchor points, m."""
    seed: int
    mistakes: tuple[str, ...] = ()


def number(text: Any) -> float:
    """A quantity of a profile, SI."""
    if isinstance(text, str):
        value, unit = text.split()
        return float(value) * _UNITS[unit]
    return float(text)


def product(angles: Array, order: str = "zyx") -> Array:
    """Product of the elementary rotations in this order, (p, 3, 3); ``zyx``: Rz(c) Ry(b) Rx(a)."""
    out = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for axis in order:
        k = "xyz".index(axis)
        i, j = (k + 1) % 3, (k + 2) % 3
        cosine, sine = np.cos(angles[:, k]), np.sin(angles[:, k])
        one = np.zeros((len(angles), 3, 3))
        one[:, k, k] = 1.0
        one[:, i, i], one[:, j, j] = cosine, cosine
        one[:, i, j], one[:, j, i] = -sine, sine
        out = out @ one
    return out


def angles_of(rotation: Array) -> Array:
    """Roll, pitch and yaw of Rz(yaw) Ry(pitch) Rx(roll)."""
    r = rotation
    return np.stack(
        [
            np.arctan2(r[:, 2, 1], r[:, 2, 2]),
            -np.arcsin(np.clip(r[:, 2, 0], -1, 1)),
            np.arctan2(r[:, 1, 0], r[:, 0, 0]),
        ],
        axis=1,
    )


def profile_text(robot: str, *, known_frame: bool) -> str:
    """The shipped profile; with the tracker's frame declared unknown."""
    text = (_PROFILES / f"{robot}.toml").read_text()
    return text if known_frame else text + '\n[instrument.tracker]\nframe = "unknown"\n'


def recorded(scene: Scene) -> Table:
    """The table of a scene without its mistakes."""
    rng = np.random.default_rng(scene.seed)
    tree = tomllib.loads((_PROFILES / f"{scene.robot}.toml").read_text())
    lines, home = tree["line"], np.array([number(x) for x in tree["home"]["position"]])
    exits, anchors = (
        np.array([[number(x) for x in line[name]] for line in lines])
        + rng.normal(0, scene.geometry, (len(lines), 3))
        for name in ("exit_point", "anchor_point")
    )
    radius = np.array([number(line.get("swivel_radius", 0.0)) for line in lines])
    axis = np.array([line.get("swivel_axis", [0, 0, 1]) for line in lines], dtype=float)
    box, tilt = _MOTION[scene.robot]
    position = home + rng.uniform(-box, box, (scene.poses, 3))
    angles = np.radians(rng.uniform(-tilt, tilt, (scene.poses, 3)))
    rotation = product(angles)
    here = _lengths((exits, anchors, radius, axis), position, rotation)
    there = _lengths((exits, anchors, radius, axis), home[None], np.eye(3)[None])
    winch = tomllib.loads((_PROFILES / f"{lines[0]['winch']}.toml").read_text())
    drums = 1 + rng.normal(0, 4e-3, len(lines))
    wound = (there - here) + rng.normal(0, 5e-5, here.shape)
    motor = np.stack([_motor(winch, wound[:, i], drums[i]) for i in range(len(lines))], axis=1)
    turned, shift = np.eye(3), np.zeros(3)
    if not scene.known_frame:
        turned = product(rng.uniform(-np.pi, np.pi, (1, 3)))[0]
        shift = rng.normal(0, 2.0, 3)
    seen = position @ turned.T + shift + rng.normal(0, scene.tracker, position.shape)
    shown = turned @ rotation @ product(rng.normal(0, 1e-3, angles.shape))
    return Table(motor, seen, shown, angles_of(shown), scene.oriented)


def _lengths(points: tuple[Array, Array, Array, Array], position: Array, rotation: Array) -> Array:
    """Cable from where it first touches its pulley to its anchor, (p, n).

    ``points``: exit and anchor points (n, 3), radii (n,) and axes (n, 3) of the pulleys.
    """
    e, b, r, s = points
    seen = position[:, None] + np.einsum("pij,nj->pni", rotation, b) - e
    along = np.sum(seen * s, axis=2)
    away = np.linalg.norm(seen - along[..., None] * s, axis=2)
    centre = np.hypot(away - r, along)
    free = np.sqrt(centre**2 - r**2)
    # The cable touches where the radius is square to it.
    touch = np.arctan2(along, away - r) + np.arccos(r / centre)
    return np.asarray(free + r * (np.pi - touch))


def _motor(winch: dict[str, Any], wound: Array, share: float) -> Array:
    """Motor angle by which a drum winds this much cable from home, by bisection."""
    drum, ratio = winch["drum"], winch["gearbox"]["ratio"]
    radius = number(drum["winding_radius"]) * share
    start = _TURN * winch["reference"]["wound_turns"]

    def cable(angle: Array) -> Array:
        if drum["kind"] == "grooved":
            return np.asarray(np.hypot(radius, number(drum["groove_pitch"]) / _TURN) * angle)
        n, growth = np.floor(angle / _TURN), number(winch["cable"]["diameter"])
        full = _TURN * (n * radius + growth * n * (n - 1) / 2)
        return np.asarray(full + (angle - _TURN * n) * (radius + n * growth))

    goal = cable(np.array(start)) + wound
    low, high = np.full_like(wound, start - 200.0), np.full_like(wound, start + 200.0)
    for _ in range(60):
        middle = (low + high) / 2
        below = cable(middle) < goal
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return (low + high) / 2 * ratio - start * ratio


def _swap(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    i, j = sorted(rng.choice(count, 2, replace=False).tolist())
    order = np.arange(count)
    order[[i, j]] = order[[j, i]]
    return lambda t: replace(t, motor=t.motor[:, order]), {f"motor-columns:{i + 1}-{j + 1}"}


def _sign(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    i = int(rng.integers(count))
    sign = np.where(np.arange(count) == i, -1.0, 1.0)
    return lambda t: replace(t, motor=t.motor * sign), {f"motor-sign:{i + 1}"}


def _signs(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    return lambda t: replace(t, motor=-t.motor), {"motor-sign:all"}


def _motor_unit(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    unit, factor = (("deg", 180 / np.pi), ("turns", 1 / _TURN))[int(rng.integers(2))]
    return lambda t: replace(t, motor=t.motor * factor), {f"motor-unit:{unit}"}


def _shift(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    rows = int(rng.choice([-2, -1, 1, 2]))

    def shifted(t: Table) -> Table:
        motor, pose = (slice(None, -rows), slice(rows, None))
        if rows < 0:
            motor, pose = (slice(-rows, None), slice(None, rows))
        return replace(
            t, motor=t.motor[motor], position=t.position[pose],
            rotation=t.rotation[pose], angles=t.angles[pose],
        )  # fmt: skip

    return shifted, {f"rows:{rows}"}


def _axes(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    """Two position columns exchanged."""
    i, j = sorted(rng.choice(3, 2, replace=False).tolist())
    order = np.arange(3)
    order[[i, j]] = order[[j, i]]
    return lambda t: replace(t, position=t.position[:, order]), {"position-axes", "mirrored"}


def _mirror(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    """A left-handed frame: one axis of all that the tracker shows has the other sign."""
    mirror = np.diag(np.where(np.arange(3) == rng.integers(3), -1.0, 1.0))

    def mirrored(t: Table) -> Table:
        shown = mirror @ t.rotation @ mirror
        return replace(t, position=t.position @ mirror, rotation=shown, angles=angles_of(shown))

    return mirrored, {"position-axes", "mirrored"}


def _unit(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    unit, factor = (("mm", 1e3), ("inch", 1 / 0.0254), ("cm", 100.0))[int(rng.integers(3))]
    return lambda t: replace(t, position=t.position * factor), {f"position-unit:{unit}"}


def _degrees(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    return lambda t: replace(t, angles=np.degrees(t.angles)), {"rotation-unit:deg"}


def _transposed(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    def back(t: Table) -> Table:
        shown = np.swapaxes(t.rotation, 1, 2)
        return replace(t, rotation=shown, angles=angles_of(shown))

    return back, {"rotation:transposed"}


def _order(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    """Angles of another product of the elementary rotations: intrinsic and extrinsic exchanged."""
    return lambda t: replace(t, angles=_angles_xyz(t.rotation)), {"rotation:xyz"}


def _angles_xyz(r: Array) -> Array:
    """Angles of Rx(a) Ry(b) Rz(c)."""
    return np.stack(
        [
            np.arctan2(-r[:, 1, 2], r[:, 2, 2]),
            np.arcsin(np.clip(r[:, 0, 2], -1, 1)),
            np.arctan2(-r[:, 0, 1], r[:, 0, 0]),
        ],
        axis=1,
    )


def _columns(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    """Yaw, pitch and roll in the columns of roll, pitch and yaw."""
    return lambda t: replace(t, angles=t.angles[:, ::-1]), {"rotation:reversed"}


def _scalar_last(rng: np.random.Generator, count: int) -> tuple[Callable[[Table], Table], set[str]]:
    """Quaternions x, y, z, w that are read as w, x, y, z."""

    def read(t: Table) -> Table:
        x, y, z, w = _quaternion(t.rotation).T
        shown = _rotation(x, y, z, w)
        return replace(t, rotation=shown, angles=angles_of(shown))

    return read, {"rotation:xyzw"}


def _quaternion(r: Array) -> Array:
    """Unit quaternions as x, y, z, w."""
    return np.asarray(np.linalg.eigh(_davenport(r)).eigenvectors[..., -1])


def _davenport(r: Array) -> Array:
    """Davenport's matrix, whose eigenvector of the largest eigenvalue is the quaternion."""
    out = np.zeros((len(r), 4, 4))
    trace = np.trace(r, axis1=1, axis2=2)
    out[:, :3, :3] = r + np.swapaxes(r, 1, 2) - trace[:, None, None] * np.eye(3)
    z = np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], 1)
    out[:, :3, 3], out[:, 3, :3], out[:, 3, 3] = z, z, trace
    return out


def _rotation(w: Array, x: Array, y: Array, z: Array) -> Array:
    """Rotations of unit quaternions."""
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


_Maker = Callable[[np.random.Generator, int], tuple[Callable[[Table], Table], set[str]]]
_OF_POSITIONS: dict[str, _Maker] = {
    "swap": _swap, "sign": _sign, "all signs": _signs, "motor unit": _motor_unit,
    "shift": _shift, "axes": _axes, "mirror": _mirror, "position unit": _unit,
}  # fmt: skip
_OF_ROTATIONS: dict[str, _Maker] = {
    "transposed": _transposed, "order": _order, "columns": _columns, "xyzw": _scalar_last,
    "degrees": _degrees,
}  # fmt: skip
_GROUP = {
    "all signs": "signs", "sign": "signs", "axes": "axes", "mirror": "axes",
    "transposed": "convention", "order": "convention", "columns": "convention",
    "xyzw": "convention",
}  # fmt: skip
"""Two of one group are a third kind, or none."""
KINDS = (*_OF_POSITIONS, *_OF_ROTATIONS)


def mistake_of(kind: str, seed: int, lines: int) -> Mistake:
    """A mistake of a kind, drawn by the seed."""
    maker = {**_OF_POSITIONS, **_OF_ROTATIONS}[kind]
    apply, codes = maker(np.random.default_rng(seed), lines)
    return Mistake(kind, apply, frozenset(codes))


def scenes(count: int, seed: int, mistakes: Sequence[int]) -> list[Scene]:
    """Scenes with as many mistakes as ``mistakes`` says in turn, all else drawn at random."""
    rng = np.random.default_rng(seed)
    out = []
    for index in range(count):
        wanted = mistakes[index % len(mistakes)]
        oriented = bool(rng.random() < 0.5)
        pool = list(KINDS if oriented else _OF_POSITIONS)
        chosen: list[str] = []
        while len(chosen) < wanted:
            kind = str(rng.choice(pool))
            groups = {_GROUP.get(k, k) for k in chosen}
            # Angles in degrees come last: no other convention is written beside them.
            if _GROUP.get(kind, kind) not in groups:
                chosen.append(kind)
        chosen.sort(key=KINDS.index)
        out.append(
            Scene(
                robot=str(rng.choice(ROBOTS)),
                known_frame=bool(rng.random() < 0.5),
                oriented=oriented,
                poses=int(rng.integers(40, 100)),
                tracker=float(10 ** rng.uniform(-4.7, -3.3)),
                geometry=float(10 ** rng.uniform(-2.7, -1.9)),
                seed=int(rng.integers(2**31)),
                mistakes=tuple(chosen),
            )
        )
    return out


def mistaken(scene: Scene) -> tuple[Table, tuple[Mistake, ...]]:
    """The table of a scene with its mistakes, and these."""
    table = recorded(scene)
    made = tuple(
        mistake_of(kind, scene.seed + n + 1, table.motor.shape[1])
        for n, kind in enumerate(scene.mistakes)
    )
    for mistake in made:
        table = mistake.apply(table)
    return table, made

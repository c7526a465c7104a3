"""The mistakes that a table of poses may contain, each with the data as they would be without it.

A mistake is of the motor angles, of the rows, of the positions or of the rotations. Its ``mended``
gives the table without it; ``code`` names it for programmes, ``text`` and ``cure`` for people. Two
mistakes that give the same data have one entry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, permutations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.model.rotation import (
    angles_of,
    quaternion_of,
    rotation_by,
    rotation_from_quaternion,
    rotation_of,
)
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.robot import Robot

MOST_ROWS = 3
"""Rows by which the poses may be shifted against the motor angles; alone a third of the table.
Rule of thumb."""
_MOTOR_UNITS = {
    "deg": (np.pi / 180, "degrees"),
    "turns": (2 * np.pi, "turns"),
    "rad for deg": (180 / np.pi, "radians, and are read as degrees"),
    "rad for turns": (1 / (2 * np.pi), "radians, and are read as turns"),
}
POSITION_UNITS = {
    "mm": (1e-3, "millimetres, and are read as metres"),
    "cm": (1e-2, "centimetres, and are read as metres"),
    "inch": (0.0254, "inches, and are read as metres"),
    "inch for mm": (25.4, "inches, and are read as millimetres"),
    "m": (1e3, "metres, and are read as millimetres"),
}
"""Factor to what was meant, and the words, by the unit in which positions may have been written."""


@dataclass(frozen=True)
class Mistake:
    """A mistake that a table of poses may contain."""

    code: str
    text: str
    cure: str
    mended: Callable[[MeasuredPoses], MeasuredPoses]
    """The table without the mistake."""
    axes: Array = field(default_factory=lambda: np.eye(3))
    """Of positions: those shown are ``axes`` @ those meant, (3, 3)."""


def motor_mistakes(robot: Robot) -> Iterator[Mistake]:
    """Exchanged columns, signs and units of the motor angles."""
    names = robot.names
    for i, j in combinations(range(len(names)), 2):
        order = np.arange(len(names))
        order[[i, j]] = j, i
        yield Mistake(
            f"motor-columns:{names[i]}-{names[j]}",
            f"the motor angles of lines {names[i]} and {names[j]} are exchanged",
            f"exchange the columns '{names[i]}.motor_angle' and '{names[j]}.motor_angle', or "
            "import them so",
            _of("motor_angle", _columns(order)),
        )
    for i, name in enumerate(names):
        sign = np.where(np.arange(len(names)) == i, -1.0, 1.0)
        yield Mistake(
            f"motor-sign:{name}",
            f"the motor angle of line {name} has the other sign",
            f"negate '{name}.motor_angle', or set gearbox.direction of its winch",
            _of("motor_angle", _times(sign)),
        )
    yield Mistake(
        "motor-sign:all",
        "all motor angles have the other sign",
        "negate them, or set gearbox.direction of the winches",
        _of("motor_angle", _times(-1.0)),
    )
    for unit, (factor, words) in _MOTOR_UNITS.items():
        yield Mistake(
            f"motor-unit:{unit}",
            f"the motor angles are in {words}",
            "write their unit into the header, e.g. '1.motor_angle [deg]'",
            _of("motor_angle", _times(factor)),
        )
    ratios = np.array([winch.gearbox.ratio for winch in robot.winches])
    if np.any(ratios != 1.0):
        yield Mistake(
            "motor-unit:drum",
            "the motor angles are those of the drums, behind the gearboxes",
            "multiply them by gearbox.ratio",
            _of("motor_angle", _times(ratios)),
        )


def row_mistakes(most: int = MOST_ROWS) -> list[Mistake]:
    """Rows of the poses shifted against those of the motor angles."""
    return [_shift(rows) for rows in range(-most, most + 1) if rows]


def _shift(rows: int) -> Mistake:
    count, way = abs(rows), "earlier" if rows > 0 else "later"
    s = "s" if count > 1 else ""

    def mended(measured: MeasuredPoses) -> MeasuredPoses:
        """The poses of row i beside the motor angles of row i + ``rows``."""
        pose, motor = slice(0, len(measured) - count), slice(count, None)
        if rows < 0:
            pose, motor = motor, pose
        kept = np.zeros(len(measured), dtype=bool)
        kept[motor] = True
        return replace(
            measured[kept], position=measured.position[pose], angles=measured.angles[pose]
        )

    return Mistake(
        f"rows:{rows}",
        f"the poses are shifted by {count} row{s} against the motor angles",
        f"each pose belongs to the motor angles {count} row{s} {way}: join the tables by the "
        "names of the points",
        mended,
    )


def axes_mistake(axes: Array) -> Mistake:
    """Positions whose columns are other axes: those shown are ``axes`` @ those meant, (3, 3)."""
    columns = []
    for row in np.round(axes):
        k = int(np.argmax(np.abs(row)))
        columns.append(("-" if row[k] < 0 else "") + "xyz"[k])
    listed = ", ".join(columns)
    return Mistake(
        "position-axes",
        f"platform_x, platform_y and platform_z hold {listed} of the base frame",
        "exchange the columns, or negate them: axes are right-handed",
        _of("position", lambda p: p @ np.round(axes)),
        np.round(axes),
    )


MIRRORED = Mistake(
    "mirrored",
    "the positions are mirrored: their axes are left-handed",
    "negate one column of the positions, or exchange two, as the tracker's frame requires",
    lambda m: replace(m, position=-m.position),
)

UNKNOWN = Mistake(
    "poses-unlike",
    "motor angles and positions are not those of this robot",
    "no exchange, sign, shift, axis or unit alone or in pairs explains it: check that the rows "
    "belong together, by the names of the points, that no cable slipped, and the profile",
    lambda m: m,
)
UNKNOWN_ROTATIONS = Mistake(
    "rotations-unlike",
    "the measured rotations are not those of these poses",
    "no unit or convention explains it: check them and whether a cable slipped or a motor lost its "
    "zero between two rows, or leave their columns out",
    lambda m: m,
)


def unit_mistake(unit: str) -> Mistake:
    """Positions in another unit."""
    factor, words = POSITION_UNITS[unit]
    return Mistake(
        f"position-unit:{unit}",
        f"the positions are in {words}",
        "write their unit into the header, e.g. 'platform_x [mm]'",
        _of("position", _times(factor)),
    )


def rotation_mistakes() -> Iterator[Mistake]:
    """Units and conventions of the rotations."""
    yield _turned(
        "transposed",
        "are those of the base in the platform's axes (R transposed)",
        "transpose them",
        lambda a: np.swapaxes(rotation_of(*a.T), 1, 2),
    )
    yield _turned(
        "xyzw",
        "were read from quaternions with the scalar last (x, y, z, w)",
        "name the columns in their order",
        _quaternions([3, 0, 1, 2]),
    )
    yield _turned(
        "wxyz",
        "were read as quaternions with the scalar last, which stands first (w, x, y, z)",
        "name the columns in their order",
        _quaternions([1, 2, 3, 0]),
    )
    yield _turned(
        "vector",
        "are rotation vectors (axis times angle)",
        "convert them to roll, pitch and yaw or to quaternions",
        rotation_by,
    )
    for k, name in enumerate(("roll", "pitch", "yaw")):
        sign = np.where(np.arange(3) == k, -1.0, 1.0)
        yield Mistake(
            f"rotation-sign:{name}",
            f"the rotations have the other sign of {name}",
            f"negate platform_{name}",
            _of("angles", _times(sign)),
        )
    for order, columns in product(permutations("xyz"), permutations(range(3))):
        if (order, columns) == (("z", "y", "x"), (0, 1, 2)):
            continue
        yield _euler("".join(order), columns)
    in_header = "write their unit into the header, e.g. 'platform_roll [deg]'"
    for factor, code, words, cure in (
        (np.pi / 180, "deg", "degrees, and are read as radians", in_header),
        (180 / np.pi, "rad", "radians, and are read as degrees", in_header),
        (0.9, "gon", "gon, and are read as degrees", "multiply them by 0.9"),
    ):
        yield Mistake(
            f"rotation-unit:{code}",
            f"the rotations are in {words}",
            cure,
            _of("angles", _times(factor)),
        )


def _euler(order: str, columns: tuple[int, ...]) -> Mistake:
    """Angles about x, y and z in these columns, of the product of rotations in this order."""
    names = [("roll", "pitch", "yaw")[columns.index(k)] for k in range(3)]
    factors = " ".join(f"R{axis}({names['xyz'.index(axis)]})" for axis in order)
    code = order if columns == (0, 1, 2) else f"{order}-{''.join(map(str, columns))}"
    if (order, columns) == ("zyx", (2, 1, 0)):
        code = "reversed"

    def turned(angles: Array) -> Array:
        out = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
        for axis in order:
            k = "xyz".index(axis)
            vector = np.zeros((len(angles), 3))
            vector[:, k] = angles[:, columns.index(k)]
            out = out @ rotation_by(vector)
        return np.asarray(out)

    return _turned(
        code,
        f"are {factors}, and are read as Rz(yaw) Ry(pitch) Rx(roll)",
        "convert them, or exchange the columns where these are in another order",
        turned,
    )


def _quaternions(order: list[int]) -> Callable[[Array], Array]:
    """Rotations of quaternions whose components were read in another order."""
    return lambda angles: rotation_from_quaternion(quaternion_of(rotation_of(*angles.T))[:, order])


def _turned(code: str, words: str, cure: str, convert: Callable[[Array], Array]) -> Mistake:
    def mended(measured: MeasuredPoses) -> MeasuredPoses:
        whole = np.all(np.isfinite(measured.angles), axis=1)
        angles = np.full_like(measured.angles, np.nan)
        angles[whole] = angles_of(convert(measured.angles[whole]))
        return replace(measured, angles=angles)

    return Mistake(f"rotation:{code}", f"the rotations {words}", cure, mended)


def _times(factor: Array | float) -> Callable[[Array], Array]:
    return lambda values: np.asarray(values * factor)


def _columns(order: NDArray[np.intp]) -> Callable[[Array], Array]:
    return lambda values: np.asarray(values[:, order])


def _of(name: str, change: Callable[[Array], Array]) -> Callable[[MeasuredPoses], MeasuredPoses]:
    def mended(measured: MeasuredPoses) -> MeasuredPoses:
        changed: dict[str, Any] = {name: change(getattr(measured, name))}
        return replace(measured, **changed)

    return mended


def mended(measured: MeasuredPoses, mistakes: Sequence[Mistake]) -> MeasuredPoses:
    """The table without these mistakes."""
    for mistake in mistakes:
        measured = mistake.mended(measured)
    return measured

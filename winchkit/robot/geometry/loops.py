"""Inverse kinematics of one pose in loops that numba compiles unchanged.

A pose is twelve floats (position, then the rotation by rows), a line is an object or a record with
the fields of :class:`CableLine`; results go into sequences that are handed in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, floor, nan, pi, sqrt
from typing import Any

Function = Callable[..., Any]
_TURN = 2.0 * pi
LEAST_WRAP = -1e-6
"""rad: a wrap of zero may come out negative by rounding (1e-16; 1e-8 near an anchor at the tangent)
and is no full turn."""
_EDGE = 1e-12
"""Turns: a whole number of turns stays whole in spite of the rounding (1e-16 of 100 turns)."""


@dataclass(slots=True)
class CableLine:
    """One line for the loops, SI; made by :func:`winchkit.robot.cables_of`."""

    ex: float
    ey: float
    ez: float
    bx: float
    by: float
    bz: float
    sx: float
    sy: float
    sz: float
    radius: float
    """Of the swivel pulley."""
    home_length: float
    stepped: float
    """1 for a drum whose radius steps once a turn, else 0."""
    winding: float
    """Winding radius of the first layer."""
    growth: float
    """Radius gained a turn."""
    home_wound: float
    """Cable on the drum at home, m."""
    home_angle: float
    """Angle wound at home, rad."""
    ratio: float
    """Motor angle per drum angle, signed by the direction."""
    motor_angle: float
    """At home."""
    dead_length: float
    """Stressed cable between drum and exit point."""


def cables_loop(steep: bool) -> Function:
    """Loop of cable lengths; with ``steep`` each is followed by its gradient by the pose (6)."""
    width = 7 if steep else 1

    def cables(lines: Any, pose: Any, rows: Any) -> None:
        px, py, pz, xx, xy, xz = pose[0], pose[1], pose[2], pose[3], pose[4], pose[5]
        yx, yy, yz, zx, zy, zz = pose[6], pose[7], pose[8], pose[9], pose[10], pose[11]
        for i in range(len(lines)):
            line = lines[i]
            bx, by, bz = line.bx, line.by, line.bz
            ax = xx * bx + xy * by + xz * bz
            ay = yx * bx + yy * by + yz * bz
            az = zx * bx + zy * by + zz * bz
            vx, vy, vz = px + ax - line.ex, py + ay - line.ey, pz + az - line.ez
            sx, sy, sz, radius = line.sx, line.sy, line.sz, line.radius
            along = vx * sx + vy * sy + vz * sz
            hx, hy, hz = vx - along * sx, vy - along * sy, vz - along * sz
            distance = sqrt(hx * hx + hy * hy + hz * hz)
            over = distance - radius
            square = over * over + along * along
            inside = square - radius * radius
            free = sqrt(inside) if inside >= 0.0 else nan
            sine, cosine = over * free + along * radius, along * free - over * radius
            wrap = atan2(sine, cosine)
            if wrap < LEAST_WRAP:
                wrap += _TURN
            g = width * i
            rows[g] = radius * wrap + free
            if steep:
                if square == 0.0:
                    square = nan
                lean = sine / (square * distance) if distance > 0.0 else 0.0
                rise = cosine / square
                ux, uy, uz = hx * lean + rise * sx, hy * lean + rise * sy, hz * lean + rise * sz
                rows[g + 1], rows[g + 2], rows[g + 3] = ux, uy, uz
                rows[g + 4] = ay * uz - az * uy
                rows[g + 5] = az * ux - ax * uz
                rows[g + 6] = ax * uy - ay * ux

    return cables


def wound_angle(line: Any, wound: float) -> float:
    """Angle at which ``wound`` metres are on the drum (closed form of each law, model/drum.py)."""
    # Also for NaN, which has no whole turns.
    if not wound > 0.0:
        return wound / line.winding  # type: ignore[no-any-return]
    winding, growth = line.winding, line.growth
    if line.stepped == 0.0:
        return 2.0 * wound / (winding + sqrt(winding * winding + growth * wound / pi))  # type: ignore[no-any-return]
    half, turns = winding - growth / 2.0, wound / _TURN
    n = floor(2.0 * turns / (half + sqrt(half * half + 2.0 * growth * turns)) + _EDGE)
    full = _TURN * n * (winding + growth * (n - 1) / 2.0)
    return _TURN * n + (wound - full) / (winding + n * growth)  # type: ignore[no-any-return]


def motors_loop(cables: Function, wound_angle: Function) -> Function:
    """Motor angles at a pose with cables strained by ``strains``, relative to those at home."""

    def motors(lines: Any, pose: Any, strains: Any, lengths: Any, angles: Any) -> None:
        cables(lines, pose, lengths)
        for i in range(len(lines)):
            line = lines[i]
            length = lengths[i]
            slack = length - strains[i] * (length + line.dead_length)
            turned = wound_angle(line, line.home_wound + line.home_length - slack)
            angles[i] = line.motor_angle + line.ratio * (turned - line.home_angle)

    return motors

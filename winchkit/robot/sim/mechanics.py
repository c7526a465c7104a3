"""Newton-Euler mechanics of a rigid platform on elastic cables, one step, in plain loops.

The same source runs in plain Python and compiled by numba, which is 50 times as fast.

A cable is a row of ``CABLE`` floats: exit point, swivel axis, pulley radius, and anchor point less
the centre of mass in the frame of the body. Results of a pose are a row of ``ROW`` floats: length,
unit vector from pulley to anchor, its moment about the centre of mass, and wrap. Rotations are nine
floats by rows. The sequences are lists in plain Python, and arrays where compiled.

A cable reaches its pulley at the exit point along the swivel axis s. With n the direction from the
axis to the anchor, the pulley's centre at r n from the exit point, and the anchor at (X, Y) from
the centre along n and s, the point at the wrap φ is r(−cos φ, sin φ), the cable leaves it along
(sin φ, cos φ), and with the free length f = √(X² + Y² − r²)

    sin φ = (f X + r Y)/(X² + Y²),  cos φ = (f Y − r X)/(X² + Y²).
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, nan, pi, sin, sqrt
from typing import Any

CABLE, ROW, WORK = 10, 8, 72
"""Floats of a cable, of a row of results, and of the working space: lengths of the sequences above.
"""
_SMALL = 1e-8
"""rad: below it the series is exact to rounding (1e-8² = 1e-16)."""
_BEHIND = -1e-9
"""rad: rounding of a wrap of zero, which is no full turn."""
_TURN = 2.0 * pi


def rotated(x: float, y: float, z: float, rotation: Any, out: Any) -> None:
    """Turn a rotation by a rotation vector (rad), by Rodrigues' formula; ``out`` has nine."""
    square = x * x + y * y + z * z
    angle = sqrt(square)
    first, second = 1.0 - square / 6.0, 0.5
    if angle > _SMALL:
        first, second = sin(angle) / angle, (1.0 - cos(angle)) / square
    xx = 1.0 - second * (y * y + z * z)
    yy = 1.0 - second * (x * x + z * z)
    zz = 1.0 - second * (x * x + y * y)
    xy, xz, yz = second * x * y, second * x * z, second * y * z
    fx, fy, fz = first * x, first * y, first * z
    for k in range(3):
        a, b, c = rotation[k], rotation[3 + k], rotation[6 + k]
        out[k] = xx * a + (xy - fz) * b + (xz + fy) * c
        out[3 + k] = (xy + fz) * a + yy * b + (yz - fx) * c
        out[6 + k] = (xz - fy) * a + (yz + fx) * b + zz * c


def cables(lines: Any, center: Any, rotation: Any, rows: Any) -> None:
    """Lengths (m), directions, moments and wraps (rad) of the cables at a pose, into ``rows``."""
    px, py, pz = center[0], center[1], center[2]
    xx, xy, xz = rotation[0], rotation[1], rotation[2]
    yx, yy, yz = rotation[3], rotation[4], rotation[5]
    zx, zy, zz = rotation[6], rotation[7], rotation[8]
    for i in range(len(lines) // CABLE):
        g = CABLE * i
        sx, sy, sz, r = lines[g + 3], lines[g + 4], lines[g + 5], lines[g + 6]
        bx, by, bz = lines[g + 7], lines[g + 8], lines[g + 9]
        ax = xx * bx + xy * by + xz * bz
        ay = yx * bx + yy * by + yz * bz
        az = zx * bx + zy * by + zz * bz
        vx, vy, vz = px + ax - lines[g], py + ay - lines[g + 1], pz + az - lines[g + 2]
        y = vx * sx + vy * sy + vz * sz
        hx, hy, hz = vx - y * sx, vy - y * sy, vz - y * sz
        distance = sqrt(hx * hx + hy * hy + hz * hz)
        x = distance - r
        square = x * x + y * y
        inside = square - r * r
        free = sqrt(inside) if inside >= 0.0 else nan
        sine, cosine = (free * x + r * y) / square, (free * y - r * x) / square
        wrap = atan2(sine, cosine)
        if wrap < _BEHIND:
            wrap += _TURN
        lean = sine / distance if distance > 0.0 else 0.0
        ux, uy, uz = lean * hx + cosine * sx, lean * hy + cosine * sy, lean * hz + cosine * sz
        g = ROW * i
        rows[g] = r * wrap + free
        rows[g + 1], rows[g + 2], rows[g + 3] = ux, uy, uz
        rows[g + 4] = ay * uz - az * uy
        rows[g + 5] = az * ux - ax * uz
        rows[g + 6] = ax * uy - ay * ux
        rows[g + 7] = wrap


def step(  # noqa: PLR0917 - numba takes no keywords
    dt: float,
    damping_time: float,
    lines: Any,
    body: Any,
    load: Any,
    springs: Any,
    center: Any,
    rotation: Any,
    velocity: Any,
    rows: Any,
    forces: Any,
    work: Any,
) -> None:
    """Advance pose and velocity by ``dt`` s, and the cables with them.

    ``body`` is mass, inertia (9), and for each coordinate 1, or 0 where guides hold it (6);
    ``load`` weight and wrench (6); ``springs`` has for each cable unstrained length at the end of
    the step, its rate, and stiffness; ``work`` has ``WORK``.
    Results: ``center``, ``rotation`` and ``velocity`` (linear, angular; m/s, rad/s) after the step,
    ``rows`` there, and force (N) and rate of the length (m/s) of each cable in ``forces``.
    """
    half = dt / 2.0
    here, turned, matrix, right = work[60:63], work[63:72], work[0:36], work[36:42]
    for k in range(3):
        here[k] = center[k] + half * velocity[k]
    rotated(half * velocity[3], half * velocity[4], half * velocity[5], rotation, turned)
    cables(lines, here, turned, rows)
    inertia(body, turned, velocity, matrix, right)
    for k in range(6):
        right[k] += load[k]
    for i in range(len(lines) // CABLE):
        g, s = ROW * i + 1, 3 * i
        rate, stiffness = springs[s + 1], springs[s + 2]
        stretch = rows[g - 1] - (springs[s] - half * rate)
        pull = stiffness * (stretch + damping_time * (_along(rows, g, velocity) - rate))
        if stretch > 0.0 and pull > 0.0:
            change = dt * stiffness * (dt / 4.0 + damping_time / 2.0)
            for k in range(6):
                lever = rows[g + k]
                right[k] -= pull * lever
                for j in range(k + 1):
                    matrix[6 * k + j] += change * lever * rows[g + j]
    for k in range(6):
        right[k] *= body[10 + k]
        for j in range(k):
            matrix[6 * k + j] *= body[10 + k] * body[10 + j]
    solve(matrix, right)
    for k in range(6):
        before = velocity[k]
        velocity[k] = before + dt * right[k]
        right[k] = half * (before + velocity[k])
    for k in range(3):
        center[k] += right[k]
    rotated(right[3], right[4], right[5], rotation, turned)
    for k in range(9):
        rotation[k] = turned[k]
    cables(lines, center, rotation, rows)
    for i in range(len(lines) // CABLE):
        g, s = ROW * i + 1, 3 * i
        speed = _along(rows, g, velocity)
        stretch = rows[g - 1] - springs[s]
        pull = springs[s + 2] * (stretch + damping_time * (speed - springs[s + 1]))
        forces[2 * i] = pull if stretch > 0.0 and pull > 0.0 else 0.0
        forces[2 * i + 1] = speed


def inertia(body: Any, rotation: Any, velocity: Any, matrix: Any, right: Any) -> None:
    """Mass matrix (36) at a rotation, and the gyroscopic moment as a load (6)."""
    for k in range(36):
        matrix[k] = 0.0
    for k in range(3):
        matrix[7 * k] = body[0]
        for j in range(3):
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += rotation[3 * k + a] * body[1 + 3 * a + b] * rotation[3 * j + b]
            matrix[6 * (k + 3) + j + 3] = total
    wx, wy, wz = velocity[3], velocity[4], velocity[5]
    hx = matrix[21] * wx + matrix[22] * wy + matrix[23] * wz
    hy = matrix[27] * wx + matrix[28] * wy + matrix[29] * wz
    hz = matrix[33] * wx + matrix[34] * wy + matrix[35] * wz
    right[0], right[1], right[2] = 0.0, 0.0, 0.0
    right[3], right[4], right[5] = wz * hy - wy * hz, wx * hz - wz * hx, wy * hx - wx * hy


def _along(rows: Any, first: int, velocity: Any) -> float:
    """Rate of a cable's length, m/s; its gradient begins at ``rows[first]``."""
    total = 0.0
    for k in range(6):
        total += rows[first + k] * velocity[k]
    return total


def solve(matrix: Any, right: Any) -> None:
    """Solve six positive definite equations in place by Cholesky; the lower triangle is read."""
    for i in range(6):
        for j in range(i + 1):
            total = matrix[6 * i + j]
            for k in range(j):
                total -= matrix[6 * i + k] * matrix[6 * j + k]
            matrix[6 * i + j] = sqrt(total) if i == j else total / matrix[7 * j]
    for i in range(6):
        total = right[i]
        for k in range(i):
            total -= matrix[6 * i + k] * right[k]
        right[i] = total / matrix[7 * i]
    for i in range(5, -1, -1):
        total = right[i]
        for k in range(i + 1, 6):
            total -= matrix[6 * k + i] * right[k]
        right[i] = total / matrix[7 * i]


def compiled_step() -> Callable[..., None]:
    """:func:`step` compiled by numba, in seconds unless one is found on disk; ImportError without
    it."""
    from numba import njit
    from numba.extending import register_jitable

    for function in (rotated, cables, inertia, solve, _along):
        register_jitable(function)
    found: Callable[..., None]
    try:
        found = njit(cache=True)(step)
    except RuntimeError:  # no folder to write to
        found = njit(step)
    return found

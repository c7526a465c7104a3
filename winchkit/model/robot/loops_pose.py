"""Forward kinematics and force distribution of one pose in loops that numba compiles unchanged."""

from __future__ import annotations

from collections.abc import Callable
from math import sin, sqrt
from typing import Any

__all__ = ["cholesky", "find_loop", "forces_loop", "normal", "straighten", "turn"]

Function = Callable[..., Any]
_SINGULAR = 1e-13
"""Of a pivot as a share of its diagonal element: five hundred times the rounding (2e-16), below
which no digit of the pivot is known."""
_LONGEST = 0.5
"""m and rad: over a longer step the linear form of the lengths does not hold in a robot of some
metres (rule of thumb)."""


def normal(rows: Any, values: Any, width: int, system: Any) -> None:
    """GᵀG, its lower half by rows, then Gᵀ v, with one of the ``values`` every ``width``."""
    for k in range(42):
        system[k] = 0.0
    for i in range(len(rows) // 7):
        g, value = 7 * i + 1, values[width * i]
        for a in range(6):
            slope = rows[g + a]
            for b in range(a + 1):
                system[6 * a + b] += slope * rows[g + b]
            system[36 + a] += slope * value


def cholesky(system: Any) -> bool:
    """Solve a system of :func:`normal` in place; false where it is singular."""
    for a in range(6):
        most = system[7 * a]
        for b in range(a):
            total = system[6 * a + b]
            for k in range(b):
                total -= system[6 * a + k] * system[6 * b + k]
            system[6 * a + b] = total * system[7 * b]
        total, right = most, system[36 + a]
        for k in range(a):
            total -= system[6 * a + k] * system[6 * a + k]
            right -= system[6 * a + k] * system[36 + k]
        # Also false for NaN.
        if not total > _SINGULAR * most:
            return False
        # The diagonal holds its inverse: six divisions instead of 33.
        system[7 * a] = 1.0 / sqrt(total)
        system[36 + a] = right * system[7 * a]
    for a in range(5, -1, -1):
        right = system[36 + a]
        for k in range(a + 1, 6):
            right -= system[6 * k + a] * system[36 + k]
        system[36 + a] = right * system[7 * a]
    return True


def turn(pose: Any, system: Any) -> None:
    """Move a pose by the step found: position, then R' = exp([ω]×) R."""
    x, y, z = system[39], system[40], system[41]
    square = x * x + y * y + z * z
    angle = sqrt(square)
    first = sin(angle) / angle if angle > 1e-8 else 1.0
    half = sin(angle / 2.0) / angle if angle > 1e-8 else 0.5
    second = 2.0 * half * half
    for k in range(3):
        pose[k] += system[36 + k]
        a, b, c = pose[3 + k], pose[6 + k], pose[9 + k]
        u, v, w = y * c - z * b, z * a - x * c, x * b - y * a
        pose[3 + k] = a + first * u + second * (y * w - z * v)
        pose[6 + k] = b + first * v + second * (z * u - x * w)
        pose[9 + k] = c + first * w + second * (x * v - y * u)


def straighten(pose: Any) -> None:
    """Orthonormalise the rotation's rows: rounding adds up over many cycles."""
    a, b, c, d, e, f = pose[3], pose[4], pose[5], pose[6], pose[7], pose[8]
    size = sqrt(a * a + b * b + c * c)
    a, b, c = a / size, b / size, c / size
    along = a * d + b * e + c * f
    d, e, f = d - along * a, e - along * b, f - along * c
    size = sqrt(d * d + e * e + f * f)
    d, e, f = d / size, e / size, f / size
    pose[3], pose[4], pose[5], pose[6], pose[7], pose[8] = a, b, c, d, e, f
    pose[9], pose[10], pose[11] = b * f - c * e, c * d - a * f, a * e - b * d


def find_loop(
    cables: Function, normal: Function, solve: Function, turn: Function, straighten: Function
) -> Function:
    """Loop of Gauss and Newton's method; moves the given pose, returns its steps, or −1."""

    def find(  # noqa: PLR0917 - numba takes no keywords
        lines: Any, given: Any, pose: Any, work: Any, tolerance: float, most: int
    ) -> int:
        rows, system = work
        for step in range(1, most + 1):
            cables(lines, pose, rows)
            for i in range(len(lines)):
                rows[7 * i] = given[i] - rows[7 * i]
            normal(rows, rows, 7, system)
            if not solve(system):
                return -1
            moved = 0.0
            for k in range(36, 42):
                moved += system[k] * system[k]
            if moved > _LONGEST * _LONGEST:
                for k in range(36, 42):
                    system[k] *= _LONGEST / sqrt(moved)
            turn(pose, system)
            if moved <= tolerance * tolerance:
                straighten(pose)
                return step
        return -1

    return find


def forces_loop(cables: Function, normal: Function, solve: Function) -> Function:
    """Cable forces by the IPAnema paper's Eq. 8, its sign put right; false where singular."""

    def forces(  # noqa: PLR0917 - numba takes no keywords
        lines: Any, pose: Any, initial: Any, wrench: Any, work: Any, out: Any
    ) -> bool:
        rows, system = work
        cables(lines, pose, rows)
        normal(rows, initial, 1, system)
        # Aᵀ = −Gᵀ, hence f = f_i + G (GᵀG)⁻¹ (w − Gᵀ f_i).
        for a in range(6):
            system[36 + a] = wrench[a] - system[36 + a]
        if not solve(system):
            return False
        for i in range(len(lines)):
            total = initial[i]
            for a in range(6):
                total += rows[7 * i + 1 + a] * system[36 + a]
            out[i] = total
        return True

    return forces

"""Forward kinematics and force distribution of one pose in loops that numba compiles unchanged."""

from __future__ import annotations

from collections.abc import Callable
from math import sin, sqrt
from typing import Any

Function = Callable[..., Any]
_SINGULAR = 1e-13
"""Of a pivot as a share of its diagonal element: five hundred times the rounding (2e-16), below
which no digit of the pivot is known."""
_LONGEST = 0.5
"""m and rad: over a longer step the linear form of the lengths does not hold in a robot of some
metres (rule of thumb)."""

_NEAR, _EXACT = 0.1, 1e-8
"""Step, m and rad, above which the iteration began far from the pose and may end in a local minimum
of the residuals (rule of thumb: a platform moves millimetres in a cycle), and residual of a
solution, m: a hundred times what is left by rounding."""


def normal(rows: Any, values: Any, width: int, system: Any) -> None:
    """GᵀG, its lower half by rows, then Gᵀ v, with one of the ``values`` every ``width``. A
    variable for each sum: six columns a to f of G, v the value."""
    aa = ba = bb = ca = cb = cc = da = db = dc = dd = 0.0
    ea = eb = ec = ed = ee = fa = fb = fc = fd = fe = ff = 0.0
    va = vb = vc = vd = ve = vf = 0.0
    for i in range(len(rows) // 7):
        g, v = 7 * i, values[width * i]
        a, b, c = rows[g + 1], rows[g + 2], rows[g + 3]
        d, e, f = rows[g + 4], rows[g + 5], rows[g + 6]
        aa += a * a
        ba += b * a
        bb += b * b
        ca += c * a
        cb += c * b
        cc += c * c
        da += d * a
        db += d * b
        dc += d * c
        dd += d * d
        ea += e * a
        eb += e * b
        ec += e * c
        ed += e * d
        ee += e * e
        fa += f * a
        fb += f * b
        fc += f * c
        fd += f * d
        fe += f * e
        ff += f * f
        va += v * a
        vb += v * b
        vc += v * c
        vd += v * d
        ve += v * e
        vf += v * f
    system[0] = aa
    system[6], system[7] = ba, bb
    system[12], system[13], system[14] = ca, cb, cc
    system[18], system[19], system[20], system[21] = da, db, dc, dd
    system[24], system[25], system[26], system[27], system[28] = ea, eb, ec, ed, ee
    system[30], system[31], system[32] = fa, fb, fc
    system[33], system[34], system[35] = fd, fe, ff
    system[36], system[37], system[38] = va, vb, vc
    system[39], system[40], system[41] = vd, ve, vf


def cholesky(system: Any) -> bool:  # noqa: PLR0911 - one for every pivot
    """Solve a system of :func:`normal` in place; false where it is singular.

    Cholesky factor by rows, ``l10`` to ``l54``; the diagonal ``i0`` to ``i5`` holds its inverse:
    six divisions instead of 33. The comparisons of a pivot are also false for NaN.
    """
    if not system[0] > 0.0:
        return False
    i0 = 1.0 / sqrt(system[0])
    l10, l20, l30 = system[6] * i0, system[12] * i0, system[18] * i0
    l40, l50 = system[24] * i0, system[30] * i0
    pivot = system[7] - l10 * l10
    if not pivot > _SINGULAR * system[7]:
        return False
    i1 = 1.0 / sqrt(pivot)
    l21 = (system[13] - l20 * l10) * i1
    l31 = (system[19] - l30 * l10) * i1
    l41 = (system[25] - l40 * l10) * i1
    l51 = (system[31] - l50 * l10) * i1
    pivot = system[14] - l20 * l20 - l21 * l21
    if not pivot > _SINGULAR * system[14]:
        return False
    i2 = 1.0 / sqrt(pivot)
    l32 = (system[20] - l30 * l20 - l31 * l21) * i2
    l42 = (system[26] - l40 * l20 - l41 * l21) * i2
    l52 = (system[32] - l50 * l20 - l51 * l21) * i2
    pivot = system[21] - l30 * l30 - l31 * l31 - l32 * l32
    if not pivot > _SINGULAR * system[21]:
        return False
    i3 = 1.0 / sqrt(pivot)
    l43 = (system[27] - l40 * l30 - l41 * l31 - l42 * l32) * i3
    l53 = (system[33] - l50 * l30 - l51 * l31 - l52 * l32) * i3
    pivot = system[28] - l40 * l40 - l41 * l41 - l42 * l42 - l43 * l43
    if not pivot > _SINGULAR * system[28]:
        return False
    i4 = 1.0 / sqrt(pivot)
    l54 = (system[34] - l50 * l40 - l51 * l41 - l52 * l42 - l53 * l43) * i4
    pivot = system[35] - l50 * l50 - l51 * l51 - l52 * l52 - l53 * l53 - l54 * l54
    if not pivot > _SINGULAR * system[35]:
        return False
    i5 = 1.0 / sqrt(pivot)
    y0 = system[36] * i0
    y1 = (system[37] - l10 * y0) * i1
    y2 = (system[38] - l20 * y0 - l21 * y1) * i2
    y3 = (system[39] - l30 * y0 - l31 * y1 - l32 * y2) * i3
    y4 = (system[40] - l40 * y0 - l41 * y1 - l42 * y2 - l43 * y3) * i4
    y5 = (system[41] - l50 * y0 - l51 * y1 - l52 * y2 - l53 * y3 - l54 * y4) * i5
    x5 = y5 * i5
    x4 = (y4 - l54 * x5) * i4
    x3 = (y3 - l43 * x4 - l53 * x5) * i3
    x2 = (y2 - l32 * x3 - l42 * x4 - l52 * x5) * i2
    x1 = (y1 - l21 * x2 - l31 * x3 - l41 * x4 - l51 * x5) * i1
    x0 = (y0 - l10 * x1 - l20 * x2 - l30 * x3 - l40 * x4 - l50 * x5) * i0
    system[36], system[37], system[38] = x0, x1, x2
    system[39], system[40], system[41] = x3, x4, x5
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
    """Loop of Gauss and Newton's method; moves the given pose and returns the steps, −1 for more
    than ``most``, or where a length differs by more than ``met`` before a last step below
    ``tolerance``. From far away all lengths have to be met exactly."""

    def find(  # noqa: PLR0917 - numba takes no keywords
        lines: Any, given: Any, pose: Any, work: Any, tolerance: float, met: float, most: int
    ) -> int:
        rows, system = work
        limit, last = met, tolerance
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
            if moved > _NEAR * _NEAR:
                limit = last = _EXACT
            if moved > _LONGEST * _LONGEST:
                for k in range(36, 42):
                    system[k] *= _LONGEST / sqrt(moved)
            turn(pose, system)
            if moved <= last * last:
                for i in range(len(lines)):
                    if not abs(rows[7 * i]) <= limit:
                        return -1
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
        a, b, c = system[36], system[37], system[38]
        d, e, f = system[39], system[40], system[41]
        for i in range(len(lines)):
            g = 7 * i
            total = initial[i] + rows[g + 1] * a + rows[g + 2] * b + rows[g + 3] * c
            out[i] = total + rows[g + 4] * d + rows[g + 5] * e + rows[g + 6] * f
        return True

    return forces

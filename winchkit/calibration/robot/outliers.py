"""Which measurements lie far outside what all others of their kind leave over."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.calibration.robot.equations import Equations
from winchkit.calibration.robot.least_squares import Solution

__all__ = ["gross_errors"]

_WORDS = {
    "rope": "motor angles",
    "position": "positions",
    "rotation": "rotations",
    "swivel": "swivel angles",
    "cable_length": "cable lengths",
}
_FAR = 10.0
"""In robust standard deviations; the largest of ten thousand normal values lies within four."""
_NORMAL = 1.4826
_MOST = 0.1
_LISTED = 5


def gross_errors(equations: Equations, solution: Solution) -> list[str]:
    """A sentence per kind of measurement of which a few values cannot be noise.

    The scale is the median of what the fit leaves over, which a few gross errors do not move; where
    many values are far off it is the model that fails, and nothing is said here.
    """
    out = []
    for rows in equations.rows(solution.state):
        if rows.kind not in _WORDS:
            continue
        far, known = _far(rows.residual)
        if 0 < np.count_nonzero(far) <= _MOST * known:
            places = equations.measured.place[np.any(far, axis=1)].tolist()
            more = f" and {len(places) - _LISTED} more" if len(places) > _LISTED else ""
            out.append(
                f"gross errors in the {_WORDS[rows.kind]} of {', '.join(places[:_LISTED])}{more}? "
                "they are more than ten times as far off as is usual: measure them again, leave "
                "them out, or use --loss cauchy"
            )
    return out


def _far(residual: Array) -> tuple[NDArray[np.bool_], int]:
    """Which residuals (p, k) are gross, and how many there are at all."""
    size = np.abs(residual)
    known = np.isfinite(size)
    if not np.any(known):
        return known, 0
    usual = _NORMAL * float(np.median(size[known]))
    return known & (size > _FAR * usual) & (usual > 0), int(np.count_nonzero(known))

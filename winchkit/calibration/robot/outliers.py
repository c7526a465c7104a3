"""Gross errors: measurements with residuals far outside the spread of their kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.calibration.robot.equations import Equations
from winchkit.model.robot.identification.bundle_adjustment import Solution

__all__ = ["gross_errors"]

_WORDS = {
    "rope": "motor angles",
    "position": "positions",
    "rotation": "rotations",
    "swivel": "swivel angles",
    "cable_length": "cable lengths",
}
_LIMIT = 10.0
"""Limit in robust standard deviations; the largest of ten thousand normal values is near four."""
_NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
_MOST_SHARE = 0.1
_LISTED = 5


def gross_errors(equations: Equations, solution: Solution) -> list[str]:
    """One sentence per kind of measurement with gross errors.

    Notes
    -----
    The scale is 1.4826 times the median of the absolute residuals, which a few gross errors do not
    change. Above a share of 10 % the model is wrong and not the measurement: then no sentence.
    """
    out = []
    for rows in equations.rows(solution.state):
        if rows.kind not in _WORDS:
            continue
        outside, known = _outside(rows.residual)
        if 0 < np.count_nonzero(outside) <= _MOST_SHARE * known:
            listed = equations.measured.place[np.any(outside, axis=1)].tolist()
            more = f" and {len(listed) - _LISTED} more" if len(listed) > _LISTED else ""
            out.append(
                f"gross errors in the {_WORDS[rows.kind]} of {', '.join(listed[:_LISTED])}{more}? "
                "they are more than ten times as far off as is usual: measure them again, leave "
                "them out, or use --loss cauchy"
            )
    return out


def _outside(residual: Array) -> tuple[NDArray[np.bool_], int]:
    """Mask of gross residuals (p, k), and the number of residuals."""
    size = np.abs(residual)
    known = np.isfinite(size)
    if not np.any(known):
        return known, 0
    usual = _NORMAL * float(np.median(size[known]))
    return known & (size > _LIMIT * usual) & (usual > 0), int(np.count_nonzero(known))

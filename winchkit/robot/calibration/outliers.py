"""Gross errors of measurements, and instruments whose readings do not follow the geometry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.robot.calibration.equations import Equations
from winchkit.robot.identification.bundle_adjustment import Solution

_WORDS = {
    "closure": "motor angles",
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
"""Readings beyond the limit that are more than a tenth are a wrong standard deviation or law, no
gross errors (rule of thumb)."""
_LISTED = 5
"""Poses in the warning; the rest are counted."""
_SHARE = 0.5
"""Share of an instrument's variance that the fit has to explain: half."""
_CAUSES = {
    "swivel": "swivel_axis (the direction in which the cable reaches its pulley), the sign of the "
    "encoders and the order of the lines",
    "cable_length": "unit and sign of the lengths and the order of the lines",
}


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


def unexplained(equations: Equations, solution: Solution) -> list[str]:
    """One sentence per kind of instrument at the lines that does not show the predicted motion.

    Notes
    -----
    With the readings of every line about their mean, R² is below a half although at least a half
    of their variance is predicted: an instrument that hardly moves says nothing.
    """
    out = []
    readings = {
        "swivel": equations.measured.swivel,
        "cable_length": equations.measured.cable_length,
    }
    for kind, constraint in equations.constraints(solution.state):
        if kind not in readings:
            continue
        measured, residual = readings[kind], constraint.residual
        left = _about_mean(residual)
        given, predicted = _about_mean(measured), _about_mean(measured + residual)
        if left > (1 - _SHARE) * given and predicted > _SHARE * given:
            count = np.count_nonzero(np.isfinite(residual))
            unit, factor = ("deg", 180 / np.pi) if kind == "swivel" else ("mm", 1e3)
            noise, varies = (factor * np.sqrt(total / count) for total in (left, given))
            out.append(
                f"the {_WORDS[kind]} do not follow the geometry: they vary by {varies:.3g} {unit} "
                f"and differ from it by {noise:.3g} {unit} rms beside their zeros; check "
                f"{_CAUSES[kind]}"
            )
    return out


def _about_mean(values: Array) -> float:
    """Sum of squares about the mean of each line."""
    known = np.isfinite(values)
    count = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, values, 0.0).sum(axis=0) / count
    return float(np.sum(np.where(known, values - mean, 0.0) ** 2))


def _outside(residual: Array) -> tuple[NDArray[np.bool_], int]:
    """Mask of gross residuals (p, k), and the number of residuals."""
    size = np.abs(residual)
    known = np.isfinite(size)
    if not np.any(known):
        return known, 0
    usual = _NORMAL * float(np.median(size[known]))
    return known & (size > _LIMIT * usual) & (usual > 0), int(np.count_nonzero(known))

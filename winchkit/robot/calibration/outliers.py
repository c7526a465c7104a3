"""Gross errors of measurements, and instruments whose readings do not follow the geometry."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.robot.calibration.prediction import in_other_zeros
from winchkit.robot.identification.bundle_adjustment import (
    BundleState,
    Solution,
    Weights,
    linearise,
    place,
    solve,
)
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.variance_components import NOISE, START

_LIMIT = 10.0
"""Misfit of a pose in that of the usual pose from which on it is a gross error; the largest of ten
thousand poses with normal errors is near three."""
_SUSPECT = 3.0
"""The same for a fit to which wrong poses may have contributed, from which on they are looked for.
"""
_WORDS = {"swivel": "swivel angles", "cable_length": "cable lengths"}
_NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
_TRIMMED = 2 / 3
"""Share of the poses that are fitted until it is known which are wrong: up to a third may be."""
_ROUNDS = 10
"""Fits of that share; each lowers the sum of its misfits, and three to five end it (rule of thumb).
"""
_SHARE = 0.5
"""Share of an instrument's variance that the fit has to explain: half."""
_CAUSES = {
    "swivel": "swivel_axis (the direction in which the cable reaches its pulley), the sign of the "
    "encoders and the order of the lines",
    "cable_length": "unit and sign of the lengths and the order of the lines",
}


def gross_errors(equations: RobotEquations, values: Array, weights: Weights) -> NDArray[np.bool_]:
    """Poses with a reading far from what the others predict, (p,); none where they are more than a
    third: then the model is wrong, or the standard deviations.

    Least trimmed squares: the fit of the two thirds of the poses that fit best, repeated until
    these stay the same (concentration). A pose's misfit is the root of the mean square of its
    residuals, in standard deviations of their prediction by the others, where it fits them best. P.
    J. Rousseeuw and K. Van Driessen, *Computing LTS Regression for Large Data Sets*, 2006.
    """
    state = place(equations, BundleState(values, equations.start(values)), Weights(START))
    state, _ = in_other_zeros(equations, place(equations, state, weights), weights)
    weights = _robust_weights(equations, state)
    state = place(equations, state, weights)
    information = linearise(equations, state, weights).information
    misfit = _misfit(equations, state, weights, information)
    kept = np.ones(len(misfit), dtype=bool)
    for _ in range(_ROUNDS if np.any(misfit > _SUSPECT * max(np.median(misfit), 1.0)) else 0):
        before, kept = kept, misfit <= np.quantile(misfit, _TRIMMED)
        if np.array_equal(before, kept):
            break
        pose = state.pose[kept]
        fit = solve(equations.of(kept), BundleState(state.values, pose), weights)
        state = place(equations, BundleState(fit.state.values, state.pose), weights)
        weights = _robust_weights(equations, state)
        state = place(equations, state, weights)
        misfit = _misfit(equations, state, weights, fit.linear.information)
    wrong = misfit > _LIMIT * max(np.median(misfit), 1.0)
    return np.asarray(wrong & (np.mean(wrong) <= 1 - _TRIMMED))


def far_off(distance: Array) -> NDArray[np.bool_]:
    """Held-out poses whose position is far from the predicted one, (p,), by distances (p,), NaN
    where not known; as in the fit, more than a third are none."""
    known = distance[np.isfinite(distance)]
    usual = float(np.median(known)) if len(known) else np.inf
    wrong = distance > _LIMIT * max(usual, NOISE["position"].least)
    return np.asarray(wrong & (np.count_nonzero(wrong) <= (1 - _TRIMMED) * len(known)))


def left_out_poses(places: NDArray[np.str_], of: str) -> list[str]:
    """The warning that poses were left out of the fit or of the held-out error."""
    if not len(places):
        return []
    return [
        f"gross errors: {', '.join(places.tolist())}: more than ten times as far off as is usual, "
        f"left out of {of}; measure them again, or remove them"
    ]


def _robust_weights(equations: RobotEquations, state: BundleState) -> Weights:
    """Standard deviations by the median absolute residual of each kind."""
    sigma = {}
    for kind, constraint in equations.constraints(state):
        size = np.abs(constraint.residual)
        known = size[np.isfinite(size)]
        usual = _NORMAL * float(np.median(known)) if len(known) else 0.0
        sigma[kind] = max(usual, NOISE[kind].least)
    return Weights(sigma)


def _misfit(
    equations: RobotEquations, state: BundleState, weights: Weights, information: Array
) -> Array:
    """Misfit of each pose, (p,), with parameters known as of an information matrix."""
    linear = linearise(equations, state, weights)
    free, residual = linear.pose_free, linear.stack.residual
    spread = np.linalg.inv(information + np.eye(len(information)))
    covariance = np.eye(residual.shape[1]) + free @ spread @ np.swapaxes(free, 1, 2)
    square = np.sum(residual * np.linalg.solve(covariance, residual[..., None])[..., 0], axis=1)
    return np.asarray(np.sqrt(square / np.maximum(linear.stack.known.sum(axis=1), 1)))


def unexplained(equations: RobotEquations, solution: Solution) -> Iterator[str]:
    """One sentence per kind of instrument at the lines that does not show the predicted motion:
    less than half of its variance is explained, though at least half is predicted. An instrument
    that hardly moves says nothing."""
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
            yield (
                f"the {_WORDS[kind]} do not follow the geometry: they vary by {varies:.3g} {unit} "
                f"and differ from it by {noise:.3g} {unit} rms beside their zeros; check "
                f"{_CAUSES[kind]}"
            )


def _about_mean(values: Array) -> float:
    """Sum of squares about the mean of each line."""
    known = np.isfinite(values)
    count = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, values, 0.0).sum(axis=0) / count
    return float(np.sum(np.where(known, values - mean, 0.0) ** 2))

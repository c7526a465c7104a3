"""Statistics of a robot's calibration: χ² with its degrees of freedom, values, correlations.

Every parameter has a prior, which counts as an observation, and every pose is an unknown with as
many coordinates as its equations determine. The standard deviations of the measurements are
estimated from the same residuals, so that the reduced χ² is about one by construction.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from winchkit.fit_statistics import FitStatistics, FittedParameter, correlations_of
from winchkit.robot.identification.bundle_adjustment import Solution
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.parameters import Estimated

_95 = 1.959964
"""Standard deviations: 97.5 % quantile of the normal distribution, for 95 % two-sided."""


def calibration_statistics(
    equations: RobotEquations, solution: Solution, estimates: Mapping[str, Estimated]
) -> FitStatistics:
    """Statistics of a fit of poses and parameters."""
    linear, parameters = solution.linear, equations.parameters
    free = parameters.std > 0
    posterior = np.linalg.inv(linear.information + np.eye(len(linear.prior)))
    names = [p.name for p, own in zip(parameters, free, strict=True) if own]
    # A value that files have as 1/value falls where the fitted one rises.
    signs = np.array([-1.0 if p.reciprocal else 1.0 for p in parameters])[free]
    covariance = posterior[np.ix_(free, free)] * np.outer(signs, signs)
    known = linear.stack.known
    residual = linear.stack.residual[known]
    kinds = ", ".join(
        f"{np.count_nonzero(known[:, part])} of {kind.replace('_', ' ')}"
        for kind, part in linear.stack.kinds.items()
    )
    poses = np.where(known[..., None], linear.stack.by_pose, 0.0)
    turned = int(np.sum(np.linalg.matrix_rank(poses)))
    count = int(np.count_nonzero(free))
    size, _ = np.linalg.eigh(linear.information[np.ix_(free, free)] + np.eye(count))
    return FitStatistics(
        correlations=correlations_of(names, covariance),
        condition=float(np.sqrt(size[-1] / size[0])),
        method="maximum a posteriori (Levenberg-Marquardt); standard "
        "deviations of the measurements from the residuals",
        data=f"{len(known)} poses; equations: {kinds}; {count} priors",
        n_observations=len(residual) + count,
        n_unknowns=count + turned,
        chi_square=float(residual @ residual + np.sum(linear.prior[free] ** 2)),
        parameters=tuple(_parameter(name, estimate) for name, estimate in estimates.items()),
    )


def _parameter(name: str, estimate: Estimated) -> FittedParameter:
    """A value; its plausible range is the 95 % range of its prior, within its bounds."""
    parameter = estimate.parameter
    reach = _95 * estimate.std
    far = _95 * parameter.std
    low = max(parameter.low, parameter.nominal - far)
    high = min(parameter.high, parameter.nominal + far)
    ends = sorted(parameter.shown(end, 0.0)[0] for end in (low, high))
    return FittedParameter(
        name,
        estimate.value,
        estimate.std,
        parameter.unit,
        estimate.nominal,
        (estimate.value - reach, estimate.value + reach),
        (ends[0], ends[1]),
        f"at its {estimate.bound} bound" if estimate.bound else "",
    )

"""Instruments that were zeroed anew before each run: an offset that differs between repeats.

The difference of repeats is noise, and a constant where the instrument was zeroed in between. Its
mean is tested against its variation over blocks of time (batch means, one F test per output), and
against a random walk beside white noise (local level model), so that a slow drift is none. At
different temperatures a straight line over the temperature, and over its product with the output,
is fitted beside.

References
----------
Schmeiser, B. (1982). Batch size effects in the analysis of simulation output. Oper. Res. 30,
556-568.
Harvey, A. C. (1989). Forecasting, Structural Time Series Models and the Kalman Filter. Cambridge
University Press, ch. 4 (local level model, restricted likelihood).
Draper, N. R., Smith, H. (1998). Applied Regression Analysis, 3rd ed., ch. 2 (pure error).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtrc

from winchkit.arrays import Array
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding

BLOCKS = 8
"""Blocks of time over which the difference of two repeats, or the residual of a run, is averaged;
screened: longer than the correlation time of an instrument, and seven degrees of freedom."""
LEVEL = 1e-4
"""Level of the F test; one false finding in 3000 recordings of three outputs."""
_LEAST_SAMPLES = 64
"""Samples of a difference that is tested; eight per block."""
_LEVEL_OF_WANDER = 0.01
"""Level of the test that the level of block means exceeds a random walk from zero; convention;
simulated size at most 1.3 %, of white noise to a walk, 1 to 6 runs."""
_AS_LARGE = 0.25
"""Offset over the largest tension from which it is no zero of the cell; rule of thumb."""
_REGION = 3.841
"""Increase of the restricted deviance up to which a ratio of variances is not rejected; theory: 95
% quantile of χ²(1)."""


def zeroed_anew(
    output: str, differences: Sequence[Array], thermal: Sequence[Array] | None = None
) -> Finding | None:
    """Finding ``zeroed-anew``; value: standard deviation of the offset between repeats, SI.

    ``differences`` are contrasts of the residuals of repeats with the variance of one run's noise,
    NaN where not compared; ``thermal`` holds their known regressors, (k, n) each, such as the
    difference of temperatures.
    """
    means, known = [], []
    for index, difference in enumerate(differences):
        rows = np.isfinite(difference)
        if np.count_nonzero(rows) >= _LEAST_SAMPLES:
            means.append(_block_means(difference[rows]))
            beside = np.zeros((0, len(rows))) if thermal is None else thermal[index]
            known.append(np.array([_block_means(x[rows]) for x in beside]).reshape(-1, BLOCKS).T)
    if not means:
        return None
    observed, regressors = np.array(means), np.concatenate(known)
    offsets = np.repeat(np.eye(len(means)), BLOCKS, axis=0)
    without, rank = _residual_and_rank(observed.ravel(), regressors)
    left, whole = _residual_and_rank(observed.ravel(), np.hstack([regressors, offsets]))
    dof = whole - rank, observed.size - whole
    within = float(left @ left) / max(dof[1], 1)
    rounding = observed.size * float(np.finfo(float).eps * np.linalg.norm(observed))
    if dof[0] == 0 or np.linalg.norm(left) <= rounding:
        return None
    between = float(without @ without - left @ left) / dof[0]
    p_value = float(fdtrc(*dof, between / within))
    if p_value >= LEVEL or is_random_walk(without.reshape(observed.shape)):
        return None
    return zeroed_finding(output, float(np.sqrt((between - within) / BLOCKS)), p_value, "repeats")


def _block_means(values: Array) -> Array:
    return np.array([float(part.mean()) for part in np.array_split(values, BLOCKS)])


def _residual_and_rank(values: Array, columns: Array) -> tuple[Array, int]:
    """Values without what columns explain, and the rank of these."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    unit = columns[:, size > 0] / size[size > 0]
    amplitudes, _, rank, _ = np.linalg.lstsq(unit, values, rcond=1e-6)
    return np.asarray(values - unit @ amplitudes), int(rank)


def zeroed_finding(output: str, spread: float, p_value: float, between: str) -> Finding:
    """Finding ``zeroed-anew``: an offset with this standard deviation between repeats or runs."""
    limit = (
        ""
        if between == "repeats"
        else "; without repeats an unknown effect of what differs between the runs is the same"
    )
    text = (
        f"the offset differs between {between} by {quantity(spread, OUTPUT_UNITS[output])} "
        f"(standard deviation, F test p = {p_value:.1g}): the instrument was zeroed anew before "
        f"each run, and an offset per run is fitted{limit}"
    )
    return Finding("zeroed-anew", "", output, spread, text)


def is_setting(values: Sequence[Array]) -> bool:
    """Whether a variable, (n,) per run, varies more between runs than within them.

    Variance components of a one-way classification. An offset per run would take what depends on
    such a variable, as friction does on the speed and direction of runs at constant speed.
    """
    if len(values) < 2:
        return False
    within = float(np.mean([np.var(own) for own in values]))
    return float(np.var([np.mean(own) for own in values])) > within


def as_noise(finding: Finding, reason: str) -> Finding:
    """The finding on an offset of a force or torque that is no zero."""
    spread = quantity(finding.value, OUTPUT_UNITS[finding.channel])
    text = (
        f"the offset differs between repeats by {spread} (standard deviation): {reason}, so that "
        "no offset per run is fitted; it counts as noise"
    )
    return Finding("offset-as-noise", "", finding.channel, finding.value, text)


def no_zero(finding: Finding, rates: Sequence[Array], measured: Sequence[Array]) -> str:
    """Reason why an offset between repeats of a force or torque is none of its zero, else empty.

    ``rates`` are the speeds of the runs and ``measured`` the values of the output, (n,) each.
    """
    if finding.channel == "cable_length":
        return ""
    if is_setting(rates):
        return "the runs differ in speed or direction, on which friction depends"
    if finding.channel == "tension":
        usual = float(np.quantile(np.abs(np.concatenate(measured)), 0.95))
        if finding.value > _AS_LARGE * usual:
            return "that is a quarter of the largest values and more, as of another load"
    return ""


def angles_from_zero(runs: Sequence[Run]) -> list[Finding]:
    """Finding ``zeroed-anew`` of the cable length, where an integral of a velocity is the angle.

    The angle is 0 at the start of such a run, wherever the cable was: each run has its own offset.
    """
    own = [run for run in runs if run.is_angle_integrated and "cable_length" in run]
    if not own or len(runs) < 2:
        return []
    text = (
        "the motor angle is the integral of a velocity from 0 at the start of each run, and an "
        "offset per run is fitted"
    )
    return [Finding("zeroed-anew", "", "cable_length", float("nan"), text)]


def is_random_walk(means: Array) -> bool:
    """Whether a random walk from zero, beside white noise, explains the level of block means.

    Local level model of the means, (n, 8), with the covariance w (I + r M), M being that of the
    means of a random walk from zero. The level is that of generalised least squares, its p-value (F
    with n and 7 n degrees of freedom) the largest over the ratios r that the restricted likelihood
    does not reject at 5 %: from r = 0, where all blocks determine the level, to a walk alone, where
    only the first does.
    """
    count = len(means)
    block = np.arange(1.0, BLOCKS + 1)
    walk = np.minimum.outer(block, block) - 0.5 - np.eye(BLOCKS) / 6
    ratios = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 25)])
    covariance = np.eye(BLOCKS) + ratios[:, None, None] * walk
    inverse = np.linalg.inv(covariance)
    weights, information = inverse.sum(axis=1), inverse.sum(axis=(1, 2))
    levels = weights @ means.T / information[:, None]
    squares = np.einsum("ni,rij,nj->r", means, inverse, means)
    left = squares - information * np.sum(levels**2, axis=1)
    dof = count * (BLOCKS - 1)
    if np.any(left <= 0.0):
        return False
    deviance = dof * np.log(left) + count * (np.linalg.slogdet(covariance)[1] + np.log(information))
    statistic = np.mean(levels**2, axis=1) * information * dof / left
    p_values = fdtrc(count, dof, statistic[deviance <= deviance.min() + _REGION])
    return float(np.max(p_values)) >= _LEVEL_OF_WANDER

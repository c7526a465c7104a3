"""Instruments that were zeroed anew before each run: an offset that differs between repeats.

Repeats have equal predictions, so that their difference is noise, and a constant where the
instrument was zeroed in between. The mean of every difference is tested against its variation over
blocks of time (batch means, one F test per output), and its first block against the change from
block to block, so that a slow wander of the instrument is none. Repeats at different temperatures
may differ by what a temperature does: a straight line over it, and over its product with the
output, is fitted beside.

References
----------
Schmeiser, B. (1982). Batch size effects in the analysis of simulation output. Oper. Res. 30,
556-568.
von Neumann, J. (1941). Distribution of the ratio of the mean square successive difference to the
variance. Ann. Math. Statist. 12, 367-395.
Draper, N. R., Smith, H. (1998). Applied Regression Analysis, 3rd ed., ch. 2 (pure error).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtrc

from winchkit.arrays import Array
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.text import size

__all__ = ["BLOCKS", "LEVEL", "anew", "wanders", "zeroed_anew"]

BLOCKS = 8
LEVEL = 1e-4
_LEAST_SAMPLES = 64
_LEVEL_OF_WANDER = 0.01


def zeroed_anew(
    output: str, differences: Sequence[Array], thermal: Sequence[Array] | None = None
) -> Finding | None:
    """Finding ``zeroed-anew``; value: standard deviation of the offset between repeats, SI.

    Parameters
    ----------
    output
        Output of the instrument.
    differences
        Contrasts of the residuals of repeats, each with the variance of one run's noise; NaN where
        a sample is not compared.
    thermal
        Per difference its known regressors, (k, n), such as the difference of temperatures; None
        for none.

    Returns
    -------
    Finding or None
        None where the means of the differences, beside the regressors, are within their variation
        over eight blocks of time.
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
    without, rank = _left(observed.ravel(), regressors)
    left, whole = _left(observed.ravel(), np.hstack([regressors, offsets]))
    freedom = whole - rank, observed.size - whole
    within = float(left @ left) / max(freedom[1], 1)
    rounding = observed.size * float(np.finfo(float).eps * np.linalg.norm(observed))
    if freedom[0] == 0 or np.linalg.norm(left) <= rounding:
        return None
    between = float(without @ without - left @ left) / freedom[0]
    p_value = float(fdtrc(*freedom, between / within))
    if p_value >= LEVEL or wanders(without.reshape(observed.shape)):
        return None
    return anew(output, float(np.sqrt((between - within) / BLOCKS)), p_value, "repeats")


def _block_means(values: Array) -> Array:
    return np.array([float(part.mean()) for part in np.array_split(values, BLOCKS)])


def _left(values: Array, columns: Array) -> tuple[Array, int]:
    """Values without what columns explain, and the rank of these."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    unit = columns[:, size > 0] / size[size > 0]
    amplitudes, _, rank, _ = np.linalg.lstsq(unit, values, rcond=1e-6)
    return np.asarray(values - unit @ amplitudes), int(rank)


def anew(output: str, spread: float, p_value: float, between: str) -> Finding:
    """Finding ``zeroed-anew``: an offset with this standard deviation between repeats or runs."""
    limit = (
        ""
        if between == "repeats"
        else "; without repeats an unknown effect of what differs between the runs is the same"
    )
    text = (
        f"the offset differs between {between} by {size(spread, OUTPUT_UNITS[output])} (standard "
        f"deviation, F test p = {p_value:.1g}): the instrument was zeroed anew before each run, "
        f"and an offset per run is fitted{limit}"
    )
    return Finding("zeroed-anew", "", output, spread, text)


def wanders(means: Array) -> bool:
    """Whether the first blocks are no larger than a random walk makes them.

    Parameters
    ----------
    means
        Block means of differences between repeats, or of runs about a common offset, (n, 8).

    Notes
    -----
    Half the mean square successive difference of block means (von Neumann) is their variance under
    white noise, and that of the first block of a random walk that starts at zero; its degrees of
    freedom are 2 (b − 1)²/(3 b − 4) per difference.
    """
    first = float(np.mean(means[:, 0] ** 2))
    half = float(np.mean(np.diff(means, axis=1) ** 2)) / 2
    freedom = 2 * (BLOCKS - 1) ** 2 / (3 * BLOCKS - 4) * len(means)
    return half > 0.0 and float(fdtrc(len(means), freedom, first / half)) >= _LEVEL_OF_WANDER

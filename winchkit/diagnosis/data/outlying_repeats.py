"""Repeats that differ from the others by far more than these do from each other.

Repeats have the same recorded inputs, so that every model predicts the same outputs for them. A run
that its nearest repeat predicts no better than the profile does, while the others predict each
other, was made under another value of something that is not recorded, such as the zero of the
angle. Taken for noise, this difference would hide all effects.

References
----------
Cochran, W. G. (1941). The distribution of the largest of a set of estimated variances as a fraction
of their total. Ann. Eugenics 11, 47-52.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct
from scipy.special import fdtrc

from winchkit.arrays import Array

__all__ = ["Outlying", "outlying_repeat"]

_LEAST_REPEATS = 3
"""Repeats from which one can be outlying; theory: of two, neither is."""
_LEAST_RATIO = 4.0
"""Mean square of the difference from the nearest repeat over that of the others, below which a run
is only noisier; screened: twice the rms."""
_LEVEL = 1e-3
"""Level of the F test, Bonferroni over the repeats; convention."""


@dataclass(frozen=True)
class Outlying:
    """A run that differs from its repeats, and by how much, SI."""

    index: int
    """Among the repeats."""
    rms: float
    """Of its difference from the nearest repeat."""
    usual: float
    """The same of the other repeats, median."""


def outlying_repeat(errors: Array) -> Outlying | None:
    """The repeat that differs most from the others, if that is significant.

    Parameters
    ----------
    errors : (m, n) array
        Residuals of one output of m repeats on corresponding samples; NaN where not compared.

    Returns
    -------
    Outlying or None
        None for fewer than three repeats.

    Notes
    -----
    Mean squares of differences less their mean. That of a run from its nearest repeat over the
    median of the same of the others is tested by F at 10⁻³ over all repeats (Bonferroni). A
    variance estimate from coefficients c of a cosine transform has 3 (Σc²)²/Σc⁴ degrees of freedom.
    """
    count = len(errors)
    if count < _LEAST_REPEATS:
        return None
    own = np.array([_mean_square(error)[0] for error in errors])
    nearest, dof = np.full(count, np.inf), np.ones(count)
    for i in range(count):
        for j in range(count):
            square, own_dof = _mean_square(errors[i] - errors[j]) if i != j else (np.inf, 1.0)
            if square < nearest[i]:
                nearest[i], dof[i] = square, own_dof
    index = int(np.argmax(nearest))
    others = np.delete(np.arange(count), index)
    usual = others[np.argsort(nearest[others])[len(others) // 2]]
    if nearest[index] < own[index] or nearest[index] <= _LEAST_RATIO * nearest[usual]:
        return None
    ratio = nearest[index] / max(nearest[usual], np.finfo(float).tiny)
    if count * float(fdtrc(dof[index], dof[usual], ratio)) > _LEVEL:
        return None
    return Outlying(index, float(np.sqrt(nearest[index])), float(np.sqrt(nearest[usual])))


def _mean_square(values: Array) -> tuple[float, float]:
    """Mean square less the mean, and its degrees of freedom."""
    known = np.isfinite(values)
    if not known.any():
        return np.inf, 1.0
    centred = np.where(known, values - np.mean(values[known]), 0.0)
    squares = np.asarray(dct(centred, type=2, norm="ortho")) ** 2
    total = float(np.sum(squares))
    dof = 3 * total**2 / float(np.sum(squares**2)) if total > 0 else 1.0
    return total / np.count_nonzero(known), max(1.0, dof)

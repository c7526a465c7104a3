"""Robust variance beyond known variances: fewer than half of the values may be outlying.

References
----------
Huber, P. J., Ronchetti, E. M. (2009). Robust Statistics, 2nd ed. Wiley, ch. 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from winchkit.arrays import Array

_MEDIAN_OF_CHI_SQUARE = 0.454936
"""Median of χ²(1); theory."""
_EFFICIENCY = 0.367
"""Degrees of freedom per value; theory: asymptotic efficiency of the median absolute deviation of
normal values."""
_LEAST = 1e-9
"""Lowest variance and tolerance of the root, in units of the largest; numerical."""


@dataclass(frozen=True)
class Variance:
    """A variance with the degrees of freedom of its estimate."""

    value: float
    dof: float
    """Infinite for a known variance."""


def robust_variance(deviations: Array, known: Array) -> Variance:
    """Variance τ² of a common source besides known variances v of deviations d, (n,): that at which
    the median of d²/(v + τ²) is that of χ²(1), 0.455; zero where it is below without τ². It has
    0.367 n degrees of freedom, the asymptotic efficiency of the median absolute deviation."""
    squares, dof = deviations**2, max(_EFFICIENCY * len(deviations), 1.0)
    high = 2 * float(np.median(squares)) / _MEDIAN_OF_CHI_SQUARE if len(squares) else 0.0

    def excess(variance: float) -> float:
        return float(np.median(squares / (known + variance))) - _MEDIAN_OF_CHI_SQUARE

    low = _LEAST * high
    if not high or excess(low) <= 0.0:
        return Variance(0.0, dof)
    return Variance(float(brentq(excess, low, high, xtol=low)), dof)

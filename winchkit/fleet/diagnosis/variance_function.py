"""Variance function of session estimates: how far their stated variances differ in truth.

The standard deviation that a session states has an error of its own, a quarter where a few repeats
give the noise. A session that states too small a value then counts too much, and at the end of a
series it is a step. The true variance of session i of a winch is taken as k sᵢ^(2λ): λ = 1 where
the stated values are right, 0 where they are alike but for their error. λ is estimated from all
winches by the regression of ln d² on ln v (Harvey), d the successive differences and v the sum of
the two stated variances, both about the mean of their winch. A step is one large difference, whose
logarithm has little influence.

References
----------
Harvey, A. C. (1976). Estimating regression models with multiplicative heteroscedasticity.
Econometrica 44, 461-465.
Carroll, R. J., Ruppert, D. (1988). Transformation and Weighting in Regression. Chapman & Hall.
Smyth, G. K. (2004). Linear models and empirical Bayes methods for assessing differential
expression. Stat. Appl. Genet. Mol. Biol. 3, 3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array

_VARIANCE_OF_LN_CHI_SQUARE = 4.934802
"""Of ln χ²(1): π²/2."""
_PRIOR_STD = 0.5
"""Of λ about one: few sessions keep the stated values."""


def power_of_stated(values: Sequence[Array], stds: Sequence[Array]) -> float:
    """Power λ, 0 to 1, of the stated standard deviations in the true ones: posterior mean under λ ~
    N(1, 0.5²), within its bounds, by estimates (n,) of every winch in the order of time."""
    cross, squares = 0.0, 0.0
    for own, stated in zip(values, stds, strict=True):
        difference = np.diff(own)
        moved = difference != 0.0
        if np.count_nonzero(moved) < 2:
            continue
        variance = (stated[1:] ** 2 + stated[:-1] ** 2)[moved]
        x = np.log(variance) - np.mean(np.log(variance))
        cross += float(x @ np.log(difference[moved] ** 2))
        squares += float(x @ x)
    precision = squares / _VARIANCE_OF_LN_CHI_SQUARE
    mean = (cross / _VARIANCE_OF_LN_CHI_SQUARE + 1 / _PRIOR_STD**2) / (
        precision + 1 / _PRIOR_STD**2
    )
    return float(np.clip(mean, 0.0, 1.0))


def moderated_stds(stds: Array, power: float) -> Array:
    """Standard deviations of one winch, (n,), in proportion to a power of the stated ones, with the
    same mean variance."""
    relative = (stds / np.exp(np.mean(np.log(stds)))) ** (2 * power)
    return np.asarray(np.sqrt(relative * np.mean(stds**2) / np.mean(relative)))

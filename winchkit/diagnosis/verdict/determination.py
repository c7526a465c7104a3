"""Whether the data determine that an effect is there: its null outside the 95 % region.

The score of a candidate and the criterion of the selection have the noise variance of the rows. An
interval has more: blocks of time that vary, parts of the data that contradict each other, the
discretisation. An effect whose amplitudes may all be null within it is not named.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import HALF_WIDTH, Spread, whitened_jacobian
from winchkit.diagnosis.regression.noise import Noise
from winchkit.effects.parametrization import Coordinates

__all__ = ["region_holds_null"]

_OUTSIDE = 0.05


def region_holds_null(
    regression: Regression, fit: Fit, noise: Noise, spread: Spread, index: int
) -> bool:
    """Whether the 95 % region of the amplitudes of a term holds their null.

    Parameters
    ----------
    regression
        The data and the model.
    fit
        Fitted model.
    noise
        Noise variance.
    spread
        Uncertainty of the unknowns.
    index
        Of the term in the hypothesis.

    Returns
    -------
    bool
        For one amplitude: whether its interval holds the null.

    Notes
    -----
    Wald statistic zᵀR⁻¹z over χ²(k) for k amplitudes: z is the distance from the null over that
    from the value to the end of the interval on the side of the null, in standard deviations; R are
    the correlations of the linearised fit, so that amplitudes of which only a combination is
    determined are judged by that.
    """
    amplitudes = Coordinates(fit.hypothesis.terms[index].effect).amplitudes
    own = np.flatnonzero(regression.unknowns_of(index, fit.hypothesis))[: len(amplitudes)]
    value = fit.vector[own]
    if not value.size:
        return False
    end = np.where(value > 0.0, value - spread.low[own], spread.high[own] - value)
    z = value * HALF_WIDTH / np.maximum(end, 1e-300)
    whitened = whitened_jacobian(regression, fit, noise)
    covariance = np.linalg.pinv(whitened.T @ whitened, rcond=1e-12, hermitian=True)[
        np.ix_(own, own)
    ]
    length = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    correlation = covariance / np.outer(length, length)
    wald = float(z @ np.linalg.pinv(correlation, rcond=1e-9, hermitian=True) @ z)
    return wald < float(chdtri(len(value), _OUTSIDE))

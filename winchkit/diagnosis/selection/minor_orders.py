"""Orders of a harmonic series that are not significant beside the other effects of a model."""

from __future__ import annotations

import numpy as np

from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import whitened_jacobian
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.projection import inverse_normal
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.series import harmonic_series, single_orders


def significant_orders(
    regression: Regression, fitted: Fit, noise: BandNoise, penalty_per_parameter: float
) -> Hypothesis:
    """Hypothesis without the orders of its series that decrease χ² by less than their penalty.

    ``penalty_per_parameter``: of the criterion, ln n for BIC. Returns: that of the fit itself where
    every order stays; a series of which none is significant stays whole.

    Notes
    -----
    Wald statistic of the cosine and sine amplitudes of each order. Orders that were added before
    another effect may have explained a part of it.
    """
    hypothesis = fitted.hypothesis
    series = [i for i, term in enumerate(hypothesis.terms) if term.effect.single is not None]
    if not series:
        return hypothesis
    covariance = inverse_normal(whitened_jacobian(regression, fitted, noise))
    for index in series:
        term = hypothesis.terms[index]
        own = np.flatnonzero(regression.unknowns_of(index, fitted.hypothesis))
        singles = [single for single, _ in single_orders(term)]
        pairs = own.reshape(len(singles), -1)
        least = penalty_per_parameter * Coordinates(singles[0].effect).n_parameters
        kept = [
            single
            for single, pair in zip(singles, pairs, strict=True)
            if fitted.vector[pair]
            @ np.linalg.pinv(covariance[np.ix_(pair, pair)], hermitian=True)
            @ fitted.vector[pair]
            >= least
        ]
        if kept and len(kept) < len(singles):
            hypothesis = hypothesis.with_term_at(index, harmonic_series(kept))
    return hypothesis

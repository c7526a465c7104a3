"""Significance and relevance of every effect of a final model beside the others.

Effects are added one at a time where their score exceeds the level of the largest score under noise
alone. An effect that was added early must exceed the same threshold beside those that followed. The
noise variance of the rows is not enough for that: blocks of time vary, parts of the data contradict
each other, the motion is sampled. The decrease of χ² is therefore divided by the ratio of the
variance that the intervals have to that of the likelihood: a quasi-likelihood ratio.

References
----------
Rao, J. N. K., Scott, A. J. (1984). On chi-squared tests for multiway contingency tables with cell
proportions estimated from survey data. Ann. Statist. 12, 46-60.
Kent, J. T. (1982). Robust properties of likelihood ratio tests. Biometrika 69, 19-27.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import Spread, spread_of, whitened_jacobian
from winchkit.diagnosis.regression.noise import Noise, satterthwaite_dof, sums_per_band
from winchkit.diagnosis.regression.projection import partialled_out
from winchkit.diagnosis.selection.acceptance import is_relevant
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.scores import score_by_chance
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet
from winchkit.effects.parametrization import Coordinates

__all__ = ["excess_evidence", "negligible_additions", "variance_inflation"]

_UNIDENTIFIABLE = 1e-9


def negligible_additions(
    engine: SelectionEngine,
    result: SelectionResult,
    spread: Spread,
    sets: Sequence[EquivalenceSet],
) -> Iterator[int]:
    """Additions beside others that are not relevant or not significant, the weakest first.

    An addition is not significant where no member of its set is, and not relevant where it
    decreases no held-out error by 2 %: what acceptance asks of an addition alone holds for every
    effect of the final model beside the others.

    Parameters
    ----------
    engine
        Selection engine.
    result
        Result of a selection.
    spread
        Uncertainty of the unknowns of its final model.
    sets
        Equivalence set of every addition.

    Yields
    ------
    int
        Index in the final model; none for a single addition.
    """
    final, noise, first = result.final, result.noise, engine.n_initial_terms
    if len(sets) < 2:
        return
    excess = [
        excess_evidence(engine, final, noise, spread, first + place, threshold=result.threshold)
        for place in range(len(sets))
    ]
    for place in np.argsort(excess).tolist():
        index = first + int(place)
        if excess[place] > 0.0:
            without = engine.refit(final.hypothesis.without(index), noise)
            negligible = not is_relevant(engine, without, final, noise)
        else:
            negligible = not any(
                _last_is_significant(engine, rival, noise, result.threshold)
                for rival in sets[place].fits
                if rival is not final
            )
        if negligible:
            yield index


def _last_is_significant(
    engine: SelectionEngine, rival: Fit, noise: Noise, threshold: float
) -> bool:
    """Whether the rival of an addition is, the last effect of its fit."""
    # The sets are compared under other weights than those of the reported model.
    rival = engine.refit(rival.hypothesis, noise)
    last = len(rival.hypothesis.terms) - 1
    spread = spread_of(engine.regression, rival, noise, engine.regression.blocks)
    return excess_evidence(engine, rival, noise, spread, last, threshold=threshold) > 0.0


def excess_evidence(
    engine: SelectionEngine,
    fitted: Fit,
    noise: Noise,
    spread: Spread,
    index: int,
    *,
    threshold: float,
) -> float:
    """Evidence of an effect beside the others beyond a threshold.

    Parameters
    ----------
    engine
        Selection engine.
    fitted
        Fitted model.
    noise
        Noise variance.
    spread
        Uncertainty of the unknowns.
    index
        Of the effect in the hypothesis.
    threshold
        Score that noise alone exceeds in 1 % of cases.

    Returns
    -------
    float
        Decrease of χ² by the effect, the others refitted, over its variance inflation, less the
        penalty of its parameters and the threshold, or less what noise gives this effect by the
        degrees of freedom where it acts.
    """
    without = fitted.hypothesis.without(index)
    penalty = engine.penalty(fitted.hypothesis) - engine.penalty(without)
    decrease = engine.refit(without, noise).chi_square - fitted.chi_square
    inflation = variance_inflation(engine.regression, fitted, spread, index)
    by_chance = score_by_chance(
        penalty,
        _amplitudes(engine.regression, fitted, index).size,
        _degrees_of_freedom(engine.regression, fitted, noise, index),
        len(engine.signatures.candidates),
    )
    return decrease / inflation - penalty - min(threshold, by_chance)


def _amplitudes(regression: Regression, fit: Fit, index: int) -> NDArray[np.intp]:
    """Places of an effect's amplitudes among the unknowns."""
    amplitudes = Coordinates(fit.hypothesis.terms[index].effect).amplitudes
    return np.flatnonzero(regression.unknowns_of(index, fit.hypothesis))[: len(amplitudes)]


def _degrees_of_freedom(regression: Regression, fit: Fit, noise: Noise, index: int) -> float:
    """Degrees of freedom of the noise variance where an effect acts beside the others."""
    own = _amplitudes(regression, fit, index)
    columns = whitened_jacobian(regression, fit, noise)
    beside = partialled_out(np.delete(columns, own, axis=1), columns[:, own])
    information, bands = np.sum(beside**2, axis=1), regression.band_of_row
    parts = sums_per_band(information, bands, len(regression.bands))
    return float(satterthwaite_dof(parts, noise.dof))


def variance_inflation(regression: Regression, fit: Fit, spread: Spread, index: int) -> float:
    """Variance of an effect's size over that of the likelihood.

    Parameters
    ----------
    regression
        The data and the model.
    fit
        Fitted model.
    spread
        Uncertainty of the unknowns.
    index
        Of the effect in the hypothesis.

    Returns
    -------
    float
        Infinite where the runs do not determine the effect; one where its size is not fitted.

    Notes
    -----
    Ratio of two Wald statistics zᵀR⁻¹z of the amplitudes' distances z from their null, in standard
    deviations of the likelihood and in those of the intervals; R are the
    correlations of the linearised fit. For one amplitude it is the squared widening; of several
    amplitudes it is the inflation of the combination that the fit found.
    """
    own = _amplitudes(regression, fit, index)
    if not own.size:
        return 1.0
    covariance = spread.covariance[np.ix_(own, own)]
    length = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    inverse = np.linalg.pinv(
        covariance / np.outer(length, length), rcond=_UNIDENTIFIABLE, hermitian=True
    )
    z = fit.vector[own] / length
    widened = z / spread.widening[own]
    wald = float(widened @ inverse @ widened)
    return float(z @ inverse @ z) / wald if wald > 0.0 else float("inf")

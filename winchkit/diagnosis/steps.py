"""Steps of a selection: every addition with its equivalence set, values and held-out gain."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, zip_longest

import numpy as np

from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.regression.conditioning import value_covariance
from winchkit.diagnosis.regression.cross_validation import held_out
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import Spread, estimates, spread_of
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.results import CandidateScore, Estimate, Step
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.verdict.combination import combination_of_set, combination_of_term
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet

__all__ = ["candidates_of", "steps_of"]


def steps_of(
    engine: SelectionEngine,
    result: SelectionResult,
    sets: Sequence[EquivalenceSet],
    dataset: Dataset | None = None,
    spread: Spread | None = None,
) -> tuple[Step, ...]:
    """Every addition with its equivalence set, values and held-out gain.

    Parameters
    ----------
    engine
        Selection engine.
    result
        Result of the selection.
    sets
        Equivalence set of every addition.
    dataset
        Runs of the winch, for combinations that have a name; None for a robot.
    spread
        Uncertainty of the unknowns of the final model, where it is known already.
    """
    final, noise, regression = result.final, result.noise, engine.regression
    out = []
    spread = spread or spread_of(regression, final, noise, regression.blocks)
    own = estimates(regression, final, spread)[engine.n_initial_terms :]
    covariance = value_covariance(regression, final, noise)
    for equivalence, gain, (term, values) in zip(
        sets, _gains(engine, final, noise), own, strict=True
    ):
        parameters = {
            member.effect.id: values
            if member.effect.id == term.effect.id
            else _values_of_rival(engine, result, fitted)
            for member, fitted in zip(equivalence.terms, equivalence.fits, strict=True)
        }
        combination = combination_of_set(equivalence.terms, parameters, dataset)
        if combination is None and equivalence.term.effect.id == term.effect.id:
            combination = combination_of_term(term, covariance)
        out.append(
            Step(equivalence.effects, parameters, gain, equivalence.angles, combination=combination)
        )
    return tuple(out)


def _values_of_rival(
    engine: SelectionEngine, result: SelectionResult, fitted: Fit
) -> dict[str, Estimate]:
    """Values of the last effect of a rival's fit, with their uncertainty."""
    regression, noise = engine.regression, result.noise
    # The reported model may have other weights than those of the comparison.
    fitted = engine.refit(fitted.hypothesis, noise)
    spread = spread_of(regression, fitted, noise, regression.blocks)
    return estimates(regression, fitted, spread)[-1][1]


def _gains(engine: SelectionEngine, final: Fit, noise: Noise) -> list[float]:
    """Relative decrease of the held-out χ² by each addition, in the order of selection."""
    hypothesis = final.hypothesis
    squares, folds = [], engine.folds(final, noise)
    for count in range(engine.n_initial_terms, len(hypothesis.terms) + 1):
        partial = Hypothesis(
            hypothesis.terms[:count], hypothesis.nuisances, hypothesis.starts[:count]
        )
        fitted = final if count == len(hypothesis.terms) else engine.refit(partial, noise)
        squares.append(float(np.sum(held_out(engine.regression, fitted, noise, folds))))
    return [1 - after / before for before, after in pairwise(squares)]


def candidates_of(engine: SelectionEngine, result: SelectionResult) -> tuple[CandidateScore, ...]:
    """Every candidate with its score, the first ones with their held-out errors."""
    out = []
    folds = engine.folds(result.final, result.noise)
    for item, fitted in zip_longest(result.scores, result.tried):
        rms: dict[str, float] = {}
        if fitted is not None:
            rms = engine.held_out_errors(fitted, result.initial_noise, folds)
        out.append(CandidateScore(item.candidate.effect.id, item.net_gain, rms))
    return tuple(out)

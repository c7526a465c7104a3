"""Order of the effects of a model: that in which it grows by the largest decrease of the error."""

from __future__ import annotations

from dataclasses import replace

from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult


def ordered_by_contribution(engine: SelectionEngine, result: SelectionResult) -> SelectionResult:
    """The result with its additions in the order of forward selection among themselves.

    The search weights by the noise of each frequency band and exchanges effects, so that its order
    is not that of the contributions. Here each next addition leaves the least sum of the outputs'
    held-out mean squares in units of the noise.
    """
    hypothesis, noise, first = result.final.hypothesis, result.noise, engine.n_initial_terms
    added = list(range(first, len(hypothesis.terms)))
    if len(added) < 2:
        return result
    folds = engine.folds(result.final, noise)

    def chosen(indices: list[int]) -> Hypothesis:
        kept = [*range(first), *indices]
        return Hypothesis(
            tuple(hypothesis.terms[index] for index in kept),
            hypothesis.nuisances,
            tuple(hypothesis.starts[index] for index in kept),
        )

    def error(indices: list[int]) -> float:
        errors = engine.held_out_errors(engine.refit(chosen(indices), noise), noise, folds)
        return sum((rms / noise.rms[output]) ** 2 for output, rms in errors.items())

    order: list[int] = []
    while len(order) < len(added) - 1:
        left = [index for index in added if index not in order]
        order.append(min(left, key=lambda index: error([*order, index])))
    order += [index for index in added if index not in order]
    if order == added:
        return result
    return replace(result, final=engine.refit(chosen(order), noise))

"""Order of the effects of a model: that in which it grows by the largest decrease of the error."""

from __future__ import annotations

from dataclasses import replace

from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term


def ordered_by_contribution(engine: SelectionEngine, result: SelectionResult) -> SelectionResult:
    """The result with its additions in the order of forward selection among themselves, without
    those whose amplitudes ended at their nulls.

    The search weights by the noise of each frequency band and exchanges effects, so that its order
    is not that of the contributions. Here each next addition leaves the least sum of the outputs'
    held-out mean squares in units of the noise.
    """
    hypothesis, noise, first = result.final.hypothesis, result.noise, engine.n_initial_terms
    additions = list(range(first, len(hypothesis.terms)))
    added = [index for index in additions if not _is_null(hypothesis.terms[index])]
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
    if order == additions:
        return result
    return replace(result, final=engine.refit(chosen(order), noise))


def _is_null(term: Term) -> bool:
    """Whether all amplitudes of an effect are at their nulls, where it changes nothing."""
    effect = term.effect
    phases = {phase for _, phase in effect.polar_pairs}
    sizes = [p for p in Coordinates(effect).amplitudes if p.name not in phases]
    return bool(sizes) and all(term.values[p.name] == p.null for p in sizes)

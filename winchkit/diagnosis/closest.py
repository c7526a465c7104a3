"""Effects that a verdict does not name but offers, with their values and the reason."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.diagnosis.regression.conditioning import collinearity
from winchkit.diagnosis.regression.intervals import Spread
from winchkit.diagnosis.results import Closest, Step
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.steps import steps_of
from winchkit.diagnosis.verdict.decision import Judgement
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet, equivalence_set
from winchkit.diagnosis.verdict.plausibility import implausible

__all__ = ["beside_the_named", "imitations", "plausible_sets", "unnamed_sets"]

_LARGEST_COLLINEARITY = 1e5
"""Law and channel are accurate to 0.3 % at best: where the others imitate an effect's change to
within that, what distinguishes it is less than their error."""
_CANCELS = "the others imitate its change to within 0.3 %: their values cancel each other"
_IMITATES = "a part of the residual is unexplained: it may imitate the cause"


def plausible_sets(
    engine: TimeSeriesSelection,
    result: SelectionResult,
    sets: Sequence[EquivalenceSet],
    spread: Spread,
) -> tuple[list[EquivalenceSet], tuple[Step, ...], tuple[Closest, ...]]:
    """Sets without members of implausible values, their steps, and the effects of empty sets.

    Where a set has no other member, nothing is named: the other effects were fitted beside it.
    Nor is anything named where the change of one is nearly that of the others together.
    """
    dataset, found = engine.regression.dataset, list(sets)
    if not found:
        return [], (), ()
    steps = steps_of(engine, result, found, dataset, spread)
    kept, closest = [], []
    for index, (equivalence, step) in enumerate(zip(found, steps, strict=True)):
        place = engine.n_initial_terms + index
        ratio = collinearity(engine.regression, result.final, result.noise, place)
        cancels = _CANCELS if ratio > _LARGEST_COLLINEARITY else None
        reasons = {
            term.effect.id: implausible(term, step.parameters[term.effect.id], dataset.profile)
            or cancels
            for term in equivalence.terms
        }
        possible = [effect for effect, reason in reasons.items() if reason is None]
        if possible:
            kept.append(equivalence.only(possible))
        else:
            closest += [
                Closest(effect, step.parameters[effect], reason)
                for effect, reason in reasons.items()
                if reason is not None
            ]
    if closest:
        return [], (), tuple(closest)
    if all(a.effects == b.effects for a, b in zip(found, kept, strict=True)):
        return found, steps, ()
    return kept, steps_of(engine, result, kept, dataset, spread), ()


def imitations(
    engine: TimeSeriesSelection, result: SelectionResult, sets: Sequence[EquivalenceSet]
) -> tuple[Closest, ...]:
    """First effects of the sets that explain a part, with their values."""
    steps = steps_of(engine, result, sets, engine.regression.dataset)
    return tuple(
        Closest(step.effects[0], step.parameters[step.effects[0]], _IMITATES) for step in steps
    )


def beside_the_named(
    engine: TimeSeriesSelection, result: SelectionResult, reported: SelectionResult
) -> tuple[Closest, ...]:
    """Additions of the search that are not named beside others, with their values."""
    named = [term.label for term in reported.final.hypothesis.terms]
    added = result.final.hypothesis.terms[engine.n_initial_terms :]
    alone = [EquivalenceSet(t, (t.effect.id,), (t,), (result.final,), {}) for t in added]
    found = imitations(engine, result, alone)
    return tuple(each for each, term in zip(found, added, strict=True) if term.label not in named)


def unnamed_sets(
    engine: TimeSeriesSelection, result: SelectionResult, judgement: Judgement
) -> list[EquivalenceSet]:
    """Equivalence sets of additions that are not named, where a part of the residual is explained.

    None for an unknown effect: additions that imitate an effect outside the catalogue would lead to
    a wrong programme.
    """
    if judgement.verdict != "partly":
        return []
    added = range(engine.n_initial_terms, len(result.final.hypothesis.terms))
    return [equivalence_set(engine, result.final, result.noise, index) for index in added]

"""Values that depend on what another step is: with another member of its set, or without it.

One model gives every value beside the others as they are named. Where the runs do not decide on
another name, or on whether that effect is there at all, each of the models is as good, and a value
is known to their spread only (model averaging without weights).

References
----------
Buckland, S. T., Burnham, K. P., Augustin, N. H. (1997). Model selection: an integral part of
inference. Biometrics 53, 603-618.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, pi

from winchkit.diagnosis.regression.conditioning import collinearity
from winchkit.diagnosis.regression.cross_validation import CERTAIN
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.results import Doubt, Estimate, Step
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet
from winchkit.effects.term import Term
from winchkit.quantity_text import quantity

_WIDER = 2.0
"""Standard deviations from which another model's value counts; convention: 95 %."""
_SAME_CHANGE = 2.0
"""Ratio of two values above which the other step changes the same, and replaces this one."""
_IMITATED = 1 / CERTAIN**2
"""Variance inflation from which the others imitate an effect's change to within a tenth: what one
that may be absent adds to its value is then most of what is known of it; measured: five right
values have at most 3."""
_MAY_BE_ABSENT = frozenset(
    {"small", "remaining", "collinear", "undetermined", "implausible", "not-converged"}
)
"""Doubts with which an effect may not be there at all."""


@dataclass(frozen=True)
class _OtherModel:
    """A model that is as good, with another effect in place of one, or without it."""

    index: int
    """Place of that effect in the final model."""
    words: str
    terms: Mapping[str, Term]


def with_dependence(
    engine: SelectionEngine,
    result: SelectionResult,
    sets: Sequence[EquivalenceSet],
    steps: Sequence[Step],
) -> tuple[Step, ...]:
    """Steps whose values contain those of the other models; the last are those of ``sets``."""
    ids = [term.effect.id for term in result.final.hypothesis.terms]
    added = steps[len(steps) - len(sets) :]
    models = list(_with_other_members(engine, result, sets))
    index = {place: ids.index(step.effects[0]) for place, step in enumerate(steps)}
    absent = [ids.index(step.effects[0]) for step in added if _may_be_absent(step)]
    imitated = {
        place
        for place, own in index.items()
        if set(absent) - {own}
        and collinearity(engine.regression, result.final, result.noise, own) > _IMITATED
    }
    smaller = [_without(engine, result, own) for own in absent] if imitated else []
    return tuple(
        _widened(step, index[place], [*models, *smaller] if place in imitated else models)
        for place, step in enumerate(steps)
    )


def _may_be_absent(step: Step) -> bool:
    return bool(_MAY_BE_ABSENT & {doubt.code for doubt in step.doubts})


def _with_other_members(
    engine: SelectionEngine, result: SelectionResult, sets: Sequence[EquivalenceSet]
) -> Iterator[_OtherModel]:
    for index, each in enumerate(sets, start=engine.n_initial_terms):
        own = result.final.hypothesis.terms[index].effect.id
        for term, fitted in zip(each.terms, each.fits, strict=True):
            if term.effect.id != own:
                words = f"with {term.effect.id} in place of {own}"
                yield _OtherModel(index, words, _by_id(fitted))


def _without(engine: SelectionEngine, result: SelectionResult, index: int) -> _OtherModel:
    final = result.final.hypothesis
    smaller = engine.refit(final.without(index), result.noise)
    return _OtherModel(index, f"without {final.terms[index].effect.id}", _by_id(smaller))


def _by_id(fitted: Fit) -> Mapping[str, Term]:
    return {term.effect.id: term for term in fitted.hypothesis.terms}


def _widened(step: Step, index: int, models: Sequence[_OtherModel]) -> Step:
    """A step whose intervals contain its values in the models that differ in another step; it is
    not certain where they differ by a tenth of the value, or where one of them does without it.
    """
    effect = step.effects[0]
    values, farthest, always = dict(step.parameters[effect]), (1.0, ""), True
    for model in models:
        if model.index == index:
            continue
        if effect not in model.terms:
            farthest, always = (inf, f"it is not needed {model.words}"), False
            continue
        for name, own in step.parameters[effect].items():
            change = _change(model.terms[effect], name, own)
            if not abs(change) > _WIDER * own.std:
                continue
            values[name] = _containing(values[name], own, change)
            if (ratio := abs(change) / own.std if own.std else 0.0) > farthest[0]:
                shown = quantity(own.value + change, own.unit)
                what = f"its {name.replace('_', ' ')} is {shown} {model.words}"
                farthest = ratio, what
    if not farthest[1]:
        return step
    doubts = (*step.doubts, Doubt("depends", farthest[1]))
    known = all(
        estimate.std <= CERTAIN * abs(estimate.value)
        for name, estimate in values.items()
        if estimate is not step.parameters[effect][name] and not name.startswith("phase")
    )
    return replace(
        step,
        parameters={**step.parameters, effect: values},
        doubts=doubts,
        certain=step.certain and always and known,
    )


def _change(term: Term, name: str, own: Estimate) -> float:
    """Difference of a value from that of the final model; zero where the two are not alike."""
    parameter, other = term.effect.parameter(name), term.values[name]
    change = other - own.value
    if parameter.whole or not (isfinite(own.std) and isfinite(change)):
        return 0.0
    if name.startswith("phase"):
        return (change + pi) % (2 * pi) - pi
    alike = own.value and 1 / _SAME_CHANGE <= other / own.value <= _SAME_CHANGE
    return change if alike else 0.0


def _containing(wide: Estimate, own: Estimate, change: float) -> Estimate:
    """An estimate that contains the interval of its own model, moved by a change."""
    interval = wide.interval
    if interval is not None and own.interval is not None:
        low, high = (end + change for end in own.interval)
        interval = min(interval[0], low), max(interval[1], high)
    return replace(wide, std=max(wide.std, abs(change)), interval=interval)

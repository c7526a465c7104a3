"""Contributions of effects to the held-out error: in sequence, added first, and removed last."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.results import Step
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection

GEOMETRY_NAME = "the whole geometry"
"""Name of the change of a robot's model in which all of its geometry is fitted."""
REFITTED_NAME = "refitted values"
"""Name of the change of a winch's model in which the values of its profile are fitted."""


@dataclass(frozen=True)
class Waterfall:
    """Held-out rms per output, SI, at every step."""

    steps: tuple[tuple[str, Mapping[str, float]], ...]
    """The unchanged profile, then with each effect in the order of the steps."""
    first: Mapping[str, Mapping[str, float]]
    """By effect: the profile with it alone."""
    last: Mapping[str, Mapping[str, float]]
    """By effect: the profile with all other steps."""


def waterfall_of(answer: Answer) -> Waterfall | None:
    """Contributions of the effects of a diagnosis; None without steps."""
    diagnosis, engine, file_engine = answer.diagnosis, answer.engine, answer.file_engine
    if not diagnosis.steps:
        return None
    whole = answer.result.final.hypothesis
    added = tuple(range(engine.n_initial_terms, len(whole.terms)))
    names = [whole.terms[index].label for index in added]
    before = {o: fit.heldout_rms_before for o, fit in diagnosis.outputs.items()}
    after = {o: fit.heldout_rms_after for o, fit in diagnosis.outputs.items()}
    subsets = _SubsetErrors(engine, answer.result, {added: after})
    steps: list[tuple[str, Mapping[str, float]]] = [("unchanged profile", before)]
    first: dict[str, Mapping[str, float]] = {}
    if file_engine is not engine:
        plain = _SubsetErrors(file_engine, answer.result, {(): before})
        steps.append((f"+ {GEOMETRY_NAME}", subsets.error()))
        first[GEOMETRY_NAME] = subsets.error()
    else:
        plain = subsets
        if any(step.refitted for step in diagnosis.steps):
            steps.append((f"+ {REFITTED_NAME}", subsets.error()))
            first[REFITTED_NAME] = subsets.error()
        else:
            subsets.known[()] = before
    steps += [(f"+ {name}", subsets.error(*added[: n + 1])) for n, name in enumerate(names)]
    first |= {name: plain.error(index) for name, index in zip(names, added, strict=True)}
    own = [
        GEOMETRY_NAME if step.whole else step.effects[0]
        for step in diagnosis.steps[: _n_own(answer)]
    ]
    last = dict(zip((*own, *names), errors_without(answer), strict=False))
    return Waterfall(tuple(steps), first, {name: rms for name, rms in last.items() if rms})


def errors_without(answer: Answer) -> list[Mapping[str, float]]:
    """Held-out errors of the final model without each step, refitted, by output; empty for none.

    A refitted value of the profile is set back to that of the file.
    """
    engine, result = answer.engine, answer.result
    hypothesis, count = result.final.hypothesis, _n_own(answer)
    subsets = _SubsetErrors(engine, result, {})
    out = [_without_own(answer, step, subsets) for step in answer.diagnosis.steps[:count]]
    indices = range(engine.n_initial_terms, len(hypothesis.terms))
    return out + [subsets.of(hypothesis.without(index)) for index in indices]


def falls_of(answer: Answer) -> list[tuple[Mapping[str, float], Mapping[str, float]]]:
    """Held-out errors before and after each step, refitted, by output.

    Those of an addition are with the additions before it, as the model grows; of a refitted value
    they are of the final model with that of the file and with its own.
    """
    engine, result = answer.engine, answer.result
    added = tuple(range(engine.n_initial_terms, len(result.final.hypothesis.terms)))
    after = {name: output.heldout_rms_after for name, output in answer.diagnosis.outputs.items()}
    subsets = _SubsetErrors(engine, result, {added: after})
    own = answer.diagnosis.steps[: _n_own(answer)]
    grown = [subsets.error(*added[:count]) for count in range(len(added) + 1)]
    return [*((_without_own(answer, step, subsets), after) for step in own), *pairwise(grown)]


def _n_own(answer: Answer) -> int:
    """Number of steps that change the model with which the search began; the others follow."""
    added = len(answer.result.final.hypothesis.terms) - answer.engine.n_initial_terms
    return max(0, len(answer.diagnosis.steps) - added)


def _without_own(answer: Answer, step: Step, subsets: _SubsetErrors) -> Mapping[str, float]:
    engine, result = answer.engine, answer.result
    hypothesis = result.final.hypothesis
    terms = hypothesis.terms[: engine.n_initial_terms]
    if step.whole:
        added = range(engine.n_initial_terms, len(hypothesis.terms))
        return _SubsetErrors(answer.file_engine, result, {}).error(*added)
    index = next((i for i, term in enumerate(terms) if term.effect.id == step.effects[0]), None)
    if index is None:
        return {}
    if step.refitted:
        held = result.initial_model.hypothesis.terms[index]
        return subsets.of(hypothesis.with_term_at(index, held))
    return subsets.of(hypothesis.without(index))


@dataclass(frozen=True)
class _SubsetErrors:
    """Held-out errors of a model with some of its effects."""

    engine: SelectionEngine
    result: SelectionResult
    known: dict[tuple[int, ...], Mapping[str, float]]

    def error(self, *terms: int) -> Mapping[str, float]:
        """Held-out error of the profile with these effects, refitted."""
        if terms not in self.known:
            first = range(self.engine.n_initial_terms)
            self.known[terms] = self.of(_only(self.result.final.hypothesis, (*first, *terms)))
        return self.known[terms]

    def of(self, model: Hypothesis) -> Mapping[str, float]:
        """Held-out error of a model, refitted."""
        noise = self.result.noise
        folds = self.engine.folds(self.result.final, noise)
        errors = self.engine.held_out_errors(self.engine.refit(model, noise), noise, folds)
        if not isinstance(self.engine, TimeSeriesSelection):
            return errors
        return in_units_of(self.engine.regression.dataset.profile, errors)


def _only(whole: Hypothesis, kept: tuple[int, ...]) -> Hypothesis:
    """Some terms of a hypothesis; its nuisance parameters are linear and restart at zero."""
    return Hypothesis(
        tuple(whole.terms[index] for index in kept),
        (),
        tuple(whole.starts[index] for index in kept),
    )

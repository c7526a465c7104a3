"""The search: one effect at a time, everything refitted, gated out of sample, then reconsidered."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.lack_of_fit import LackOfFitTest
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.selection.acceptance import MIN_GAIN, best_accepted, is_accepted
from winchkit.diagnosis.selection.engine import SelectionEngine, Trial
from winchkit.diagnosis.selection.exchange import pair_exchange
from winchkit.diagnosis.selection.scores import Score, null_maxima
from winchkit.diagnosis.selection.starting_values import other_grid_point
from winchkit.effects.term import Term

__all__ = ["SelectionResult", "stepwise_selection", "with_pair", "without_term"]

_MOST_STEPS = 6
_SHORT_LIST = 5
_RIVALS = 2
_RECONSIDERED = 3
_EXCHANGED = 2
"""Additions of which one may be exchanged for a pair."""
_PAIRS = 3
_LACK_OF_FIT_LEVEL = 0.02
_SCORE_LEVEL = 0.99


@dataclass(frozen=True)
class SelectionResult:
    """Where a search ended."""

    initial_model: Fit
    """The model it began with, fitted."""
    initial_noise: Noise
    initial_lack_of_fit_test: LackOfFitTest
    lack_of_fit_at_start: bool
    """Whether anything beyond noise was there at the start."""
    last_model: Hypothesis
    """The final model with additions that were dropped since they may only imitate something."""
    final: Fit
    noise: Noise
    lack_of_fit_test: LackOfFitTest
    lack_of_fit: bool
    """Whether anything beyond noise is left at the end."""
    scores: tuple[Score, ...]
    """Of all candidates at the start, best first."""
    tried: tuple[Fit, ...]
    """The first of them as fitted beside the model it began with; none without an alarm."""
    threshold: float
    """Score that noise alone reaches in one case of a hundred."""


def stepwise_selection(engine: SelectionEngine) -> SelectionResult:
    """Grow the model while something is missing and an effect holds out of sample."""
    initial_model, initial_noise = engine.fit_with_noise(engine.initial_model)
    initial_lack_of_fit_test = engine.lack_of_fit_test(initial_model, initial_noise)
    initial_scores = engine.scores(initial_model, initial_noise)
    threshold = _threshold(engine, initial_model, initial_noise)
    last_model, noise, tried = _forward_selection(
        engine, initial_model, initial_noise, initial_scores, threshold
    )
    final, noise = _without_doubtful_terms(engine, last_model, noise)
    lack_of_fit_test = engine.lack_of_fit_test(final, noise)
    grew = len(final.hypothesis.terms) > engine.n_initial_terms
    lack_of_fit_at_start = grew or _has_lack_of_fit(
        initial_lack_of_fit_test, initial_scores, threshold
    )
    if lack_of_fit_at_start and not tried:
        tried = _fits(_short_list(engine, initial_model, initial_noise, initial_scores))
    return SelectionResult(
        initial_model=initial_model,
        initial_noise=initial_noise,
        initial_lack_of_fit_test=initial_lack_of_fit_test,
        lack_of_fit_at_start=lack_of_fit_at_start,
        last_model=last_model.hypothesis,
        final=final,
        noise=noise,
        lack_of_fit_test=lack_of_fit_test,
        lack_of_fit=_has_lack_of_fit(lack_of_fit_test, engine.scores(final, noise), threshold),
        scores=tuple(initial_scores),
        tried=tried if lack_of_fit_at_start else (),
        threshold=threshold,
    )


def _forward_selection(
    engine: SelectionEngine, present: Fit, noise: Noise, scores: list[Score], threshold: float
) -> tuple[Fit, Noise, tuple[Fit, ...]]:
    """The model with all that holds, its noise, and the candidates that were tried first."""
    tried: tuple[Fit, ...] = ()
    for _ in range(_MOST_STEPS):
        grown = None
        if scores and scores[0].net_gain > threshold:
            trials = _short_list(engine, present, noise, scores)
            tried = tried or _fits(trials)
            grown = best_accepted(engine, present, noise, trials)
        grown = grown or _best_pair(engine, present, noise)
        if grown is None:
            break
        engine.update_signatures(grown.hypothesis)
        present, noise = engine.fit_with_noise(grown.hypothesis, noise)
        present, noise = _exchange_and_eliminate(engine, present, noise)
        scores = engine.scores(present, noise)
    return present, noise, tried


def _threshold(engine: SelectionEngine, present: Fit, noise: Noise) -> float:
    """Score that noise alone reaches in one case of a hundred."""
    chance = null_maxima(engine.projected(present, noise), engine.regression.n_rows)
    return max(0.0, float(np.quantile(chance, _SCORE_LEVEL)))


def without_term(engine: SelectionEngine, result: SelectionResult, index: int) -> SelectionResult:
    """The same search as if it had ended without one of its additions."""
    return _ended(engine, result, result.final.hypothesis.without(index))


def with_pair(engine: SelectionEngine, result: SelectionResult) -> SelectionResult | None:
    """The same search with a pair in the place of its only addition; None where none is better."""
    if len(result.final.hypothesis.terms) != engine.n_initial_terms + 1:
        return None
    better = _accepted_pair_exchange(engine, result.final, result.noise, result.initial_model)
    return None if better is None else _ended(engine, result, better.hypothesis)


def _ended(
    engine: SelectionEngine, result: SelectionResult, hypothesis: Hypothesis
) -> SelectionResult:
    """A search as if it had ended with this hypothesis."""
    present, noise = engine.fit_with_noise(hypothesis, result.noise)
    lack_of_fit_test = engine.lack_of_fit_test(present, noise)
    lack_of_fit = _has_lack_of_fit(
        lack_of_fit_test, engine.scores(present, noise), result.threshold
    )
    return replace(
        result,
        final=present,
        noise=noise,
        lack_of_fit_test=lack_of_fit_test,
        lack_of_fit=lack_of_fit,
    )


def _has_lack_of_fit(
    lack_of_fit_test: LackOfFitTest, scores: list[Score], threshold: float
) -> bool:
    """Whether the residual holds more than noise.

    With repeats that is measured. A high score of an effect that then fails out of sample is no
    evidence beside it; without repeats it is all there is.
    """
    if np.isfinite(lack_of_fit_test.p_value):
        return lack_of_fit_test.p_value < _LACK_OF_FIT_LEVEL
    return bool(scores) and scores[0].net_gain > threshold


def _short_list(
    engine: SelectionEngine, present: Fit, noise: Noise, scores: list[Score]
) -> list[Trial]:
    """The candidates that score best, each fitted beside the present terms, in their order."""
    listed = [item for item in scores if item.net_gain > 0][:_SHORT_LIST]
    return [engine.trial(present, item, noise) for item in listed]


def _best_pair(engine: SelectionEngine, present: Fit, noise: Noise) -> Fit | None:
    """Where something is missing and no candidate holds alone: the best of pairs that do.

    In exchange for one of the first additions, or to begin with in outputs that no addition acts
    on: pairs upon what is there already would piece together what nobody knows.
    """
    added = len(present.hypothesis.terms) - engine.n_initial_terms
    if not engine.lack_of_fit_test(present, noise).p_value < _LACK_OF_FIT_LEVEL:
        return None
    better = (
        _accepted_pair_exchange(engine, present, noise, present)
        if 0 < added <= _EXCHANGED
        else None
    )
    if better is not None or _acts_on_unexplained_output(engine, present, noise):
        return better
    pairs = engine.pairs(present, noise)
    # Two may also fail alone since each is wrong where the other acts: a drag one way only.
    best = [pair for pair in pairs if pair.suppressed][:_PAIRS]
    best += [pair for pair in pairs[:_PAIRS] if not pair.suppressed]
    trials = [
        engine.trial(engine.trial(present, a, noise).fit, b, noise)
        for a, b in (pair.scores for pair in best)
    ]
    return best_accepted(engine, present, noise, trials)


def _acts_on_unexplained_output(engine: SelectionEngine, present: Fit, noise: Noise) -> bool:
    """Whether an addition acts on an output in which something is missing still."""
    regression = engine.regression
    rejected = np.flatnonzero(engine.lack_of_fit_test(present, noise).rejected).tolist()
    lacking = {regression.bands[band][0] for band in rejected}
    added = present.hypothesis.terms[engine.n_initial_terms :]
    return any(regression.outputs_of(term.effect.stage) & lacking for term in added)


def _accepted_pair_exchange(
    engine: SelectionEngine, present: Fit, noise: Noise, against: Fit
) -> Fit | None:
    """A better pair in the place of one addition, that holds against another fit; or None.

    It need not lower an error by much: where something is missing, one effect may nearly do what
    two did, with other values.
    """
    better = pair_exchange(engine, present, noise, 1)
    if better is present or not is_accepted(engine, against, better, noise, matters=1.0):
        return None
    return better


def _fits(trials: list[Trial]) -> tuple[Fit, ...]:
    return tuple(trial.fit for trial in trials)


def _exchange_and_eliminate(
    engine: SelectionEngine, present: Fit, noise: Noise
) -> tuple[Fit, Noise]:
    """Drop what is no longer needed, and replace what another effect explains better.

    Again while that changes anything: the first of two effects may have stood for both, and what
    it is best replaced by shows only beside the second.
    """
    for _ in range(_RECONSIDERED):
        before = present.labels
        present = _exchanged_terms(engine, _backward_elimination(engine, present, noise), noise)
        present = pair_exchange(engine, present, noise, 2)
        present = _backward_elimination(engine, present, noise)
        if present.labels == before or len(present.hypothesis.terms) < engine.n_initial_terms + 2:
            break
    return engine.fit_with_noise(present.hypothesis, noise)


def _exchanged_terms(engine: SelectionEngine, present: Fit, noise: Noise) -> Fit:
    """With every addition replaced by the best of its rivals that fits better."""
    for index in range(engine.n_initial_terms, len(present.hypothesis.terms)):
        if index >= len(present.hypothesis.terms):
            break  # A rival stood for two.
        own = present.hypothesis.terms[index]
        base = engine.refit(present.hypothesis.without(index), noise)
        rivals = _rivals_of(own, engine.scores(base, noise))
        trials = [engine.trial(base, item, noise) for item in rivals]
        best = min(trials, key=lambda t: t.criterion, default=None)
        if best is not None and best.criterion < engine.criterion(present) - MIN_GAIN:
            present = best.fit
    return present


def _rivals_of(own: Term, scores: list[Score]) -> list[Score]:
    """The best candidates for a term's place, and the simpler laws that they contain.

    Before it is fitted a law with more numbers looks better than the simple one that it contains.
    """
    others = [item for item in scores if item.net_gain > 0 and _another(item, own)]
    best = others[:_RIVALS]
    simpler = {name for item in best for name in item.candidate.effect.contains}
    return best + [item for item in others[_RIVALS:] if item.candidate.effect.id in simpler]


def _another(item: Score, own: Term) -> bool:
    """Whether a candidate is another effect than a term, or the same from another place."""
    return item.candidate.effect.id != own.effect.id or other_grid_point(own, item.candidate.shape)


def _without_doubtful_terms(
    engine: SelectionEngine, present: Fit, noise: Noise
) -> tuple[Fit, Noise]:
    """Drop additions that explain less than what is still missing: they may only imitate it."""
    left = engine.lack_of_fit_test(present, noise)
    missing = float(np.sum(np.maximum(left.excess_power, 0.0)[left.rejected]))
    doubtful = present
    for index in reversed(range(engine.n_initial_terms, len(present.hypothesis.terms))):
        without = engine.refit(present.hypothesis.without(index), noise)
        if without.chi_square - present.chi_square < missing:
            doubtful = engine.refit(doubtful.hypothesis.without(index), noise)
    return (
        (present, noise)
        if doubtful is present
        else engine.fit_with_noise(doubtful.hypothesis, noise)
    )


def _backward_elimination(engine: SelectionEngine, present: Fit, noise: Noise) -> Fit:
    for index in reversed(range(engine.n_initial_terms, len(present.hypothesis.terms))):
        without = engine.refit(present.hypothesis.without(index), noise)
        if engine.criterion(without) < engine.criterion(present):
            present = without
    return present

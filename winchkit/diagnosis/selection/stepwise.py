"""Stepwise selection of effects: forward selection, backward elimination, pairs.

Each step takes the candidate with the best criterion among the five with the largest scores, if
it is accepted by cross-validation; the larger model is refitted, and effects are dropped where the
criterion decreases without them.

References
----------
Efroymson, M. A. (1960). Multiple regression analysis. In: Mathematical Methods for Digital
Computers. Wiley.
Miller, A. (2002). Subset Selection in Regression, 2nd ed. Chapman & Hall.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import dropwhile

import numpy as np

from winchkit.diagnosis.regression.conditioning import COLLINEAR_DELAY, collinearity
from winchkit.diagnosis.regression.cross_validation import excess, held_out_rms
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.lack_of_fit import LackOfFitTest
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.selection.acceptance import best_accepted, is_accepted, spoils
from winchkit.diagnosis.selection.engine import FittedCandidate, SelectionEngine
from winchkit.diagnosis.selection.exchange import cancels, pair_exchange
from winchkit.diagnosis.selection.scores import Score, null_maxima

_SHORT_LIST = 5
"""Candidates that are fitted per step; computing cost; measured: the accepted
candidate was the first by score in 15 of 17 steps, else the second."""
_RECONSIDERED = 3
"""Rounds of backward elimination and exchange per step; computing cost, rule of thumb."""
_EXCHANGED = 2
"""Largest number of additions of which one may be exchanged for a pair."""
_PAIRS = 3
"""Pairs that are fitted; computing cost, rule of thumb."""
_REST = 0.01
"""Share of the excess before, in the outputs of an addition, that counts as the rest of the others;
rule of thumb: a tenth of what the verdict ``explained`` leaves."""
_REST_ERROR = 1.6
"""The same for the largest error there, in units of the noise; screened: a rest of 1.56 was
imitated, presliding of EMPS that predicts another file better stands in one of 1.77."""
_LEFT_OF_REST = 0.5
"""What an addition may leave of such a rest, over what it explains of it; screened: effects that
were there left up to 0.43, imitations at least 0.82."""
_ACCURACY, _LEFT_BESIDE = 1e-3, 2.0
"""The same two for errors of any size: a law is accurate to some 3 % of what it changes, but
several other effects may be there: friction and viscosity beside a weight."""
_LACK_OF_FIT_LEVEL = 0.02
"""Level of the lack-of-fit test after Bonferroni; convention."""
_SCORE_LEVEL = 0.99
"""Quantile of the simulated null maximum; convention."""


@dataclass(frozen=True)
class SelectionResult:
    """Initial and final model of a stepwise selection, with their noise and lack-of-fit tests.

    ``scores`` and ``tried`` (the first candidates, fitted) are beside the initial model, best
    first; nothing is tried without a lack of fit. Noise alone exceeds ``threshold`` in 1 % of
    cases.
    """

    initial_model: Fit
    initial_noise: BandNoise
    lack_of_fit_at_start: bool
    final: Fit
    noise: BandNoise
    lack_of_fit_test: LackOfFitTest
    scores: tuple[Score, ...]
    tried: tuple[Fit, ...]
    threshold: float


def stepwise_selection(
    engine: SelectionEngine, known: Callable[[SelectionResult], None] = lambda result: None
) -> SelectionResult:
    """Select effects for a model as long as it has a lack of fit and candidates are accepted."""
    first = initial_result(engine)
    lacking = _has_lack_of_fit(first.lack_of_fit_test, list(first.scores), first.threshold)
    start = replace(first, lack_of_fit_at_start=lacking)
    known(start)
    initial, scores, threshold = (start.final, start.noise), list(start.scores), start.threshold
    final, noise, tried = _forward_selection(engine, *initial, scores, threshold)
    grew = len(final.hypothesis.terms) > engine.n_initial_terms
    lack_of_fit_at_start = grew or lacking
    if lack_of_fit_at_start and not tried:
        tried = _fits(_short_list(engine, *initial, scores))
    return replace(
        start,
        lack_of_fit_at_start=lack_of_fit_at_start,
        final=final,
        noise=noise,
        lack_of_fit_test=engine.lack_of_fit_test(final, noise),
        tried=tried if lack_of_fit_at_start else (),
    )


def initial_result(engine: SelectionEngine) -> SelectionResult:
    """Result of the initial model without a search, for data that must not be explained."""
    initial_model, initial_noise = engine.fit_with_noise(engine.initial_model)
    return SelectionResult(
        initial_model=initial_model,
        initial_noise=initial_noise,
        lack_of_fit_at_start=True,
        final=initial_model,
        noise=initial_noise,
        lack_of_fit_test=engine.lack_of_fit_test(initial_model, initial_noise),
        scores=tuple(engine.scores(initial_model, initial_noise)),
        tried=(),
        threshold=_threshold(engine, initial_model, initial_noise),
    )


def _forward_selection(
    engine: SelectionEngine, present: Fit, noise: BandNoise, scores: list[Score], threshold: float
) -> tuple[Fit, BandNoise, tuple[Fit, ...]]:
    """Model with all accepted effects, its noise, and the fits of the first candidates."""
    tried: tuple[Fit, ...] = ()
    initial = present
    seen: set[tuple[str, ...]] = set()
    while present.labels not in seen:
        seen.add(present.labels)
        larger = None
        # Where the noise is hardly known, it gives large scores to what acts there alone.
        if scores := list(dropwhile(lambda item: not item.is_significant(threshold), scores)):
            trials = _short_list(engine, present, noise, scores)
            larger = best_accepted(engine, present, noise, trials)
            if larger is None and any(trial.fit.abandoned for trial in trials):
                trials = _short_list(engine, present, noise, scores, complete=True)
                larger = best_accepted(engine, present, noise, trials)
            tried = tried or _fits(trials)
        larger = larger or _best_pair(engine, present, noise)
        if larger is None or _imitates_rest(engine, initial, present, larger, noise):
            break
        engine.update_signatures(larger.hypothesis)
        present, noise = engine.fit_with_noise(larger.hypothesis, noise)
        present, noise = _exchange_and_eliminate(engine, present, noise)
        if engine.on_step(present, noise):
            break
        scores = engine.scores(present, noise)
    return present, noise, tried


def _imitates_rest(
    engine: SelectionEngine, initial: Fit, present: Fit, larger: Fit, noise: BandNoise
) -> bool:
    """Whether a larger model's addition imitates what the laws of the present effects leave.

    Where they leave a hundredth of the excess and errors of the size of the noise, the addition has
    to explain two thirds of it; where they leave a thousandth, a third.
    """
    added = [t.effect for t in larger.hypothesis.terms if t.label not in present.labels]
    own = set().union(*(engine.regression.outputs_of(effect.stage) for effect in added))
    folds = engine.folds(present, noise)
    errors = [
        held_out_rms(engine.regression, fitted, noise, folds)
        for fitted in (initial, present, larger)
    ]
    before, left, after = (excess({o: e[o] for o in own}, noise.rms) for e in errors)
    is_noise = all(errors[1][output] <= _REST_ERROR * noise.rms[output] for output in own)
    rest, least = (_REST, _LEFT_OF_REST) if is_noise else (_ACCURACY, _LEFT_BESIDE)
    return left <= rest * before and after > least * (left - after)


def with_delays(engine: SelectionEngine, present: Fit, noise: BandNoise) -> tuple[Fit, BandNoise]:
    """The model with delays where they are accepted and its effects do not imitate them."""
    engine.delays_wait = False
    while True:
        delays = [s for s in engine.scores(present, noise) if s.candidate.effect.is_delay]
        trials = [engine.trial(present, item, noise) for item in delays if item.net_gain > 0]
        larger = best_accepted(engine, present, noise, trials)
        last = len(present.hypothesis.terms)
        if larger is None or collinearity(engine.regression, larger, noise, last) > COLLINEAR_DELAY:
            return present, noise
        present, noise = engine.fit_with_noise(larger.hypothesis, noise)


def _threshold(engine: SelectionEngine, present: Fit, noise: BandNoise) -> float:
    """Largest score that noise alone exceeds in 1 % of cases."""
    chance = null_maxima(engine.projected(present, noise), engine.regression.n_observations)
    return max(0.0, float(np.quantile(chance, _SCORE_LEVEL)))


def _has_lack_of_fit(
    lack_of_fit_test: LackOfFitTest, scores: list[Score], threshold: float
) -> bool:
    """Whether a residual exceeds the noise: by the lack-of-fit test or, without repeats, by the
    largest of the candidates' scores.
    """
    if np.isfinite(lack_of_fit_test.p_value):
        return lack_of_fit_test.p_value < _LACK_OF_FIT_LEVEL
    return any(item.is_significant(threshold) for item in scores)


def _short_list(
    engine: SelectionEngine,
    present: Fit,
    noise: BandNoise,
    scores: list[Score],
    *,
    complete: bool = False,
) -> list[FittedCandidate]:
    """Trials of the five candidates with the largest scores, in their order; unless ``complete``, a
    trial is abandoned where the best one before is out of reach.
    """
    trials: list[FittedCandidate] = []
    for item in [item for item in scores if item.net_gain > 0][:_SHORT_LIST]:
        best = min((trial.fit.chi_square for trial in trials), default=None)
        trials.append(engine.trial(present, item, noise, target=None if complete else best))
    return trials


def _best_pair(engine: SelectionEngine, present: Fit, noise: BandNoise) -> Fit | None:
    """Best accepted pair where the model has a lack of fit and no single candidate is accepted.

    A pair replaces one of the first additions, or is added in outputs without an addition: pairs
    beside additions there would be combined to fit an unknown effect.
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
    # Either may also fail alone because it is wrong where the other acts (one-way friction).
    best = [pair for pair in pairs if pair.suppressed][:_PAIRS]
    best += [pair for pair in pairs[:_PAIRS] if not pair.suppressed]
    trials = []
    for pair in best:
        first, second = pair.scores
        with_first = engine.trial(present, first, noise, aim=present.chi_square - pair.explained_ss)
        trials.append(engine.trial(with_first.fit, second, noise))
    trials = [trial for trial in trials if not cancels(engine, trial.fit)]
    return best_accepted(engine, present, noise, trials)


def _acts_on_unexplained_output(engine: SelectionEngine, present: Fit, noise: BandNoise) -> bool:
    """Whether an addition acts on an output that has a lack of fit."""
    regression = engine.regression
    rejected = np.flatnonzero(engine.lack_of_fit_test(present, noise).rejected).tolist()
    lacking = {regression.bands[band][0] for band in rejected}
    added = present.hypothesis.terms[engine.n_initial_terms :]
    return any(regression.outputs_of(term.effect.stage) & lacking for term in added)


def _accepted_pair_exchange(
    engine: SelectionEngine, present: Fit, noise: BandNoise, against: Fit
) -> Fit | None:
    """A pair in place of one addition that is accepted against another fit; else None. No error has
    to fall: with a lack of fit one effect may nearly replace two.
    """
    better = pair_exchange(engine, present, noise, 1)
    if better is present or not is_accepted(engine, against, better, noise, largest_ratio=1.0):
        return None
    return better


def _fits(trials: list[FittedCandidate]) -> tuple[Fit, ...]:
    return tuple(trial.fit for trial in trials)


def _exchange_and_eliminate(
    engine: SelectionEngine, present: Fit, noise: BandNoise
) -> tuple[Fit, BandNoise]:
    """Exchange and eliminate effects until the model does not change: the first of two may have
    explained both.
    """
    for _ in range(_RECONSIDERED):
        before = present.labels
        present = _backward_elimination(engine, present, noise)
        exchanged = pair_exchange(engine, present, noise, 2)
        if exchanged is not present and not spoils(engine, present, exchanged, noise):
            present = exchanged
        present = _backward_elimination(engine, present, noise)
        if present.labels == before or len(present.hypothesis.terms) < engine.n_initial_terms + 2:
            break
    return engine.fit_with_noise(present.hypothesis, noise)


def _backward_elimination(engine: SelectionEngine, present: Fit, noise: BandNoise) -> Fit:
    """Model without the additions whose removal decreases the criterion."""
    for index in reversed(range(engine.n_initial_terms, len(present.hypothesis.terms))):
        without = _without(engine, present, noise, index)
        if engine.criterion(without) < engine.criterion(present):
            present = without
    return present


def _without(engine: SelectionEngine, present: Fit, noise: BandNoise, index: int) -> Fit:
    """The model without one addition, fitted as far as its criterion can be the smaller one."""
    hypothesis = present.hypothesis.without(index)
    aim = engine.criterion(present) - engine.penalty(hypothesis)
    return engine.refit(hypothesis, noise, aim)

"""Exchange step: one or two effects of a model replaced by rivals, everything refitted."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from itertools import combinations

import numpy as np

from winchkit.diagnosis.regression.conditioning import CANCELLED, ranges_of_changes
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.acceptance import MIN_GAIN
from winchkit.diagnosis.selection.engine import FittedCandidate, SelectionEngine
from winchkit.diagnosis.selection.scores import Score
from winchkit.effects.transition import TRANSITION, with_transitions

_MARGIN = 0.1
"""Share of the term's explained χ² by which the linear prediction may miss the target."""


class RivalPlace:
    """A place in the model for rivals of one effect; ``base`` and the scores are without the
    effect.

    In ``base`` the others compensate for the effect, for instance a creep with a shorter time
    constant for a wrong ratio. A rival fitted from there may end in a local minimum, so that it is
    also started from the others' values in the present model. A rival with a friction turns around
    over the same rate as the effect.
    """

    def __init__(self, engine: SelectionEngine, present: Fit, noise: BandNoise, index: int) -> None:
        self._engine, self._noise = engine, noise
        self.own = present.hypothesis.terms[index]
        self._others = present.hypothesis.without(index)
        self.base = engine.refit(self._others, noise)
        self.scores = engine.scores(self.base, noise)

    @cached_property
    def _held(self) -> tuple[Fit, float, dict[str, Score]]:
        """The others at their present values, the least χ² near there, and the scores."""
        held = self._engine.fixed(self._others, self._noise)
        inverse_sigma = self._noise.inverse_sigma(self._engine.regression)
        whitened, residual = held.jacobian * inverse_sigma[:, None], held.residual * inverse_sigma
        basis = orthonormal(whitened)
        least = held.chi_square - float(np.sum((basis.T @ residual) ** 2))
        scores = self._engine.scores(held, self._noise)
        return held, least, {item.candidate.effect.id: item for item in scores}

    def trial(self, rival: Score, target: float, least: float, aim: float) -> FittedCandidate:
        """Fit a rival in the effect's place, again from the others' present values where its χ² is
        above ``target`` and would nearly reach it by linear prediction.

        A fit ends where ``aim``, ``target`` at least, is out of reach. It is abandoned where even
        the larger χ² ``least`` is.
        """
        rival = self._turning_alike(rival)
        first_trial = self._engine.trial(self.base, rival, self._noise, target=least, aim=aim)
        if first_trial.fit.chi_square < target or not self._others.terms:
            return first_trial
        held, least_held, scores = self._held
        rival_beside = scores.get(rival.candidate.effect.id)
        limit = target + _MARGIN * (self.base.chi_square - target)
        if rival_beside is None or least_held - rival_beside.explained_ss > limit:
            return first_trial
        beside = self._turning_alike(rival_beside)
        second_trial = self._engine.trial(held, beside, self._noise, target=least, aim=aim)
        return min(
            first_trial, second_trial, key=lambda trial: (trial.criterion, trial.fit.chi_square)
        )

    def _turning_alike(self, rival: Score) -> Score:
        """The rival with the effect's transition, fitted since the catalogue's was found."""
        known = {
            p.unit: self.own.values[TRANSITION]
            for p in self.own.effect.parameters
            if p.name == TRANSITION
        }
        effect = with_transitions(rival.candidate.effect, known)
        return replace(rival, candidate=replace(rival.candidate, effect=effect))


_MOST_TRIALS = 2
"""Pairs that are fitted in an exchange; computing cost, rule of thumb."""
_MOST_ADDITIONS = 3
"""Additions beyond which no exchange is tried; computing cost, rule of thumb."""


def pair_exchange(engine: SelectionEngine, present: Fit, noise: BandNoise, exchanged: int) -> Fit:
    """The present fit, or the best with a pair in place of one or two (``exchanged``) additions."""
    added = range(engine.n_initial_terms, len(present.hypothesis.terms))
    if not 0 < len(added) <= _MOST_ADDITIONS:
        return present  # More than three additions are not replaced by a pair.
    # The number of trials is limited, since every one refits the whole model.
    tried = _MOST_TRIALS if exchanged > 1 else max(1, _MOST_TRIALS // len(added))
    exchanges = [
        _better(engine, present, noise, own, tried) for own in combinations(added, exchanged)
    ]
    better = [fitted for fitted in exchanges if fitted is not None]
    return min(better, key=engine.criterion, default=present)


def _better(
    engine: SelectionEngine, present: Fit, noise: BandNoise, indices: tuple[int, ...], tried: int
) -> Fit | None:
    """Fit with a pair in place of the terms at ``indices``; None without a lower criterion."""
    hypothesis = present.hypothesis
    for index in reversed(indices):
        hypothesis = hypothesis.without(index)
    base = engine.refit(hypothesis, noise)
    required = engine.criterion(base) - engine.criterion(present) + MIN_GAIN
    removed = {present.hypothesis.terms[index].effect.id for index in indices}
    candidates = [
        pair
        for pair in engine.pairs(base, noise)
        if pair.net_gain > required and pair.ids != removed
    ]
    for pair in candidates[:tried]:
        # New effects first: one that explained both would keep its old values.
        first, second = sorted(pair.scores, key=lambda item: item.candidate.effect.id in removed)
        goal = present.chi_square
        with_first = engine.trial(base, first, noise, aim=goal).fit
        trial = engine.trial(with_first, second, noise, target=goal)
        if trial.criterion < engine.criterion(present) - MIN_GAIN and not cancels(
            engine, trial.fit
        ):
            return trial.fit
    return None


def cancels(engine: SelectionEngine, pair: Fit) -> bool:
    """Whether the second effect of a pair is cancelled but for a fifth: what is left is no law of
    either.
    """
    regression, last = engine.regression, len(pair.hypothesis.terms) - 1
    if not isinstance(regression, TimeSeriesRegression):
        return False
    ranges = ranges_of_changes(regression, pair, last)
    return any(own > CANCELLED * together for own, together in ranges.values())

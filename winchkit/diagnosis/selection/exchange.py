"""One term of a fit given up for a rival, all refitted."""

from __future__ import annotations

from functools import cached_property
from itertools import combinations

import numpy as np

from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.selection.acceptance import MIN_GAIN
from winchkit.diagnosis.selection.engine import SelectionEngine, Trial
from winchkit.diagnosis.selection.scores import Score

__all__ = [
    "Exchange",
    "pair_exchange",
]

_NEARLY = 0.1
"""Of what the term explains, as far as straight lines foretell."""


class Exchange:
    """The place of one term, beside all others of a fit.

    Without it the others settle elsewhere to make up for it: a creep becomes slow and soft in
    place of a wrong ratio. A rival begun from there may never come back, so it is begun from
    where the others stood beside the term as well.
    """

    def __init__(self, engine: SelectionEngine, present: Fit, noise: Noise, index: int) -> None:
        self._engine, self._noise = engine, noise
        self.own = present.hypothesis.terms[index]
        self._others = present.hypothesis.without(index)
        self.base = engine.refit(self._others, noise)
        """Without the term, refitted."""
        self.scores = engine.scores(self.base, noise)
        """Of all candidates beside that."""

    @cached_property
    def _held(self) -> tuple[Fit, float, dict[str, Score]]:
        """The others as they stand beside the term; the least squares about there; the scores."""
        held = self._engine.fixed(self._others, self._noise)
        inverse_sigma = self._noise.inverse_sigma(self._engine.regression)
        whitened, residual = held.jacobian * inverse_sigma[:, None], held.residual * inverse_sigma
        basis = orthonormal(whitened)
        least = held.chi_square - float(np.sum((basis.T @ residual) ** 2))
        scores = self._engine.scores(held, self._noise)
        return held, least, {item.candidate.effect.id: item for item in scores}

    def trial(self, rival: Score, enough: float) -> Trial:
        """A rival in the term's place.

        It is begun anew where its squares do not fall to ``enough``, yet nearly would beside the
        others as they stand.
        """
        found = self._engine.trial(self.base, rival, self._noise)
        if found.fit.chi_square < enough or not self._others.terms:
            return found
        held, least, scores = self._held
        beside = scores.get(rival.candidate.effect.id)
        nearly = enough + _NEARLY * (self.base.chi_square - enough)
        if beside is None or least - beside.explained_ss > nearly:
            return found
        again = self._engine.trial(held, beside, self._noise)
        return min(found, again, key=lambda trial: (trial.criterion, trial.fit.chi_square))


_TRIED = 2
_MOST = 3


def pair_exchange(engine: SelectionEngine, present: Fit, noise: Noise, exchanged: int) -> Fit:
    """The present fit, or the best with a better pair in the place of ``exchanged`` additions."""
    added = range(engine.n_initial_terms, len(present.hypothesis.terms))
    if not 0 < len(added) <= _MOST:
        return present  # So many stand for something that no pair is.
    # An exchange for more than was there is dear to try: as often, whatever may be exchanged.
    tried = _TRIED if exchanged > 1 else max(1, _TRIED // len(added))
    exchanges = [
        _better(engine, present, noise, own, tried) for own in combinations(added, exchanged)
    ]
    better = [fitted for fitted in exchanges if fitted is not None]
    return min(better, key=engine.criterion, default=present)


def _better(
    engine: SelectionEngine, present: Fit, noise: Noise, indices: tuple[int, ...], tried: int
) -> Fit | None:
    """A fit with a pair that pays more than the terms at ``indices`` do; None where none does."""
    hypothesis = present.hypothesis
    for index in reversed(indices):
        hypothesis = hypothesis.without(index)
    base = engine.refit(hypothesis, noise)
    pays = engine.criterion(base) - engine.criterion(present) + MIN_GAIN
    leave = {present.hypothesis.terms[index].effect.id for index in indices}
    promising = [
        pair for pair in engine.pairs(base, noise) if pair.net_gain > pays and pair.ids != leave
    ]
    for pair in promising[:tried]:
        # Newcomers first: what stood for both alone would keep the values that it had.
        first, second = sorted(pair.scores, key=lambda item: item.candidate.effect.id in leave)
        trial = engine.trial(engine.trial(base, first, noise).fit, second, noise)
        if trial.criterion < engine.criterion(present) - MIN_GAIN:
            return trial.fit
    return None

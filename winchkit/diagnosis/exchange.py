"""One term of a fit given up for a rival, all refitted."""

from __future__ import annotations

from functools import cached_property

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.inquiry import Inquiry, Trial
from winchkit.diagnosis.noise import Noise
from winchkit.diagnosis.score import Score

__all__ = ["Exchange"]


class Exchange:
    """The place of one term, beside all others of a fit.

    Without it the others settle elsewhere to make up for it: a creep becomes slow and soft in
    place of a wrong ratio. A rival begun from there may never come back, so it is begun from
    where the others stood beside the term as well.
    """

    def __init__(self, inquiry: Inquiry, present: Fit, noise: Noise, index: int) -> None:
        self._inquiry, self._present, self._noise = inquiry, present, noise
        self.own = present.hypothesis.terms[index]
        self._others = present.hypothesis.without(index)
        self.base = inquiry.refit(self._others, noise)
        """Without the term, refitted."""
        self.scores = inquiry.scores(self.base, noise)
        """Of all candidates beside that."""

    @cached_property
    def _held(self) -> tuple[Fit, dict[str, Score]]:
        """The others as they stand beside the term, and what scores beside them."""
        held = self._inquiry.held(self._others, self._noise)
        return held, {s.atom.effect.id: s for s in self._inquiry.scores(held, self._noise)}

    def trial(self, rival: Score, enough: float) -> Trial:
        """A rival in the term's place; begun anew unless its squares fall to ``enough``."""
        found = self._inquiry.trial(self.base, rival, self._noise)
        if found.fit.cost < enough or not self._others.terms:
            return found
        held, scores = self._held
        if rival.atom.effect.id not in scores:
            return found
        again = self._inquiry.trial(held, scores[rival.atom.effect.id], self._noise)
        return min(found, again, key=lambda trial: (trial.criterion, trial.fit.cost))

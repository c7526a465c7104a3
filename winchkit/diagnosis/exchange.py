"""One term of a fit given up for a rival, all refitted."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.inquiry import Inquiry, Trial
from winchkit.diagnosis.noise import Noise, orthonormal
from winchkit.diagnosis.score import Score

__all__ = ["Exchange"]

_NEARLY = 0.1
"""Of what the term explains, as far as straight lines foretell."""


class Exchange:
    """The place of one term, beside all others of a fit.

    Without it the others settle elsewhere to make up for it: a creep becomes slow and soft in
    place of a wrong ratio. A rival begun from there may never come back, so it is begun from
    where the others stood beside the term as well.
    """

    def __init__(self, inquiry: Inquiry, present: Fit, noise: Noise, index: int) -> None:
        self._inquiry, self._noise = inquiry, noise
        self.own = present.hypothesis.terms[index]
        self._others = present.hypothesis.without(index)
        self.base = inquiry.refit(self._others, noise)
        """Without the term, refitted."""
        self.scores = inquiry.scores(self.base, noise)
        """Of all candidates beside that."""

    @cached_property
    def _held(self) -> tuple[Fit, float, dict[str, Score]]:
        """The others as they stand beside the term; the least squares about there; the scores."""
        held = self._inquiry.held(self._others, self._noise)
        weight = self._noise.weight(self._inquiry.problem)
        whitened, residual = held.jacobian * weight[:, None], held.residual * weight
        basis = orthonormal(whitened)
        least = held.cost - float(np.sum((basis.T @ residual) ** 2))
        scores = self._inquiry.scores(held, self._noise)
        return held, least, {item.atom.effect.id: item for item in scores}

    def trial(self, rival: Score, enough: float) -> Trial:
        """A rival in the term's place.

        It is begun anew where its squares do not fall to ``enough``, yet nearly would beside the
        others as they stand.
        """
        found = self._inquiry.trial(self.base, rival, self._noise)
        if found.fit.cost < enough or not self._others.terms:
            return found
        held, least, scores = self._held
        beside = scores.get(rival.atom.effect.id)
        nearly = enough + _NEARLY * (self.base.cost - enough)
        if beside is None or least - beside.gain > nearly:
            return found
        again = self._inquiry.trial(held, beside, self._noise)
        return min(found, again, key=lambda trial: (trial.criterion, trial.fit.cost))

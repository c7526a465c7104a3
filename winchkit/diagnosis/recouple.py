"""Two effects in exchange for one or two that the search took first.

Taken one at a time, the first of two effects may be one that stands for a part of both; the second
then makes up for it, and neither is there. A pair that explains more is found side by side.
"""

from __future__ import annotations

from itertools import combinations

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.holding import BETTER
from winchkit.diagnosis.inquiry import Inquiry
from winchkit.diagnosis.noise import Noise

__all__ = ["recoupled"]

_TRIED = 2
_MOST = 3


def recoupled(inquiry: Inquiry, present: Fit, noise: Noise, exchanged: int) -> Fit:
    """The present fit, or the best with a better pair in the place of ``exchanged`` additions."""
    added = range(inquiry.given, len(present.hypothesis.terms))
    if not 0 < len(added) <= _MOST:
        return present  # So many stand for something that no pair is.
    # An exchange for more than was there is dear to try: as often, whatever may be exchanged.
    tried = _TRIED if exchanged > 1 else max(1, _TRIED // len(added))
    exchanges = [
        _better(inquiry, present, noise, own, tried) for own in combinations(added, exchanged)
    ]
    better = [fitted for fitted in exchanges if fitted is not None]
    return min(better, key=inquiry.criterion, default=present)


def _better(
    inquiry: Inquiry, present: Fit, noise: Noise, indices: tuple[int, ...], tried: int
) -> Fit | None:
    """A fit with a pair that pays more than the terms at ``indices`` do; None where none does."""
    hypothesis = present.hypothesis
    for index in reversed(indices):
        hypothesis = hypothesis.without(index)
    base = inquiry.refit(hypothesis, noise)
    pays = inquiry.criterion(base) - inquiry.criterion(present) + BETTER
    leave = {present.hypothesis.terms[index].effect.id for index in indices}
    promising = [
        pair for pair in inquiry.couples(base, noise) if pair.pays > pays and pair.ids != leave
    ]
    for pair in promising[:tried]:
        # Newcomers first: what stood for both alone would keep the values that it had.
        first, second = sorted(pair.scores, key=lambda item: item.atom.effect.id in leave)
        trial = inquiry.trial(inquiry.trial(base, first, noise).fit, second, noise)
        if trial.criterion < inquiry.criterion(present) - BETTER:
            return trial.fit
    return None

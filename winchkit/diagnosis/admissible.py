"""Which candidates may be tried beside a hypothesis at all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from winchkit.diagnosis.hypothesis import Hypothesis
from winchkit.diagnosis.score import Score, worthless
from winchkit.diagnosis.shapes import starting_values
from winchkit.effects.coordinates import Coordinates
from winchkit.effects.effect import Effect

__all__ = ["admissible", "best_of_each"]


def admissible(ranked: Iterable[Score], present: Hypothesis, rows: int) -> list[Score]:
    """Candidates that are not there yet, best first.

    What would help only with the wrong sign, such as an inertia below zero, gains nothing.
    """
    signed = [item if _possible(item) else worthless(item, rows) for item in ranked]
    signed.sort(key=lambda item: -item.value)
    return [item for item in signed if not _stands_there(item.atom.effect, item, present)]


def best_of_each(scores: Sequence[Score]) -> list[Score]:
    """The best point of each effect's grid, in the order in which they come."""
    first: dict[str, Score] = {}
    for item in scores:
        first.setdefault(item.atom.effect.id, item)
    return list(first.values())


def _stands_there(effect: Effect, item: Score, hypothesis: Hypothesis) -> bool:
    """Whether the effect, or one that contains it, is in the hypothesis already."""
    for term in hypothesis.terms:
        if effect.id in term.effect.contains:
            return True
        if term.effect.id == effect.id:
            orders = [p.name for p in effect.parameters if p.whole]
            if not effect.repeatable or all(
                term.values[name] == item.atom.shape.get(name) for name in orders
            ):
                return True
    return False


def _possible(item: Score) -> bool:
    """Whether the amplitudes that fit best are within an effect's bounds at all."""
    coordinates = Coordinates(item.atom.effect)
    if item.atom.effect.probes:
        return True
    base = {**item.atom.effect.null, **item.atom.shape}
    amplitudes = slice(len(coordinates.amplitudes))
    begun = coordinates.vector(starting_values(item)[0])[amplitudes]
    return bool(np.any(begun != coordinates.vector(base)[amplitudes]))

"""Candidates that may be added to a hypothesis: neither present nor infeasible."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.selection.scores import Score, zero_score
from winchkit.diagnosis.selection.starting_values import starting_values
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.series import orders_of


def admissible(ranked: Iterable[Score], present: Hypothesis, rows: int) -> list[Score]:
    """Scores of candidates that the model lacks; zero where all amplitudes are out of bounds."""
    signed = [item if _is_feasible(item) else zero_score(item, rows) for item in ranked]
    signed.sort(key=lambda item: -item.net_gain)
    return [item for item in signed if not _is_present(item.candidate.effect, item, present)]


def best_of_each(scores: Sequence[Score]) -> list[Score]:
    """Best point of each effect's shape grid, in the order of the scores."""
    first: dict[str, Score] = {}
    for item in scores:
        first.setdefault(item.candidate.effect.id, item)
    return list(first.values())


def _is_present(effect: Effect, item: Score, hypothesis: Hypothesis) -> bool:
    """Whether the hypothesis has the effect, one that contains it, or a delay of its output."""
    for term in hypothesis.terms:
        if effect.is_delay and term.effect.is_delay and effect.outputs == term.effect.outputs:
            return True
        if effect.id in term.effect.contains:
            return True
        if term.effect.id == effect.id and (
            not effect.repeatable or item.candidate.shape.get("order") in orders_of(term)
        ):
            return True
    return False


def _is_feasible(item: Score) -> bool:
    """Whether the best amplitudes of an effect are within its bounds, at least in part."""
    coordinates = Coordinates(item.candidate.effect)
    if item.candidate.effect.probes:
        return True
    base = {**item.candidate.effect.null, **item.candidate.shape}
    amplitudes = slice(len(coordinates.amplitudes))
    start_values = coordinates.vector(starting_values(item)[0])[amplitudes]
    return bool(np.any(start_values != coordinates.vector(base)[amplitudes]))

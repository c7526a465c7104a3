"""Two effects that hide each other: neither helps alone, both together explain.

A wrong ratio and a rope wound under tension, say, change the length alike and may all but cancel:
taken one at a time neither would ever be added. Nor need the shapes that help most alone be those
that help together, so that every point of their grids is tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.projection import gains
from winchkit.diagnosis.selection.scores import Projected, Score

__all__ = ["Couple", "couples"]

_TOGETHER = 1.5
_UNIDENTIFIABLE = 1e-5


@dataclass(frozen=True)
class Couple:
    """Two candidates side by side."""

    scores: tuple[Score, Score]
    taken: float
    """Whitened squares."""
    pays: float
    """The same less the price of their degrees of freedom."""
    alone: float
    """Whitened squares that the two take one at a time, each at the best point of its grid."""

    @property
    def ids(self) -> set[str]:
        """Names of the two."""
        return {item.candidate.effect.id for item in self.scores}

    @property
    def hidden(self) -> bool:
        """Whether they take far more together than the one and the other."""
        return self.taken > _TOGETHER * self.alone


def couples(
    projected: Projected, residual: Array, scores: Sequence[Score], price: float
) -> list[Couple]:
    """Pairs of candidates that pay, best first, each at the best points of its two grids.

    ``scores`` are of all points; ``price`` is what a degree of freedom must save.
    """
    alone: dict[str, float] = {}
    for item in scores:
        alone[item.candidate.effect.id] = max(item.gain, alone.get(item.candidate.effect.id, 0.0))
    found: dict[frozenset[str], Couple] = {}
    pairs = _pairs(scores)
    for pair, taken in zip(pairs, _together(projected, residual, pairs), strict=True):
        first, second = (item.candidate.effect.id for item in pair)
        pays = taken - price * sum(item.candidate.freedom for item in pair)
        ids = frozenset((first, second))
        if pays > 0 and (ids not in found or pays > found[ids].pays):
            found[ids] = Couple(pair, taken, pays, alone[first] + alone[second])
    return sorted(found.values(), key=lambda couple: -couple.pays)


def _pairs(scores: Sequence[Score]) -> list[tuple[Score, Score]]:
    """Any two of different effects, neither of which is a case of the other."""
    return [
        (first, second)
        for first, second in combinations(scores, 2)
        if first.candidate.effect.id != second.candidate.effect.id
        and not first.candidate.effect.nested_with(second.candidate.effect)
    ]


def _together(
    projected: Projected, residual: Array, pairs: Sequence[tuple[Score, Score]]
) -> list[float]:
    """Whitened squares that each pair takes side by side; pairs of as many columns at once."""
    products = projected.products(residual)
    size = np.sqrt(np.maximum(np.diag(projected.inner), 1e-300))
    inner, products = projected.inner / np.outer(size, size), products / size
    columns = [np.r_[a.candidate.columns, b.candidate.columns] for a, b in pairs]
    counts = np.array([len(own) for own in columns], dtype=int)
    out = np.zeros(len(pairs))
    for count in np.unique(counts):
        alike = np.flatnonzero(counts == count)
        own = np.array([columns[index] for index in alike])
        out[alike] = gains(inner[own[:, :, None], own[:, None, :]], products[own], _UNIDENTIFIABLE)
    return list(map(float, out))

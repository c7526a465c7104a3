"""Two effects that hide each other: neither helps alone, both together explain.

A wrong ratio and a rope wound under tension, say, change the length alike and may all but cancel:
taken one at a time neither would ever be added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.gain import gain
from winchkit.diagnosis.signature import Atom, Projected, Score

__all__ = ["Couple", "couples"]

Array = NDArray[np.float64]
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

    @property
    def ids(self) -> set[str]:
        """Names of the two."""
        return {item.atom.effect.id for item in self.scores}

    @property
    def hidden(self) -> bool:
        """Whether they take far more together than the one and the other."""
        return self.taken > _TOGETHER * sum(item.gain for item in self.scores)


def couples(
    projected: Projected, residual: Array, scores: Sequence[Score], price: float
) -> list[Couple]:
    """Pairs of candidates that pay, best first; ``price`` is what a degree of freedom must save."""
    products = projected.products(residual)
    size = np.sqrt(np.maximum(np.diag(projected.inner), 1e-300))
    inner, products = projected.inner / np.outer(size, size), products / size
    found = []
    for first, second in combinations(scores, 2):
        one, other = first.atom, second.atom
        if one.effect.nested_with(other.effect):
            continue
        taken = _together(inner, products, one, other)
        pays = taken - price * (one.freedom + other.freedom)
        if pays > 0:
            found.append(Couple((first, second), taken, pays))
    return sorted(found, key=lambda couple: -couple.pays)


def _together(inner: Array, products: Array, one: Atom, other: Atom) -> float:
    """Whitened squares that two atoms take side by side."""
    columns = np.r_[one.columns, other.columns]
    return gain(inner[np.ix_(columns, columns)], products[columns], _UNIDENTIFIABLE)

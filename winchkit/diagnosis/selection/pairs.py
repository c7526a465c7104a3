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
from winchkit.diagnosis.regression.projection import explained_ss_of_sets
from winchkit.diagnosis.selection.scores import Projected, Score

__all__ = ["Pair", "screened_pairs"]

_TOGETHER = 1.5
_UNIDENTIFIABLE = 1e-5


@dataclass(frozen=True)
class Pair:
    """Two candidates side by side."""

    scores: tuple[Score, Score]
    explained_ss: float
    """Whitened squares."""
    net_gain: float
    """The same less the price of their degrees of freedom."""
    single_gain: float
    """Whitened squares that the two take one at a time, each at the best point of its grid."""

    @property
    def ids(self) -> set[str]:
        """Names of the two."""
        return {item.candidate.effect.id for item in self.scores}

    @property
    def suppressed(self) -> bool:
        """Whether they take far more together than the one and the other."""
        return self.explained_ss > _TOGETHER * self.single_gain


def screened_pairs(
    projected: Projected, residual: Array, scores: Sequence[Score], penalty_per_parameter: float
) -> list[Pair]:
    """Pairs of candidates that pay, best first, each at the best points of its two grids.

    ``scores`` are of all points; ``price`` is what a degree of freedom must save.
    """
    single_gain: dict[str, float] = {}
    for item in scores:
        single_gain[item.candidate.effect.id] = max(
            item.explained_ss, single_gain.get(item.candidate.effect.id, 0.0)
        )
    found: dict[frozenset[str], Pair] = {}
    pairs = _pairs(scores)
    for pair, explained_ss in zip(
        pairs, _joint_explained_ss(projected, residual, pairs), strict=True
    ):
        first, second = (item.candidate.effect.id for item in pair)
        net_gain = explained_ss - penalty_per_parameter * sum(
            item.candidate.n_parameters for item in pair
        )
        ids = frozenset((first, second))
        if net_gain > 0 and (ids not in found or net_gain > found[ids].net_gain):
            found[ids] = Pair(
                pair, explained_ss, net_gain, single_gain[first] + single_gain[second]
            )
    return sorted(found.values(), key=lambda couple: -couple.net_gain)


def _pairs(scores: Sequence[Score]) -> list[tuple[Score, Score]]:
    """Any two of different effects, neither of which is a case of the other."""
    return [
        (first, second)
        for first, second in combinations(scores, 2)
        if first.candidate.effect.id != second.candidate.effect.id
        and not first.candidate.effect.nested_with(second.candidate.effect)
    ]


def _joint_explained_ss(
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
        out[alike] = explained_ss_of_sets(
            inner[own[:, :, None], own[:, None, :]], products[own], _UNIDENTIFIABLE
        )
    return list(map(float, out))

"""Joint screening of pairs of candidates, for effects that mask each other (suppression).

A wrong ratio and a cable wound under tension, for example, change the length in opposite ways and
nearly cancel: neither is selected alone. All points of both shape grids are tried, since the best
shapes of a pair need not be the best ones alone.
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

_SUPPRESSION_RATIO = 1.5
_UNIDENTIFIABLE = 1e-5


@dataclass(frozen=True)
class Pair:
    """Two candidates fitted jointly.

    Attributes
    ----------
    scores : tuple of two Score
        Their scores one at a time.
    explained_ss : float
        Δχ² of both together.
    net_gain : float
        Explained sum of squares minus the penalty of their parameters.
    single_gain : float
        Sum of the explained sums of squares one at a time, each at its best grid point.
    """

    scores: tuple[Score, Score]
    explained_ss: float
    net_gain: float
    single_gain: float

    @property
    def ids(self) -> set[str]:
        """Names of the two effects."""
        return {item.candidate.effect.id for item in self.scores}

    @property
    def suppressed(self) -> bool:
        """Whether they explain jointly far more than one at a time."""
        return self.explained_ss > _SUPPRESSION_RATIO * self.single_gain


def screened_pairs(
    projected: Projected, residual: Array, scores: Sequence[Score], penalty_per_parameter: float
) -> list[Pair]:
    """Pairs of candidates with a positive net gain, best first, each at its best grid points.

    Parameters
    ----------
    projected
        Signatures with the unknowns partialled out.
    residual
        Measured minus predicted, shape (n_rows,).
    scores
        Scores of all candidates at all grid points.
    penalty_per_parameter
        ln n.
    """
    single_gain: dict[str, float] = {}
    for item in scores:
        single_gain[item.candidate.effect.id] = max(
            item.explained_ss, single_gain.get(item.candidate.effect.id, 0.0)
        )
    best: dict[frozenset[str], Pair] = {}
    pairs = _pairs(scores)
    for pair, explained_ss in zip(
        pairs, _joint_explained_ss(projected, residual, pairs), strict=True
    ):
        first, second = (item.candidate.effect.id for item in pair)
        net_gain = explained_ss - penalty_per_parameter * sum(
            item.candidate.n_parameters for item in pair
        )
        ids = frozenset((first, second))
        if net_gain > 0 and (ids not in best or net_gain > best[ids].net_gain):
            best[ids] = Pair(pair, explained_ss, net_gain, single_gain[first] + single_gain[second])
    return sorted(best.values(), key=lambda item: -item.net_gain)


def _pairs(scores: Sequence[Score]) -> list[tuple[Score, Score]]:
    """All pairs of different effects of which neither contains the other."""
    return [
        (first, second)
        for first, second in combinations(scores, 2)
        if first.candidate.effect.id != second.candidate.effect.id
        and not first.candidate.effect.nested_with(second.candidate.effect)
    ]


def _joint_explained_ss(
    projected: Projected, residual: Array, pairs: Sequence[tuple[Score, Score]]
) -> list[float]:
    """Explained sum of squares of every pair, pairs of equal size at once."""
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

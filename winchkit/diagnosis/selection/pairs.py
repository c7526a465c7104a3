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
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.projection import explained_ss_of_sets
from winchkit.diagnosis.selection.scores import Projected, Score

_SUPPRESSION_RATIO = 1.5
"""Joint over summed single explained χ² from which a pair counts as mutually masking; screened."""
_UNIDENTIFIABLE = 1e-5
"""Squared length left of a unit column below which a direction is not identifiable; numerical."""


@dataclass(frozen=True)
class Pair:
    """Two candidates fitted jointly; ``explained_ss`` is Δχ² of both, ``net_gain`` is less the
    penalty, ``single_gain`` is the sum of Δχ² of each alone at its best grid point.
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
    """Pairs of candidates with a positive net gain, best first, each at its best grid points."""
    single_gain: dict[str, float] = {}
    for item in scores:
        single_gain[item.candidate.effect.id] = max(
            item.explained_ss, single_gain.get(item.candidate.effect.id, 0.0)
        )
    first, second = _pairs(scores)
    explained_ss = _joint_explained_ss(projected, residual, scores, first, second)
    parameters = np.array([item.candidate.n_parameters for item in scores], dtype=int)
    net_gain = explained_ss - penalty_per_parameter * (parameters[first] + parameters[second])
    best: dict[frozenset[str], Pair] = {}
    for index in np.argsort(-net_gain, kind="stable").tolist():
        if not net_gain[index] > 0:
            break
        pair = scores[first[index]], scores[second[index]]
        ids = frozenset(item.candidate.effect.id for item in pair)
        if ids not in best:
            gain = sum(single_gain[name] for name in ids)
            best[ids] = Pair(pair, float(explained_ss[index]), float(net_gain[index]), gain)
    return list(best.values())


def _pairs(scores: Sequence[Score]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Places of all pairs of different effects of which neither contains the other."""
    effects = {item.candidate.effect.id: item.candidate.effect for item in scores}
    place = {name: index for index, name in enumerate(effects)}
    allowed = np.zeros((len(effects), len(effects)), dtype=bool)
    for (i, one), (j, other) in combinations(enumerate(effects.values()), 2):
        allowed[i, j] = allowed[j, i] = not one.nested_with(other)
    own = np.array([place[item.candidate.effect.id] for item in scores], dtype=np.intp)
    first, second = np.triu_indices(len(scores), 1)
    kept = allowed[own[first], own[second]]
    return first[kept], second[kept]


def _joint_explained_ss(
    projected: Projected,
    residual: Array,
    scores: Sequence[Score],
    first: NDArray[np.intp],
    second: NDArray[np.intp],
) -> Array:
    """Explained sum of squares of every pair, pairs of equal size at once."""
    products = projected.products(residual)
    size = np.sqrt(np.maximum(np.diag(projected.inner), 1e-300))
    inner, products = projected.inner / np.outer(size, size), products / size
    begins = np.array([item.candidate.columns.start for item in scores], dtype=np.intp)
    ends = np.array([item.candidate.columns.stop for item in scores], dtype=np.intp)
    counts = np.column_stack([(ends - begins)[first], (ends - begins)[second]])
    out = np.zeros(len(first))
    for one, other in np.unique(counts, axis=0).tolist():
        alike = np.flatnonzero((counts[:, 0] == one) & (counts[:, 1] == other))
        own = np.hstack(
            [
                begins[first[alike], None] + np.arange(one),
                begins[second[alike], None] + np.arange(other),
            ]
        )
        out[alike] = explained_ss_of_sets(
            inner[own[:, :, None], own[:, None, :]], products[own], _UNIDENTIFIABLE
        )
    return out

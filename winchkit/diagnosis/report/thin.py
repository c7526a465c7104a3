"""Long signals made short for drawing: the lowest and the highest of every stretch are kept."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["bin_means", "filled_edges", "thin", "thin_points"]

Array = NDArray[np.float64]
_FEW = 5


def thin(x: Array, series: Sequence[Array], points: int) -> tuple[Array, list[Array]]:
    """At most ``points`` samples of some signals over one x, every extreme kept.

    ``x`` and each signal are (n,); a stretch in which a signal is NaN throughout stays NaN. Within
    a stretch the extremes stand in their order, at the stretch's first and last x.
    """
    if len(x) <= points:
        return x, [np.asarray(values, dtype=float) for values in series]
    edges = np.linspace(0, len(x), points // 2 + 1).astype(int)
    at = np.column_stack([x[edges[:-1]], x[edges[1:] - 1]]).ravel()
    return at, [_extremes(np.asarray(values, dtype=float), edges) for values in series]


def _extremes(values: Array, edges: NDArray[np.intp]) -> Array:
    out = np.full((len(edges) - 1, 2), np.nan)
    for row, (first, last) in enumerate(pairwise(edges)):
        stretch = values[first:last]
        if np.isfinite(stretch).any():
            ends = sorted([int(np.nanargmin(stretch)), int(np.nanargmax(stretch))])
            out[row] = stretch[ends]
    return out.ravel()


def thin_points(x: Array, points: int) -> NDArray[np.intp]:
    """Indices of at most ``points`` samples, evenly through the recording, sorted by x."""
    step = max(1, -(-len(x) // points))
    chosen = np.arange(0, len(x), step)
    return np.asarray(chosen[np.argsort(x[chosen], kind="stable")])


def filled_edges(x: Array, bins: int) -> Array:
    """Inner edges of at most ``bins`` equally filled bins; between the values where they are few.

    x is (n,) and finite.
    """
    distinct = np.unique(x)
    if len(distinct) <= _FEW:
        return np.asarray((distinct[1:] + distinct[:-1]) / 2)
    return np.unique(np.quantile(x, np.linspace(0, 1, bins + 1)[1:-1]))


def bin_means(x: Array, values: Sequence[Array], edges: Array) -> tuple[Array, list[Array]]:
    """Mean x of every bin that holds samples and, per signal, its mean there.

    x and each signal are (n,) and finite, ``edges`` are inner and sorted.
    """
    index = np.searchsorted(edges, x, side="right")
    count = np.bincount(index)
    used = count > 0
    means = [np.bincount(index, weights=v)[used] / count[used] for v in (x, *values)]
    return means[0], means[1:]

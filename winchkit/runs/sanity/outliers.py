"""Outliers: single samples far from both neighbours, as transmission errors make them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.text import size

__all__ = ["outlier_mask", "outliers"]

_LIMIT = 10.0
"""Local standard deviations: beyond 8 in none of 10¹⁵ Gaussian samples, and room for tails."""
_AGREEMENT = 0.25
"""Largest range of the four neighbours, in deviations of the sample."""
_WINDOW = 50
_MAD = 0.6745


def outlier_mask(values: Array) -> NDArray[np.bool_]:
    """Samples that are spikes.

    Parameters
    ----------
    values : (n,) array
        NaN where there is no value.

    Returns
    -------
    (n,) array of bool

    Notes
    -----
    The deviation from the median of two neighbours on each side exceeds ten local standard
    deviations (of the deviations, by their median over 50 samples), and the neighbours agree within
    a quarter of it. A peak that lasts two samples, or a step, is none.
    """
    out = np.zeros(len(values), dtype=bool)
    rows = np.flatnonzero(np.isfinite(values))
    known = values[rows]
    if len(known) < _WINDOW:
        return out
    around = np.stack([known[:-4], known[1:-3], known[3:-1], known[4:]])
    deviation = np.abs(known[2:-2] - np.median(around, axis=0))
    agreement = np.ptp(around, axis=0)
    local = _local(deviation)
    # Neighbours that are equal in a quantised or held channel have a local deviation of zero.
    floor = float(np.sqrt(np.mean(np.minimum(deviation, np.quantile(deviation, 0.95)) ** 2)))
    far = deviation > _LIMIT * np.maximum(local, floor)
    out[rows[2:-2][far & (agreement < _AGREEMENT * deviation)]] = True
    return out


def outliers(run: Run, name: str) -> Iterator[Finding]:
    """Spikes of a channel; value: largest deviation."""
    values = run[name]
    spikes = outlier_mask(values)
    count = int(np.count_nonzero(spikes))
    if count == 0:
        return
    good = ~spikes & np.isfinite(values)
    between = np.interp(np.flatnonzero(spikes), np.flatnonzero(good), values[good])
    largest = float(np.max(np.abs(values[spikes] - between)))
    yield Finding(
        "outliers",
        run.name,
        name,
        largest,
        f"{count} of {len(values)} samples are spikes of up to "
        f"{size(largest, run.channels[name].unit)}; they are not compared",
    )


def _local(deviation: Array) -> Array:
    """Standard deviation from the median of the deviations in blocks, the larger of two blocks."""
    count = max(1, len(deviation) // _WINDOW)
    edges = np.linspace(0, len(deviation), count + 1).astype(int)
    medians = np.array([np.median(deviation[a:b]) for a, b in pairwise(edges)])
    wide = np.maximum(medians, np.maximum(np.append(medians[1:], 0), np.append(0, medians[:-1])))
    return np.repeat(wide / _MAD, np.diff(edges))

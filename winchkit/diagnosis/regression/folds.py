"""Partitions of runs for cross-validation: blocks of time, and groups of programme and load."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from winchkit.diagnosis.regression.base import Folds, Segment

_BLOCKS = 48
"""Blocks of time of all runs together; theory: a jackknife over n blocks has a relative standard
error of 1/√(2(n − 1)), 10 %."""


def time_blocks(
    segments: Sequence[Segment], samples: Sequence[int], wanted: int = _BLOCKS
) -> Folds:
    """Contiguous blocks of time of equal length within a run, at least two per run and about
    ``wanted`` of all runs, the same for all outputs."""
    total = sum(samples)
    first, starts, counts = 0, [], []
    for count in samples:
        share = max(2, round(wanted * count / total))
        starts.append(first)
        counts.append(share)
        first += share
    of = tuple(
        starts[s.run] + (np.arange(s.band.count) * counts[s.run]) // s.band.count for s in segments
    )
    return Folds(of, first)


def five_blocks(blocks: Folds) -> Folds:
    """Blocks of time merged to five contiguous ones."""
    return Folds(tuple((b * 5) // blocks.count for b in blocks.of), 5)


def group_folds(segments: Sequence[Segment], group_of_run: Sequence[int]) -> Folds | None:
    """One fold per group of runs; None for a single group."""
    count = len(set(group_of_run))
    if count < 2:
        return None
    of = tuple(np.full(s.band.count, group_of_run[s.run], dtype=np.intp) for s in segments)
    return Folds(of, count)

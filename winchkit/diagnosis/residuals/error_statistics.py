"""Residual and noise power in the transition band of the low-pass.

These coefficients are left out of fits, since the filter nearly removes them; the rms of a filtered
signal contains them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.compare import repeat_noise
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.spectrum import WHOLE_FILTER
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.time_series import Problem

__all__ = ["Skirt"]


class Skirt:
    """Mean squares above the cut-off, per output, SI."""

    def __init__(self, dataset: Dataset) -> None:
        """Take a data set whose fits leave these coefficients out."""
        self._dataset = dataset
        self._filtered = {
            output
            for recording in dataset.recordings
            for output, band in recording.bands.items()
            if band.cut_off is not None
        }

    def residual(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Mean square of the residual of a hypothesis."""
        if not self._filtered:
            return {}
        beyond = self._beyond(hypothesis)
        out = {}
        for output in self._filtered:
            own = [s for s in self._problem.segments if s.output == output]
            total = sum(float(beyond[s.rows] @ beyond[s.rows]) for s in own)
            out[output] = total / self._problem.samples(output)
        return out

    def noise(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Mean square of the differences of repeats; without repeats that of the residual."""
        if not self._filtered:
            return {}
        apart = repeat_noise(self._problem, self._beyond(hypothesis))
        return self.residual(hypothesis) | {o: apart[o] ** 2 for o in self._filtered & set(apart)}

    @cached_property
    def _problem(self) -> Problem:
        recordings = tuple(
            replace(r, bands={o: replace(b, skirt=WHOLE_FILTER) for o, b in r.bands.items()})
            for r in self._dataset.recordings
        )
        return Problem(replace(self._dataset, recordings=recordings))

    def _beyond(self, hypothesis: Hypothesis) -> Array:
        """Residual without the coefficients up to the cut-off, (rows,)."""
        rows = self._problem.residual(hypothesis)
        for segment in self._problem.segments:
            band = segment.band
            inside = band.cut_off is None or band.frequency <= band.cut_off
            rows[segment.rows] = np.where(inside, 0.0, rows[segment.rows])
        return rows

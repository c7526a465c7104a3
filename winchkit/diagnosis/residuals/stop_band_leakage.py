"""Residual and noise power in the transition band of the low-pass.

These coefficients are left out of fits, since the filter nearly removes them; the rms of a filtered
signal contains them.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import replicate_rms


class StopBandLeakage:
    """Mean squares above the cut-off, per output, SI."""

    def __init__(self, regression: Regression) -> None:
        """Take a data set whose fits leave these coefficients out."""
        self._filtered = {s.output for s in regression.segments if s.band.cut_off is not None}
        self._without_filter = regression.unfiltered

    def residual(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Mean square of the residual of a hypothesis."""
        if not self._filtered:
            return {}
        leakage = self._leakage(hypothesis)
        out = {}
        for output in self._filtered:
            own = [s for s in self._regression.segments if s.output == output]
            total = sum(float(leakage[s.rows] @ leakage[s.rows]) for s in own)
            out[output] = total / self._regression.n_samples(output)
        return out

    def noise(self, hypothesis: Hypothesis) -> dict[str, float]:
        """Mean square of the differences of repeats; without repeats that of the residual."""
        if not self._filtered:
            return {}
        noise_rms = replicate_rms(self._regression, self._leakage(hypothesis))
        return self.residual(hypothesis) | {
            o: noise_rms[o] ** 2 for o in self._filtered & set(noise_rms)
        }

    @cached_property
    def _regression(self) -> Regression:
        return self._without_filter()

    def _leakage(self, hypothesis: Hypothesis) -> Array:
        """Residual without the coefficients up to the cut-off, (rows,)."""
        rows = self._regression.residual(hypothesis)
        for segment in self._regression.segments:
            band = segment.band
            inside = band.cut_off is None or band.frequency <= band.cut_off
            rows[segment.rows] = np.where(inside, 0.0, rows[segment.rows])
        return rows

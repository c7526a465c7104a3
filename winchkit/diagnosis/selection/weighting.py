"""Choice of weights for runs without repeats: inverse noise variance, or equal.

Without repeats the noise variance is that of the residual beside all candidates. Where that is
noise, weights of 1/σ² are the best (Aitken 1935). Where equal weights predict held-out data better,
the residual contains a missing effect at the frequencies with a large variance, and 1/σ² would fit
the values to frequencies at which the error is small anyway.

References
----------
Aitken, A. C. (1935). On least squares and linear combination of observations. Proc. R. Soc. Edinb.
55, 42-48.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.cross_validation import held_out_rms
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.engine import SelectionEngine

_NO_WORSE = 1.01
"""Ratio of held-out errors that no output may exceed under equal weights; screened, decision 14."""


@dataclass(frozen=True)
class Reweighted:
    """A fit with the better weights, their noise, and a note where they are equal."""

    fit: Fit
    noise: BandNoise
    notes: tuple[str, ...] = ()


def reweighted(engine: SelectionEngine, fitted: Fit, noise: BandNoise) -> Reweighted:
    """The same hypothesis refitted with equal weights in outputs that these predict better than
    1/σ; their intervals are of the block jackknife, which does not assume white noise.
    """
    own = Reweighted(fitted, noise)
    if noise.from_repeats or not fitted.hypothesis.terms:
        return own
    regression, folds = engine.regression, engine.folds(fitted, noise)
    was = held_out_rms(regression, fitted, noise, folds)

    def evenly(outputs: Collection[str]) -> tuple[Fit, BandNoise, dict[str, float]]:
        even = _even(regression, noise, outputs)
        refitted = fit(regression, fitted.hypothesis, even.inverse_sigma(regression))
        now = held_out_rms(regression, refitted, even, folds)
        return refitted, even, {o: now[o] / was[o] for o in was if was[o]}

    refitted, even, ratios = evenly(regression.outputs)
    better = [output for output, ratio in ratios.items() if ratio < RELEVANT_RATIO]
    if not better:
        return own
    if len(better) < len(regression.outputs):
        refitted, even, ratios = evenly(better)
    gained = 1 - max(ratios[output] for output in better)
    if gained < 1 - RELEVANT_RATIO or max(ratios.values()) > _NO_WORSE:
        return own
    names = " and ".join(output.replace("_", " ") for output in better)
    note = (
        f"in the {names} all frequencies have the same weight: the error on held-out data is "
        f"{gained:.0%} smaller than with weights by the noise, so that an effect is missing there"
    )
    return Reweighted(refitted, even, (note,))


def _even(regression: Regression, noise: BandNoise, outputs: Collection[str]) -> BandNoise:
    """Noise with one variance per output for some outputs."""
    power = noise.power.copy()
    rows = np.bincount(regression.band_of_row, minlength=len(power))
    for output in outputs:
        own = np.array([band[0] == output for band in regression.bands])
        power[own] = np.average(power[own], weights=rows[own])
    return replace(noise, power=power)

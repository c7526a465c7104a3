"""How far each frequency is believed when values are told of runs that nobody repeated.

Without repeats the noise is what no effect explains. Where that is noise, weights of 1/σ are the
best (Aitken 1935): no others predict what was left out better, but by a trifle of chance. Where
even weights do, what is loud at some frequencies is no noise but what the model lacks there; by
1/σ the values would suit the quiet frequencies, where they hardly matter.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.cross_validation import held_out_rms
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.engine import SelectionEngine

__all__ = ["Reweighted", "reweighted"]

_NO_WORSE = 1.01


@dataclass(frozen=True)
class Reweighted:
    """A fit by the weights that predict best, the noise of these weights, and a note if need be."""

    fit: Fit
    noise: Noise
    notes: tuple[str, ...] = ()


def reweighted(engine: SelectionEngine, fitted: Fit, noise: Noise) -> Reweighted:
    """The same hypothesis with values from even weights in outputs that these predict better.

    Intervals under even weights are the block jackknife's, which needs no noise to be white.
    """
    own = Reweighted(fitted, noise)
    if noise.from_repeats or not fitted.hypothesis.terms:
        return own
    regression, folds = engine.regression, engine.folds(fitted, noise)
    was = held_out_rms(regression, fitted, noise, folds)

    def evenly(outputs: Collection[str]) -> tuple[Fit, Noise, dict[str, float]]:
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
    told = " and ".join(output.replace("_", " ") for output in better)
    note = (
        f"in the {told} all frequencies are weighed evenly, which predicts what was left out "
        f"{gained:.0%} better than weights by the noise: something is missing there too"
    )
    return Reweighted(refitted, even, (note,))


def _even(regression: Regression, noise: Noise, outputs: Collection[str]) -> Noise:
    """The same noise as if it were white in some outputs."""
    power = noise.power.copy()
    rows = np.bincount(regression.band_of_row, minlength=len(power))
    for output in outputs:
        own = np.array([band[0] == output for band in regression.bands])
        power[own] = np.average(power[own], weights=rows[own])
    return replace(noise, power=power)

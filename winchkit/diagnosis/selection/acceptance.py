"""Acceptance of an addition by cross-validation.

An addition is accepted where its held-out χ² decreases block by block (Wilcoxon signed-rank test)
or in every group of programme and load by more than the penalty, and where it decreases some
held-out error by at least 2 %. An error that it raises by more has to be outweighed ten times; one
that was noise stays noise.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from winchkit.diagnosis.regression.cross_validation import (
    AT_NOISE,
    CERTAIN,
    held_out,
    held_out_rms,
    signed_rank_p_value,
)
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.selection.engine import FittedCandidate, SelectionEngine
from winchkit.effects.parametrization import Coordinates

Fitted = tuple[SelectionEngine, Fit, BandNoise]
"""A fit with its noise and the engine that they are of."""

_LEVEL = 0.02
"""Level of the signed-rank test; convention."""
MIN_GAIN = 2.0
"""Minimum decrease of the criterion for a change of the model."""
_NO_WORSE = 1.02
"""Ratio of held-out errors that an output reaches only where the others outweigh it; screened."""
RELEVANT_RATIO = 0.98
"""Ratio of held-out errors after and before, below which an addition is relevant; screened."""


def best_accepted(
    engine: SelectionEngine, present: Fit, noise: BandNoise, trials: list[FittedCandidate]
) -> Fit | None:
    """Fit of the best trial that is accepted; None where none is.

    Of nested laws the simplest enters first that explains nine tenths as much: a richer one may
    imitate what another effect does, and takes its place later where it is needed.
    """
    before = engine.criterion(present)
    accepted = (
        trial
        for trial in sorted(trials, key=lambda t: t.criterion)
        if not trial.fit.abandoned
        and trial.criterion < before - MIN_GAIN
        and is_accepted(engine, present, trial.fit, noise)
    )
    best = next(accepted, None)
    if best is None:
        return None
    simpler = best.fit.hypothesis.terms[-1].effect.reduces_to
    enough = (1.0 - CERTAIN) * (present.chi_square - best.fit.chi_square)
    for trial in accepted:
        if (
            trial.fit.hypothesis.terms[-1].effect.id in simpler
            and present.chi_square - trial.fit.chi_square > enough
        ):
            return trial.fit
    return best.fit


def is_accepted(
    engine: SelectionEngine,
    present: Fit,
    larger: Fit,
    noise: BandNoise,
    largest_ratio: float = RELEVANT_RATIO,
) -> bool:
    """Whether a larger model predicts held-out data better, by blocks of time or in every group,
    and some output by ``largest_ratio`` (error after to before) at most.

    An effect that acts in few blocks has no significant signed ranks, so that it is also accepted
    where every held-out group gains more than ln n per parameter. The level of 2 % is not corrected
    for the number of candidates.
    """
    regression = engine.regression
    blocks = regression.blocks
    before = held_out(regression, present, noise, blocks)
    after = held_out(regression, larger, noise, blocks)
    groups = engine.folds(larger, noise)
    gain = held_out(regression, present, noise, groups) - held_out(
        regression, larger, noise, groups
    )
    gains_in_every_group = engine.grouped(groups) and bool(
        np.min(gain) > engine.penalty_per_parameter * _added(present, larger)
    )
    if np.sum(before - after) <= 0 or (
        signed_rank_p_value(before, after) > _LEVEL and not gains_in_every_group
    ):
        return False
    now, was = (held_out_rms(regression, fitted, noise, groups) for fitted in (larger, present))
    ratios = [now[output] / was[output] for output in was]
    # A significant but irrelevant effect, such as a clock offset of 1 ms, is not added.
    if np.sum(gain) <= 0 or min(ratios) >= largest_ratio:
        return False
    if max(ratios) < _NO_WORSE:
        return True
    if _passes_noise(was, now, noise):
        return False
    # What an effect raises that takes another's place belongs to that one.
    falls = [(was[o] ** 2 - now[o] ** 2) / noise.rms[o] ** 2 for o in was if noise.rms[o]]
    rise = -sum(fall for fall in falls if fall < 0.0)
    return {*present.labels} <= {*larger.labels} and rise < CERTAIN * (sum(falls) + rise)


def spoils(engine: SelectionEngine, present: Fit, other: Fit, noise: BandNoise) -> bool:
    """Whether a held-out error that is noise with one model is above it with another."""
    folds = engine.folds(other, noise)
    was, now = (
        held_out_rms(engine.regression, fitted, noise, folds) for fitted in (present, other)
    )
    return _passes_noise(was, now, noise)


def _passes_noise(was: Mapping[str, float], now: Mapping[str, float], noise: BandNoise) -> bool:
    return any(was[output] <= AT_NOISE * noise.rms[output] < now[output] for output in was)


def _added(present: Fit, larger: Fit) -> int:
    """Number of parameters that the larger model has more, at least one."""
    after, before = (
        sum(Coordinates(term.effect).n_parameters for term in fitted.hypothesis.terms)
        for fitted in (larger, present)
    )
    return max(1, after - before)


def predicts_better(new: Fitted, old: Fitted) -> bool:
    """Whether a fit predicts held-out blocks of time of some output relevantly better than another
    fit of the same runs, with other nuisance parameters or excluded samples.
    """
    now, was = (
        held_out_rms(engine.regression, fitted, noise, engine.regression.blocks)
        for engine, fitted, noise in (new, old)
    )
    return min(now[output] / was[output] for output in was) < RELEVANT_RATIO

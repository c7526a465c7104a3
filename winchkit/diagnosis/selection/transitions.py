"""Transition of friction as a nuisance: the rate over which its direction turns around.

A reversal is rounded by presliding, by the drive's velocity filter and by the logger's low-pass. A
search with sharp directions finds the friction and leaves its reversals; what it adds for these is
no effect of the machine. Where the friction that it found fits better with a transition, the search
is repeated with the transition in every law of friction over the same rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.effects.transition import TRANSITION, with_free_transition

_STEPS = 8
"""Transitions that are tried between the smallest and the largest one."""
_SHARP = 1.1
"""Of the lower bound: a transition below is none."""
_ITERATIONS = 3
"""Iterations of the other values beside a transition: amplitudes are linear."""
_SMALLEST, _LARGEST = 1e-3, 0.1
"""Of the highest rate: below, a reversal has no samples; above, it is no friction but a drag."""


def scanned_transitions(
    engine: TimeSeriesSelection, final: Fit, noise: BandNoise
) -> dict[str, float]:
    """Transitions, by unit of the rate, with which the friction of a model predicts held-out data
    better: some error falls by 2 % and χ² by ln n.
    """
    regression, coarse = engine.regression, engine.coarse
    out: dict[str, float] = {}
    for unit, rate in _highest_rates(engine).items():
        places = _frictions(final.hypothesis, unit)
        if not places or not rate:
            continue
        if coarse is None:
            sampled = regression, final.hypothesis, noise.inverse_sigma(regression)
        else:
            sampled = (
                coarse.regression,
                coarse.reduced(final.hypothesis),
                coarse.inverse_sigma(noise),
            )
        size = _best(*sampled, places, np.geomspace(_SMALLEST * rate, _LARGEST * rate, _STEPS))
        start, weights = _at(final.hypothesis, places, size), noise.inverse_sigma(regression)
        better = fit(regression, start, weights, _ITERATIONS)
        if _is_better(engine, better, final, noise):
            out[unit] = size
    return out


def _best(
    regression: TimeSeriesRegression,
    start: Hypothesis,
    inverse_sigma: Array,
    places: list[int],
    sizes: Array,
) -> float:
    """The transition that fits best, refined from the best of some sizes."""
    tried = [
        fit(regression, _at(start, places, float(size)), inverse_sigma, _ITERATIONS)
        for size in sizes
    ]
    best = min(tried, key=lambda fitted: fitted.chi_square)
    free = fit(regression, _freed(best.hypothesis, places[0], float(sizes[-1])), inverse_sigma)
    return free.hypothesis.terms[places[0]].values[TRANSITION]


def _freed(hypothesis: Hypothesis, index: int, largest: float) -> Hypothesis:
    """The hypothesis with the transition of one term as an unknown up to a largest one."""
    term = hypothesis.terms[index]
    effect = with_free_transition(term.effect, largest)
    return hypothesis.with_term_at(index, Term(effect, term.values))


def _is_better(engine: TimeSeriesSelection, better: Fit, present: Fit, noise: BandNoise) -> bool:
    """Whether χ² falls by ln n and some held-out error by 2 %, as with an effect."""
    if better.chi_square > present.chi_square - engine.penalty_per_parameter:
        return False
    folds = engine.folds(present, noise)
    now = engine.held_out_errors(better, noise, folds)
    before = engine.held_out_errors(present, noise, folds)
    return min(now[name] / before[name] for name in now if before[name]) < RELEVANT_RATIO


def with_fitted_transitions(engine: TimeSeriesSelection, final: Fit, noise: BandNoise) -> Fit:
    """The model with the transition of its largest friction over each rate fitted; the given model
    where that is at its lower bound, which is sharp friction.
    """
    present = final
    for unit, rate in _highest_rates(engine).items():
        for index in _frictions(present.hypothesis, unit)[:1]:
            term = present.hypothesis.terms[index]
            if not term.values.get(TRANSITION) or Coordinates(term.effect).nuisances:
                continue
            free = engine.refit(_freed(present.hypothesis, index, _LARGEST * rate), noise)
            values = free.hypothesis.terms[index]
            if values.values[TRANSITION] > _SHARP * values.effect.parameter(TRANSITION).low:
                present = free
            else:
                sharp = Term(term.effect, {**values.values, TRANSITION: 0.0})
                present = engine.refit(free.hypothesis.with_term_at(index, sharp), noise)
    return present


def with_rounded_reversals(engine: TimeSeriesSelection, final: Fit, noise: BandNoise) -> Fit:
    """The model whose friction has the transitions that predict best; the given one without any."""
    hypothesis = final.hypothesis
    for unit, size in scanned_transitions(engine, final, noise).items():
        hypothesis = _at(hypothesis, _frictions(hypothesis, unit), size)
    if hypothesis is final.hypothesis:
        return final
    return with_fitted_transitions(engine, engine.refit(hypothesis, noise), noise)


def _highest_rates(engine: TimeSeriesSelection) -> dict[str, float]:
    """Highest rate of the motor and of the cable, by unit."""
    motions = engine.regression.motions
    return {
        "rad/s": max((float(np.max(np.abs(at.motor_rate))) for at in motions), default=0.0),
        "m/s": max((float(np.max(np.abs(at.speed))) for at in motions), default=0.0),
    }


def _frictions(hypothesis: Hypothesis, unit: str) -> list[int]:
    """Terms with a transition over a rate."""
    return [
        index
        for index, term in enumerate(hypothesis.terms)
        if any(p.name == TRANSITION and p.unit == unit for p in term.effect.parameters)
    ]


def _at(hypothesis: Hypothesis, places: list[int], transition: float) -> Hypothesis:
    """The hypothesis with another transition in some terms."""
    terms = list(hypothesis.terms)
    for index in places:
        values: Mapping[str, float] = {**terms[index].values, TRANSITION: transition}
        terms[index] = Term(terms[index].effect, values)
    return replace(hypothesis, terms=tuple(terms))

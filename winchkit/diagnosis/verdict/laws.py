"""Simplification of a selected model: nested laws, and steps without which nothing is lost.

A law whose shape is at a bound, beyond what a machine can have, or not determined by the runs, such
as a Stribeck speed far above the highest one, is that of a simpler effect (``Effect.reduces_to``),
which takes its place where it explains nine tenths as much; so it does where the refitted model
with it predicts every output as well, to 2 %. A step is left out where the model without it does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from winchkit.diagnosis.regression.cross_validation import (
    AT_NOISE,
    CERTAIN,
    excess,
    held_out_rms,
)
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import estimates, spread_of
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.results import Estimate
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.starting_values import shape_at_bound
from winchkit.diagnosis.verdict.plausibility import implausible_value, plausible_range
from winchkit.effects.effect import Parameter
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.effects.transition import TRANSITION
from winchkit.schema.profiles.winch import WinchProfile

_SEEN = 1.5
"""Largest Stribeck speed over the highest one in the runs, within which the friction then falls by
a third, exp(−v²); rule of thumb: where it falls by less, the curve beside viscous friction is that
of any smooth law."""
_SURE = 1.96
"""Standard deviations by which a determined shape is above zero, 95 %: a ladder of speeds in one
direction has a presliding distance of 3.2 ± 2.3 rad beside a spring, which is neither."""
_DOUBLED = 2.0
"""Ratio of errors by which a step is missed: it had three quarters of the mean square."""


def simplified(
    engine: SelectionEngine,
    final: Fit,
    noise: BandNoise,
    settled: Callable[[Fit], Fit] = lambda fitted: fitted,
) -> tuple[Fit, BandNoise]:
    """The model with the simplest laws, and without steps by which nothing is gained."""
    present, before = final, None
    while present is not before:
        # A law or step that goes may have stood in for a part of what another one's simpler law
        # explains.
        before, present = present, _with_simpler_laws(engine, present, noise, settled)
        present = _without_needless(engine, present, noise) or present
    return (final, noise) if present is final else engine.fit_with_noise(present.hypothesis, noise)


def _with_simpler_laws(
    engine: SelectionEngine, present: Fit, noise: BandNoise, settled: Callable[[Fit], Fit]
) -> Fit:
    """The model with every law replaced by a simpler one with which nothing is lost."""
    for index in reversed(range(engine.n_initial_terms, len(present.hypothesis.terms))):
        term = present.hypothesis.terms[index]
        if not term.effect.reduces_to:
            continue
        simpler = settled(with_simpler_law(engine, present, noise, index))
        is_as_good = largest_rise(engine, simpler, present, noise) <= 1 / RELEVANT_RATIO
        if (is_as_good and transfers(engine, simpler, present, noise)) or (
            is_degenerate(engine, present, noise, index)
            and _lost_share(engine, simpler, present, noise, index) <= CERTAIN
        ):
            present = simpler
    return present


def degenerate_laws(engine: SelectionEngine, fitted: Fit, noise: BandNoise) -> set[str]:
    """Ids of the additions whose shape is at a bound, implausible, or not determined."""
    terms = list(enumerate(fitted.hypothesis.terms))[engine.n_initial_terms :]
    return {term.effect.id for index, term in terms if is_degenerate(engine, fitted, noise, index)}


def is_degenerate(engine: SelectionEngine, fitted: Fit, noise: BandNoise, index: int) -> bool:
    """Whether a law that contains simpler ones is one of these (:func:`reduced_law`)."""
    if not fitted.hypothesis.terms[index].effect.reduces_to:
        return False
    spread = spread_of(engine.regression, fitted, noise, engine.regression.blocks, index)
    term, values = estimates(engine.regression, fitted, spread)[index]
    return reduced_law(term, values, engine.profile, _fastest(engine))


def _fastest(engine: SelectionEngine) -> Mapping[str, float]:
    """Highest speed of the runs by its unit; none of a robot's poses."""
    regression = engine.regression
    if not isinstance(regression, TimeSeriesRegression):
        return {}
    motions = regression.motions
    return {
        "rad/s": max(float(np.max(np.abs(motion.motor_rate))) for motion in motions),
        "m/s": max(float(np.max(np.abs(motion.speed))) for motion in motions),
    }


def _lost_share(
    engine: SelectionEngine, simpler: Fit, present: Fit, noise: BandNoise, index: int
) -> float:
    """Share of the excess that a term explains, which a model with a simpler law leaves; with the
    simpler laws beside it, where these were added: both are one friction.
    """
    terms, own = present.hypothesis.terms, present.hypothesis.terms[index].effect
    hypothesis = present.hypothesis
    for place in reversed(range(engine.n_initial_terms, len(terms))):
        if place == index or terms[place].effect.id in own.reduces_to:
            hypothesis = hypothesis.without(place)
    without = engine.refit(hypothesis, noise)
    folds = engine.folds(present, noise)
    left, now, whole = (
        excess(held_out_rms(engine.regression, fitted, noise, folds), noise.rms)
        for fitted in (simpler, present, without)
    )
    return (left - now) / (whole - now) if whole > now else 0.0


def largest_rise(engine: SelectionEngine, smaller: Fit, present: Fit, noise: BandNoise) -> float:
    """Largest ratio of the held-out errors of a smaller model to those of the present one."""
    folds = engine.folds(present, noise)
    now = held_out_rms(engine.regression, present, noise, folds)
    errors = held_out_rms(engine.regression, smaller, noise, folds)
    return max(errors[output] / now[output] if now[output] else 1.0 for output in now)


def transfers(engine: SelectionEngine, simpler: Fit, present: Fit, noise: BandNoise) -> bool:
    """Whether a simpler model predicts as well as the present one, each by its own folds: a law
    with fewer shapes is also asked for another load.
    """
    now, errors = (
        engine.held_out_errors(m, noise, engine.folds(m, noise)) for m in (present, simpler)
    )
    return all(errors[output] <= AT_NOISE * now[output] for output in now)


def _is_missed(engine: SelectionEngine, smaller: Fit, present: Fit, noise: BandNoise) -> bool:
    """Whether a smaller model doubles an error in blocks of time, whatever other groups show:
    values may predict a group of another speed so badly that no step helps.
    """
    blocks = engine.regression.blocks
    now, errors = (held_out_rms(engine.regression, m, noise, blocks) for m in (present, smaller))
    return any(errors[output] > _DOUBLED * now[output] for output in now)


def reduced_law(
    term: Term,
    values: Mapping[str, Estimate],
    profile: WinchProfile | None,
    fastest: Mapping[str, float],
) -> bool:
    """Whether the shape of a law is at a bound, implausible, or not determined.

    It is determined where its 95 % interval is above zero, that of one standard deviation ends
    before the largest plausible value, and a speed is near those of the runs and above the
    transition of the reversal (below it the law is a part of that nuisance); a series where one of
    its coefficients is.
    """
    shapes = [p for p in Coordinates(term.effect).shapes if p.name in values]
    if not shapes:
        return False
    if shape_at_bound(term) or any(implausible_value(p, values[p.name], profile) for p in shapes):
        return True
    turned = term.values.get(TRANSITION, 0.0)
    return not any(_is_determined(p, values[p.name], profile, fastest, turned) for p in shapes)


def _is_determined(
    parameter: Parameter,
    estimate: Estimate,
    profile: WinchProfile | None,
    fastest: Mapping[str, float],
    turned: float,
) -> bool:
    known = plausible_range(parameter, profile)
    size, high = abs(estimate.value), parameter.high if known is None else known[1]
    is_speed = parameter.unit in fastest
    is_seen = not is_speed or turned <= size <= _SEEN * fastest[parameter.unit]
    return is_seen and estimate.std < min(size / _SURE, high - size)


def with_simpler_law(engine: SelectionEngine, present: Fit, noise: BandNoise, index: int) -> Fit:
    """The model with the best of the simpler laws of a term in its place, or without it."""
    effect = present.hypothesis.terms[index].effect
    base = engine.refit(present.hypothesis.without(index), noise)
    items = [s for s in engine.scores(base, noise) if s.candidate.effect.id in effect.reduces_to]
    trials = [engine.trial(base, item, noise) for item in items if item.net_gain > 0.0]
    fits = [trial.fit for trial in trials if np.isfinite(trial.criterion)]
    return min(fits, key=engine.criterion, default=base)


def _without_needless(engine: SelectionEngine, present: Fit, noise: BandNoise) -> Fit | None:
    """The model without the step whose removal raises the held-out errors least, by 2 % at most;
    None where every step is needed.
    """
    best: tuple[float, Fit] | None = None
    for index in range(engine.n_initial_terms, len(present.hypothesis.terms)):
        without = engine.refit(present.hypothesis.without(index), noise)
        rise = largest_rise(engine, without, present, noise)
        is_needless = rise <= 1 / RELEVANT_RATIO and not _is_missed(engine, without, present, noise)
        if is_needless and (best is None or rise < best[0]):
            best = rise, without
    return None if best is None else best[1]

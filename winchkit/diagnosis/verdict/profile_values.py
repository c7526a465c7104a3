"""Effects of the profile at their file values, and those whose refitted values predict better."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from winchkit.diagnosis.regression.cross_validation import held_out_rms
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis, held
from winchkit.diagnosis.regression.intervals import Spread, estimates
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.results import Doubt, Estimate, OutputFit, Place, Step
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.steps import standing_of
from winchkit.effects.term import Term
from winchkit.schema.profiles.axis import AxisProfile

_CHANGED, _EQUAL = 5.0, 3.0
"""Standard deviations by which two values have to change, and within which their factors are equal;
convention: two wrong values of 1 % agree so far by chance in one case of ten."""


def file_model(engine: SelectionEngine, start: Hypothesis, noise: BandNoise) -> Fit:
    """The profile's effects at their file values; offsets and initial states are fitted."""
    of_file = Hypothesis(tuple(map(held, start.terms)), start.nuisances, start.starts)
    return fit(engine.regression, of_file, noise.inverse_sigma(engine.regression))


def refitted_steps(
    engine: SelectionEngine,
    result: SelectionResult,
    file: Hypothesis,
    outputs: Mapping[str, OutputFit],
    spread: Spread,
) -> Iterator[Step]:
    """A step for every effect of the profile whose file values predict an output worse by 2 %."""
    final, noise, regression = result.final, result.noise, engine.regression
    folds = engine.folds(final, noise)
    now = held_out_rms(regression, final, noise, folds)
    fitted = estimates(regression, final, spread)
    for index, old in enumerate(file.terms):
        start = final.hypothesis.with_term_at(index, held(old))
        beside = fit(regression, start, noise.inverse_sigma(regression))
        errors = held_out_rms(regression, beside, noise, folds)
        if all(errors[name] <= error / RELEVANT_RATIO for name, error in now.items()):
            continue
        term, values = fitted[index]
        standing = standing_of(errors, outputs, term.effect.outputs, trusted=True)
        if not standing.explained > 0.0:
            continue  # within the noise both values are right
        doubts = [Doubt("remaining", standing.remaining)] if standing.remaining else []
        if isinstance(engine.profile, AxisProfile):
            doubts += _one_factor(fitted, file, index)
        gain = 1 - min(now[name] / errors[name] for name in now if errors[name]) ** 2
        yield Step(
            (term.effect.id,),
            {term.effect.id: values},
            gain,
            place=tuple(Place(*at) for at in term.effect.place),
            certain=not doubts,
            share=standing.share,
            doubts=tuple(doubts),
            refitted=True,
            file_values={name: old.values[name] for name in values},
        )


def _one_factor(
    fitted: Sequence[tuple[Term, Mapping[str, Estimate]]], file: Hypothesis, index: int
) -> list[Doubt]:
    """The doubt that a value changes by the same factor as another one of the profile: that of the
    measured torque.
    """
    factors = [_factor(old, values) for old, (_, values) in zip(file.terms, fitted, strict=False)]
    own = factors[index]
    for old, other in zip(file.terms, factors, strict=True):
        if old is file.terms[index] or own is None or other is None:
            continue
        apart = np.hypot(own.std, other.std)
        changed = all(abs(one.value - 1.0) > _CHANGED * one.std for one in (own, other))
        if changed and abs(own.value - other.value) < _EQUAL * apart:
            wrong = f"{100 * (own.value - 1):+.1f} %".replace("-", "−")
            what = f"{old.effect.id} changes by the same factor: the torque may be wrong by {wrong}"
            return [Doubt("factor", what)]
    return []


def _factor(old: Term, values: Mapping[str, Estimate]) -> Estimate | None:
    """Factor of the first amplitude of an effect over its file value; None where that is zero."""
    name = next(p.name for p in old.effect.parameters if p.role == "amplitude")
    size, now = old.values[name], values.get(name)
    if not size or now is None or not np.isfinite(now.std):
        return None
    return Estimate(now.value / size, now.std / abs(size), "1")

"""Effects of the profile at their file values, and those whose refitted values predict better."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from winchkit.diagnosis.regression.cross_validation import held_out_rms
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis, held
from winchkit.diagnosis.regression.intervals import Spread, estimates
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.results import Doubt, OutputFit, Place, Step
from winchkit.diagnosis.selection.acceptance import RELEVANT_RATIO
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.steps import standing_of


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
        gain = 1 - min(now[name] / errors[name] for name in now if errors[name]) ** 2
        yield Step(
            (term.effect.id,),
            {term.effect.id: values},
            gain,
            place=tuple(Place(*at) for at in term.effect.place),
            certain=not standing.remaining,
            share=standing.share,
            doubts=(Doubt("remaining", standing.remaining),) if standing.remaining else (),
            refitted=True,
            file_values={name: old.values[name] for name in values},
        )

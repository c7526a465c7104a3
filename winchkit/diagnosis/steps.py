"""Steps of a diagnosis: every effect of the final model with its values, its share and its doubts.

A doubt is written on its step and never removes another. A step is certain where it has none: one
law without alternatives or a curve, plausible and determined values, and less left in its outputs
than a tenth of what it explains.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, zip_longest

import numpy as np

from winchkit.diagnosis.credibility import (
    asymmetric_friction,
    miscounted_turns,
    oversized,
    short_record,
    unresolved_order,
)
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.regression.base import Folds
from winchkit.diagnosis.regression.conditioning import (
    COLLINEAR_DELAY,
    collinearity,
    value_covariance,
)
from winchkit.diagnosis.regression.cross_validation import CERTAIN, excess, held_out
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.intervals import Spread, estimates, spread_of
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.results import CandidateScore, Doubt, Estimate, OutputFit, Place, Step
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.verdict.combination import combination_of_set, combination_of_term
from winchkit.diagnosis.verdict.equivalence import EquivalenceSet
from winchkit.diagnosis.verdict.open_law import OpenLaw
from winchkit.diagnosis.verdict.plausibility import implausible

_WELL_KNOWN = 0.01
"""Share of what a step explains that may be no noise where it is certain: the second order of a
right law; measured: of 150 cases right laws leave at most 0.002 of it, wrong ones 0.05 and more."""
_REJECTED = 0.01
"""Level of the test that what is left is noise; convention."""
_LARGEST_COLLINEARITY = 1e5
"""Law and channel are accurate to 0.3 % at best: where the others imitate an effect's change to
within that, what distinguishes it is less than their error."""
_NOT_CONVERGED = "not-converged"
"""The only doubt with which a step is certain: its values may change, its law does not."""


def steps_of(
    engine: SelectionEngine,
    result: SelectionResult,
    sets: Sequence[EquivalenceSet],
    *,
    dataset: Dataset | None = None,
    spread: Spread | None = None,
    outputs: Mapping[str, OutputFit] | None = None,
) -> tuple[Step, ...]:
    """Every addition with its equivalence set, values and held-out gain; the ``dataset`` of a winch
    is for combinations that have a name, the ``outputs`` for what each addition explains.
    """
    final, noise, regression = result.final, result.noise, engine.regression
    out = []
    spread = spread or spread_of(regression, final, noise, regression.blocks)
    own = estimates(regression, final, spread)[engine.n_initial_terms :]
    covariance = value_covariance(regression, final, noise)
    growth = _growth(engine, final, noise)
    folds = engine.folds(final, noise)
    explained = _explained(engine, growth, noise, folds, outputs or {})
    squares = [float(np.sum(held_out(regression, fitted, noise, folds))) for fitted in growth]
    gains = [1 - after / before for before, after in pairwise(squares)]
    for equivalence, gain, share, (term, values) in zip(sets, gains, explained, own, strict=True):
        parameters = {
            member.effect.id: values
            if member.effect.id == term.effect.id
            else _values_of_rival(engine, result, fitted, member.effect.id)
            for member, fitted in zip(equivalence.terms, equivalence.fits, strict=True)
        }
        combination = combination_of_set(equivalence.terms, parameters, dataset)
        if combination is None and equivalence.term.effect.id == term.effect.id:
            combination = combination_of_term(term, covariance)
        place = tuple(Place(*at) for at in equivalence.terms[0].effect.place)
        out.append(
            Step(
                equivalence.effects,
                parameters,
                gain,
                equivalence.angles,
                combination=combination,
                place=place,
                explains=share,
                doubts=_further(equivalence.further),
            )
        )
    return tuple(out)


@dataclass(frozen=True)
class Standing:
    """What one step explains of the excess, and what is left where it acts."""

    share: float
    """Share of the excess before that only this step explains."""
    remaining: str
    """Why what is left in its outputs is too much for it to be certain; empty where it is not."""
    explained: float = 0.0
    """Excess that only this step explains."""
    rounded: str = ""
    """Simpler law with a rounded reversal that explains all but a tenth of it; empty without."""


def is_small(step: Step, before: Iterable[Step]) -> bool:
    """Whether a step before it in the same outputs explains more than ten times as much: its law is
    known to a tenth, and what it leaves may be this step.
    """
    return any(step.explains < CERTAIN * other.explains for other in before)


def standing_of(
    without: Mapping[str, float],
    outputs: Mapping[str, OutputFit],
    own: Sequence[str],
    *,
    trusted: bool,
    spread: Mapping[str, float] | None = None,
) -> Standing:
    """Standing of a step by the held-out errors of the model without it; it is ``trusted`` where
    its outputs decide on the model. ``spread`` (from repeats) is two standard deviations of the
    square of an error in units of the noise.
    """
    noise = {name: output.noise_rms for name, output in outputs.items()}
    after = {name: output.heldout_rms_after for name, output in outputs.items()}
    before = {name: output.heldout_rms_before for name, output in outputs.items()}
    explained, whole = excess(without, noise) - excess(after, noise), excess(before, noise)
    there = [name for name in own if name in outputs]
    left = excess({name: after[name] for name in there}, noise)
    share = float(np.clip(explained / whole, 0.0, 1.0)) if whole > 0.0 else float("nan")
    known_to = sum((spread or {}).get(name, 0.0) for name in there)
    chances = [p for name in there if (p := outputs[name].p_value) is not None]
    remaining = ""
    if not trusted or left > CERTAIN * explained:
        remaining = "it explains this error only in part: another effect may act too"
    elif left + known_to > CERTAIN * explained:
        remaining = "the noise is too uncertain to exclude another effect"
    elif left > _WELL_KNOWN * explained and any(p < _REJECTED for p in chances):
        remaining = "the error that remains is not noise: another law may fit better"
    return Standing(share, remaining, explained)


def with_standing(
    engine: SelectionEngine,
    result: SelectionResult,
    step: Step,
    *,
    index: int,
    standing: Standing,
    curve: OpenLaw | None = None,
    small: bool = False,
) -> Step:
    """A step with its share, law and doubts; ``small`` is that of :func:`is_small`."""
    doubts = list(_doubts(engine, result, step, index, curve))
    if standing.remaining:
        doubts.append(Doubt("remaining", standing.remaining))
    if standing.rounded:
        what = f"the simpler {standing.rounded} explains nine tenths of it"
        if "friction" in result.final.hypothesis.terms[index].effect.family:
            what += ", if friction may build up gradually at a reversal"
        doubts.append(Doubt("reversal", what))
    if small:
        what = "another step explains ten times as much there, and this one may only correct it"
        doubts.append(Doubt("small", what))
    established = len(step.effects) == 1 and curve is None
    return replace(
        step,
        law="established" if established else "open",
        certain=all(doubt.code == _NOT_CONVERGED for doubt in doubts),
        share=standing.share,
        doubts=tuple(doubts),
        curve=curve.curve.words if curve is not None else "",
    )


def _doubts(
    engine: SelectionEngine,
    result: SelectionResult,
    step: Step,
    index: int,
    curve: OpenLaw | None,
) -> list[Doubt]:
    out = []
    regression, term = engine.regression, result.final.hypothesis.terms[index]
    if len(step.effects) > 1:
        others = ", ".join(step.effects[1:])
        out.append(Doubt("alternatives", f"these data cannot distinguish it from {others}"))
        out += step.doubts
    if curve is not None:
        out.append(Doubt("curve", curve.text))
    values = step.parameters.get(term.effect.id, {})
    if reason := implausible(term, values, engine.profile):
        out.append(Doubt("implausible", reason))
    largest = COLLINEAR_DELAY if term.effect.is_delay else _LARGEST_COLLINEARITY
    if collinearity(regression, result.final, result.noise, index) > largest:
        within = "a third" if term.effect.is_delay else "0.3 %"
        what = f"the others can imitate it to within {within}: their values may cancel each other"
        out.append(Doubt("collinear", what))
    if not result.final.converged:
        steps = result.final.iterations
        what = f"the fit did not converge in {steps} steps: its values may change"
        out.append(Doubt(_NOT_CONVERGED, what))
    for code, check in (
        ("oversized", oversized),
        ("short-record", short_record),
        ("asymmetry", asymmetric_friction),
        ("unresolved", unresolved_order),
        ("turns", miscounted_turns),
    ):
        if reason := check(regression, result.final, index):
            out.append(Doubt(code, reason))
    sizes = {n: e for n, e in values.items() if term.effect.parameter(n).role == "amplitude"}
    if sizes and not any(_is_determined(term.effect.null, n, e) for n, e in sizes.items()):
        out.append(Doubt("undetermined", "its values are not determined by these data"))
    return out


def _is_determined(null: Mapping[str, float], name: str, estimate: Estimate) -> bool:
    """Whether a value differs from its null by more than its standard deviation."""
    if np.isinf(null[name]):
        return bool(estimate.std < abs(estimate.value))
    return bool(estimate.std < abs(estimate.value - null[name]))


def _further(effects: Sequence[str]) -> tuple[Doubt, ...]:
    text = f"nor can they distinguish it from {', '.join(effects)}"
    return (Doubt("further", text),) if effects else ()


def _values_of_rival(
    engine: SelectionEngine, result: SelectionResult, fitted: Fit, effect: str
) -> dict[str, Estimate]:
    """Values of a rival in its fit, with their uncertainty."""
    regression, noise = engine.regression, result.noise
    # The reported model may have other weights than those of the comparison.
    fitted = engine.refit(fitted.hypothesis, noise)
    ids = [term.effect.id for term in fitted.hypothesis.terms]
    index = len(ids) - 1 - ids[::-1].index(effect)
    spread = spread_of(regression, fitted, noise, regression.blocks, index)
    return estimates(regression, fitted, spread)[index][1]


def _growth(engine: SelectionEngine, final: Fit, noise: BandNoise) -> list[Fit]:
    """The model without additions, with the first one, and so on to the final model."""
    hypothesis, first = final.hypothesis, engine.n_initial_terms
    parts = [
        Hypothesis(hypothesis.terms[:count], hypothesis.nuisances, hypothesis.starts[:count])
        for count in range(first, len(hypothesis.terms))
    ]
    return [*(engine.refit(part, noise) for part in parts), final]


def _explained(
    engine: SelectionEngine,
    growth: Sequence[Fit],
    noise: BandNoise,
    folds: Folds,
    outputs: Mapping[str, OutputFit],
) -> list[float]:
    """Share of the excess before that each addition explains as the model grows; NaN without
    outputs.
    """
    size = {name: output.noise_rms for name, output in outputs.items()}
    whole = excess({name: output.heldout_rms_before for name, output in outputs.items()}, size)
    if not whole > 0.0:
        return [float("nan")] * (len(growth) - 1)
    left = [excess(engine.held_out_errors(fitted, noise, folds), size) for fitted in growth]
    return [float(np.clip((before - after) / whole, 0.0, 1.0)) for before, after in pairwise(left)]


def candidates_of(engine: SelectionEngine, result: SelectionResult) -> tuple[CandidateScore, ...]:
    """Every candidate with its score, the first ones with their held-out errors."""
    out = []
    folds = engine.folds(result.final, result.noise)
    for item, fitted in zip_longest(result.scores, result.tried):
        rms: dict[str, float] = {}
        if fitted is not None:
            rms = engine.held_out_errors(fitted, result.initial_noise, folds)
        out.append(CandidateScore(item.candidate.effect.id, item.net_gain, rms))
    return tuple(out)


def place_text(step: Step) -> str:
    """Place by which a step that is not certain is followed, as ``motor: motor_torque over speed``;
    the id of its first effect without one.
    """
    if not step.place:
        return step.effects[0]
    first = step.place[0]
    over = f" over {first.variable}" if first.variable else ""
    return f"{first.part}: {', '.join(dict.fromkeys(at.output for at in step.place))}{over}"

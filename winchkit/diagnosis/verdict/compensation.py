"""Values that may compensate each other: several steps that one change explains as well.

The steps over one variable are replaced by one curve over it, and those of a torque by one factor
on what the profile predicts, beside the values of the profile's file. Where that explains as much
with fewer parameters, none of the steps is certain; nor is one beside an open law that changes the
same alike. Where one curve explains nine tenths of the excess and the effects of a search together
clearly less, they imitate an unknown law: the search ends with the closest one.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.conditioning import change_by
from winchkit.diagnosis.regression.cross_validation import CERTAIN
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis, held
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.results import Doubt, Step
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.curve_fits import PartialRegression, ranked_curves
from winchkit.diagnosis.verdict.open_law import MARGIN, at_places, variables_of_law
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.effects.transition import TRANSITION
from winchkit.schema.profiles.axis import AxisProfile

_BY_KNOTS = 0.005
"""Share of what a curve explains that the straight pieces between its knots lose."""
_AS_IN_FILE = 2.0
"""Standard deviations up to which a value is still that of the file; convention: 95 %."""
_FACTOR = 1
"""Parameters of a factor."""


class CurveInstead:
    """Whether one free curve explains what the effects of a search from ``initial`` on do not."""

    def __init__(self, engine: TimeSeriesSelection, initial: Fit) -> None:
        self._engine, self._initial = engine, initial
        self._imitating: Fit | None = None

    def __call__(self, present: Fit, noise: BandNoise) -> bool:
        """Whether the additions of ``present`` imitate a curve; asked after each of them."""
        if len(present.hypothesis.terms) < self._engine.n_initial_terms + 2:
            return False
        regression, initial = self._engine.regression, self._initial
        weights = noise.inverse_sigma(regression)
        partial = PartialRegression(initial.residual, initial.jacobian, weights)
        over = partial.chi_square - regression.n_rows
        by_additions = partial.chi_square - present.chi_square
        if over - by_additions <= CERTAIN * over:
            return False
        price = self._engine.penalty_per_parameter
        ranked = ranked_curves(regression, partial, regression.outputs, price)
        best = max((curve.net_gain for curve in ranked), default=0.0)
        if best < max((1 - CERTAIN) * over, (1 + MARGIN) * by_additions):
            return False
        self._imitating = present
        return True

    def closest(self, found: SelectionResult) -> SelectionResult:
        """The result with the one addition that explains most, where they imitate a curve."""
        if self._imitating is None:
            return found
        engine, noise, terms = self._engine, found.noise, self._imitating.hypothesis.terms
        initial, runs = self._initial.hypothesis, engine.regression.n_runs
        alone = [
            engine.refit(initial.with_term(term, runs), noise)
            for term in terms[engine.n_initial_terms :]
        ]
        final, noise = engine.fit_with_noise(min(alone, key=engine.criterion).hypothesis, noise)
        return replace(found, final=final, noise=noise)


def with_compensations(
    engine: TimeSeriesSelection, result: SelectionResult, file: Hypothesis, steps: Sequence[Step]
) -> tuple[Step, ...]:
    """Steps with the doubt that they may compensate each other; ``file`` has the profile's own
    values.
    """
    terms, out = result.final.hypothesis.terms, list(steps)
    ids = [term.effect.id for term in terms]
    at = {
        place: ids.index(step.effects[0])
        for place, step in enumerate(steps)
        if not _is_of_reversals(step)
    }
    over = {place: variables_of_law(terms[index]) for place, index in at.items()}
    acts = {place: {*terms[index].effect.outputs} for place, index in at.items()}
    for variable in sorted(frozenset().union(*over.values())):
        alike = [place for place in at if variable in over[place]]
        own = [p for p in alike if any(acts[p] & acts[q] for q in alike if q != p)]
        index = [at[place] for place in own]
        if len(own) > 1 and _Together.of(engine, result, file, index).is_curve(variable):
            words = variable.replace("_", " ")
            for place in own:
                replaced = f"these {len(own)} effects"
                doubted = _doubted(out[place], "curve", f"a curve over {words}", replaced)
                out[place] = replace(doubted, curve=doubted.curve or words)
    torque = {k: p for p, k in at.items() if terms[k].effect.outputs == ("motor_torque",)}
    refitted = {
        index for index, place in torque.items() if steps[place].refitted and not out[place].curve
    }
    if refitted and (factor := _factor(engine, result, file, torque)) is not None:
        wrong = f"{100 * (factor.value - 1):+.1f} %".replace("-", "−")
        what = f"a torque constant that is wrong by {wrong}"
        for term in torque.keys() & (refitted | factor.replaced):
            place = torque[term]
            replaced = ", ".join(ids[index] for index in sorted(factor.replaced))
            out[place] = _doubted(out[place], "factor", what, replaced)
    if not any(step.curve for step in out):
        return tuple(out)
    weights = result.noise.inverse_sigma(engine.regression)
    index = [ids.index(step.effects[0]) for step in steps]
    changes = [weights * change_by(engine.regression, result.final, k) for k in index]
    return beside_unknown(out, [terms[k].effect.outputs for k in index], changes)


@dataclass(frozen=True)
class _Factor:
    """A factor on what the profile predicts, and the terms whose changes it explains."""

    value: float
    replaced: frozenset[int]


def _factor(
    engine: TimeSeriesSelection, result: SelectionResult, file: Hypothesis, steps: Collection[int]
) -> _Factor | None:
    """The factor that explains as much with fewer parameters, in place of all ``steps`` and changed
    values of the profile, or of these values but for as few as possible; of an axis only: by a
    winch's load the torque constant is an effect like others.
    """
    if not isinstance(engine.regression.dataset.profile, AxisProfile):
        return None
    price, of_file = engine.penalty_per_parameter, frozenset(range(len(file.terms)))

    def together(own: Collection[int]) -> _Together:
        return _Together.of(engine, result, file, sorted(own))

    alone = [together([index]) for index in of_file]
    changed = frozenset(k for k, one in enumerate(alone) if one.gain > price * one.count)
    # An effect that the profile lacks, such as a lag, may also act beside a wrong factor.
    whole = together(of_file.union(steps))
    replaced = changed.union(steps)
    if whole.lost < price * (together(replaced).count - _FACTOR):
        return _Factor(whole.factor, replaced)
    own, present = of_file, together(of_file)
    while True:
        # A value of its own beside the factor costs as much as one beside the file.
        saved = sum(alone[k].count for k in changed) - _FACTOR
        saved -= sum(alone[k].count for k in of_file - own)
        if saved <= 0:
            return None
        if present.lost < price * saved:
            return _Factor(present.factor, own & changed)
        fewer = [own - {index} for index in own]
        own, present = min(zip(fewer, map(together, fewer), strict=True), key=lambda x: x[1].lost)


def _is_of_reversals(step: Step) -> bool:
    """Whether a refitted effect has its file's values, but for the transition at a reversal."""
    values = step.parameters[step.effects[0]]
    return TRANSITION in step.file_values and all(
        abs(values[name].value - old) <= _AS_IN_FILE * values[name].std
        for name, old in step.file_values.items()
        if name != TRANSITION
    )


def _doubted(step: Step, code: str, what: str, replaced: str) -> Step:
    text = (
        f"{what} explains as much as {replaced} together, beside the profile's own "
        "values and with fewer parameters: they may compensate each other"
    )
    if any(doubt.code == code for doubt in step.doubts):
        return step  # A curve speaks against it alone.
    law = "open" if code == "curve" else step.law
    return replace(step, law=law, certain=False, doubts=(*step.doubts, Doubt(code, text)))


def beside_unknown(
    steps: Sequence[Step], outputs: Sequence[Collection[str]], changes: Sequence[Array]
) -> tuple[Step, ...]:
    """Steps that are not certain beside another one with an open law that acts on nothing else,
    where a tenth of the square of one's change (n,) is along the other's.
    """
    out = []
    for own, step in enumerate(steps):
        laws = (
            other.curve
            for place, other in enumerate(steps)
            if place != own
            and {*outputs[place]} <= {*outputs[own]}
            and float(changes[own] @ changes[place]) ** 2
            > CERTAIN * float(np.sum(changes[own] ** 2) * np.sum(changes[place] ** 2))
        )
        words = next(filter(None, laws), "")
        if words and not step.curve:
            text = (
                f"the law of another effect over {words} is unknown: its value may contain a part "
                "of it"
            )
            doubts = (*step.doubts, Doubt("curve", text))
            out.append(replace(step, certain=False, doubts=doubts))
        else:
            out.append(step)
    return tuple(out)


@dataclass(frozen=True)
class _Together:
    """Several terms of a final model, and the model with the profile's own values without them."""

    engine: TimeSeriesSelection
    own: tuple[Term, ...]
    without: Fit
    partial: PartialRegression
    gain: float
    """Decrease of χ² by the terms."""

    @classmethod
    def of(
        cls,
        engine: TimeSeriesSelection,
        result: SelectionResult,
        file: Hypothesis,
        own: Sequence[int],
    ) -> _Together:
        final, hypothesis = result.final, result.final.hypothesis
        terms = hypothesis.terms
        for index in sorted(own, reverse=True):
            hypothesis = (
                hypothesis.without(index)
                if index >= len(file.terms)
                else hypothesis.with_term_at(index, _of_file(terms[index], file.terms[index]))
            )
        weights = result.noise.inverse_sigma(engine.regression)
        without = fit(engine.regression, hypothesis, weights)
        partial = PartialRegression(without.residual, without.jacobian, weights)
        present = PartialRegression(final.residual, final.jacobian, weights)
        gain = partial.chi_square - present.chi_square
        return cls(engine, tuple(terms[index] for index in own), without, partial, gain)

    @property
    def count(self) -> int:
        """Parameters of the terms."""
        return sum(Coordinates(term.effect).n_parameters for term in self.own)

    def is_curve(self, variable: str) -> bool:
        """Whether a curve over a variable explains as much with fewer parameters."""
        outputs = sorted({name for term in self.own for name in term.effect.outputs})
        price = self.engine.penalty_per_parameter
        return any(
            curve.net_gain > (1 - _BY_KNOTS) * self.gain - price * self.count
            and curve.explained_ss - curve.net_gain < price * self.count
            for curve in ranked_curves(
                self.engine.regression, self.partial, outputs, price, at_places([variable])
            )
        )

    @property
    def factor(self) -> float:
        """Factor on what the model without them predicts that explains most."""
        along, length = self._along_prediction
        return 1 + along / length if length > 0.0 else 1.0

    @property
    def lost(self) -> float:
        """Increase of χ² by the factor in place of the terms."""
        along, length = self._along_prediction
        return self.gain - (along**2 / length if length > 0.0 else 0.0)

    @cached_property
    def _along_prediction(self) -> tuple[float, float]:
        """Product of the residual and the prediction, and the square of the prediction."""
        change = self.engine.regression.change(self.without.hypothesis)
        column = self.partial.projected(change)
        return float(column @ self.partial.residual), float(column @ column)


def _of_file(term: Term, old: Term) -> Term:
    """A term at its file values, but with the transition of its reversal, which is a nuisance."""
    own = {TRANSITION: term.values[TRANSITION]} if TRANSITION in term.values else {}
    return held(Term(term.effect, {**old.values, **own}))

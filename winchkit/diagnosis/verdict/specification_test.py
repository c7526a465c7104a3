"""Specification test: an effect keeps its name only if no free curve explains clearly more.

Every named effect is compared with curves over one variable (polynomials, linear splines, kinks,
powers), each penalised by ln n per parameter. Where the best curve explains more than the named
effects, by more than noise gives in 0.5 % of cases in which the names are right and by more than a
formula may deviate from the physics, the names are withdrawn.

References
----------
Hart, J. D. (1997). Nonparametric Smoothing and Lack-of-Fit Tests. Springer.
Cox, D. R. (1962). Further results on tests of separate families of hypotheses. J. R. Statist. Soc.
B 24, 406-424.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.stepwise import SelectionResult, with_pair, without_term
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.curve_fits import (
    Curve,
    PartialRegression,
    explained_by,
    ranked_curves,
)
from winchkit.diagnosis.verdict.decision import Judgement, judge, named, withheld
from winchkit.diagnosis.verdict.specification_null import Named, null_excess
from winchkit.diagnosis.verdict.spline_alternatives import curves
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = ["SpecificationTest", "judge_with_specification_test"]

_LEVEL = 0.005
"""Probability that noise takes away the name of a right effect, over all tests of one result."""
_LEAST_SHARE = 0.5
"""Share of the named effects' decrease of χ² that a curve must reach on the coarse regression."""
_LEAST_REPLACED = 0.5
"""Share of the named effects' decrease of χ² that they lose beside a curve that is a rival."""
_COMPARED = 12
"""Places and variables whose curves are in the null distribution, those of largest gain."""
_MARGIN = 1e-3
"""Margin, share of the named effects' decrease of χ²: physics may differ from a formula."""
_MARGIN_WITH_LACK_OF_FIT = 2e-4
"""The same where lack of fit remains."""


def judge_with_specification_test(
    engine: TimeSeriesSelection, result: SelectionResult
) -> Judgement:
    """Verdict after the specification test.

    Notes
    -----
    All additions are tested together, then each beside the others. One that a curve outperforms is
    dropped or exchanged for a pair; where too much is left without it, no effect is named. Where
    the additions explain all, without repeats, an outperformed single effect only gets a note.
    Where a part is unexplained (verdict ``partly``), effects that no curve outperforms are named.
    """
    judgement = judge(engine, result)
    test = SpecificationTest(engine, result)
    if not test.added or judgement.verdict in ("unknown", "adequate"):
        return judgement
    in_part, terms = judgement.reported is not result, test.terms
    if curve := test.outperforming_curve(test.added):
        pair = None if in_part else with_pair(engine, result)
        if pair is not None:
            return judge_with_specification_test(engine, pair)
        note = _withheld_note(terms, terms, curve)
        return judgement if in_part else withheld(engine, result, 1.0, note)
    for index in reversed(test.added) if len(terms) > 1 else ():
        curve = test.outperforming_curve([index])
        if curve and (in_part or result.noise.from_repeats):
            return _without_outperformed(test, index, curve, judgement)
        if curve:
            label = terms[index - engine.n_initial_terms].label
            note = f"{_curve_name(curve)} would explain more than {label}"
            judgement = replace(judgement, notes=(*judgement.notes, note))
    return named(engine, result, judgement) if in_part else judgement


def _without_outperformed(
    test: SpecificationTest, index: int, curve: Curve, judgement: Judgement
) -> Judgement:
    """Verdict without an outperformed effect, or without any name where that effect is needed."""
    engine, result = test.engine, test.result
    outperformed = result.final.hypothesis.terms[index : index + 1]
    without = judge_with_specification_test(engine, without_term(engine, result, index))
    if without.reported.final.labels[engine.n_initial_terms :]:
        return replace(
            without, notes=(*without.notes, _withheld_note(outperformed, outperformed, curve))
        )
    if judgement.reported is not result:
        return judgement
    share = test.explained_ss([index]) / test.explained_ss(test.added)
    return withheld(
        engine, result, min(1.0, share), _withheld_note(test.terms, outperformed, curve)
    )


class SpecificationTest:
    """Residuals of a search's result without some of its effects."""

    def __init__(self, engine: TimeSeriesSelection, result: SelectionResult) -> None:
        self.engine = engine
        self.result = result
        self.added = range(engine.n_initial_terms, len(result.final.hypothesis.terms))
        self.terms = result.final.hypothesis.terms[engine.n_initial_terms :]

    @cached_property
    def _discretization_column(self) -> Array:
        return self.engine.regression.discretization_error(self.result.final.hypothesis)[:, None]

    def partial(self, indices: Sequence[int], *, discretization: bool = True) -> PartialRegression:
        """Residual without some terms, all other unknowns free in linear approximation.

        The others are not refitted: a lag that replaces a removed friction lies far from where both
        are right. With ``discretization`` the discretisation error is a free column as well.
        """
        inverse_sigma = self.result.noise.inverse_sigma(self.engine.regression)
        further = self._discretization_column if discretization else None
        return _partial(self.engine.regression, self.result.final, inverse_sigma, indices, further)

    @cached_property
    def _coarse(self) -> tuple[TimeSeriesRegression, Fit, Array] | None:
        """The final model on the coarse regression, with 1/σ of its rows; None without one."""
        coarse = self.engine.coarse
        if coarse is None:
            return None
        weights = coarse.inverse_sigma(self.result.noise)
        hypothesis = coarse.reduced(self.result.final.hypothesis)
        return coarse.regression, fit(coarse.regression, hypothesis, weights, 0), weights

    def _possible(self, indices: Sequence[int]) -> set[tuple[str, str]] | None:
        """Places and variables of curves that may explain as much as terms; None for all.

        Those of which the best curve explains at least half as much on the coarse regression.
        """
        if self._coarse is None:
            return None
        regression, final, weights = self._coarse
        partial, rest = (_partial(regression, final, weights, own) for own in (indices, ()))
        least = _LEAST_SHARE * (partial.chi_square - rest.chi_square)
        ranked = ranked_curves(regression, partial, self._outputs(indices), 0.0)
        return {(curve.place, curve.variable) for curve in ranked if curve.net_gain >= least}

    def explained_ss(self, indices: Sequence[int]) -> float:
        """Decrease of χ² by terms, given the others."""
        return self.partial(indices).chi_square - self.partial(()).chi_square

    def outperforming_curve(self, indices: Sequence[int]) -> Curve | None:
        """A curve that outperforms terms by the margin; None where there is none."""
        if self._excess(indices, discretization=False) is None:
            return None
        # The discretisation error is slow to compute, so that it is projected out here only.
        excess = self._excess(indices, discretization=True)
        if excess is None:
            return None
        curve, beyond = excess
        return curve if beyond > self._critical_excess(indices) else None

    def _excess(
        self, indices: Sequence[int], *, discretization: bool
    ) -> tuple[Curve, float] | None:
        """Best curve and its net gain beyond that of the terms and the allowance.

        None where that is not positive.
        """
        engine = self.engine
        partial, beside = (self.partial(i, discretization=discretization) for i in (indices, ()))
        explained_ss = partial.chi_square - beside.chi_square
        ranked = ranked_curves(
            engine.regression,
            partial,
            self._outputs(indices),
            engine.penalty_per_parameter,
            self._possible(indices),
        )
        # Initial states of runs are no parameters of the law; they carry no penalty here.
        net_gain = explained_ss - engine.penalty_per_parameter * self._n_parameters(indices)
        # A certain lack of fit is no chance deviation from the right formula.
        share = _MARGIN_WITH_LACK_OF_FIT if self.result.lack_of_fit else _MARGIN
        for curve in ranked:
            beyond = curve.net_gain - net_gain - share * explained_ss
            if beyond <= 0.0:
                break
            # A curve that gains as much beside the terms explains another part of the residual.
            replaced = curve.explained_ss - explained_by(engine.regression, beside, curve)
            if replaced > _LEAST_REPLACED * explained_ss:
                return curve, beyond
        return None

    def _critical_excess(self, indices: Sequence[int]) -> float:
        """Quantile of the excess where the terms are right, for one of all tests of a result."""
        regression, noise = self.engine.regression, self.result.noise
        penalty = self.engine.penalty_per_parameter
        partial, own = self.partial(indices), _own(regression, self.result.final, indices)
        columns = self.result.final.jacobian[:, own] * partial.inverse_sigma[:, None]
        columns = columns[:, np.any(columns, axis=0)]
        columns = columns / np.sqrt(np.sum(columns**2, axis=0))
        columns -= partial.explained @ (partial.explained.T @ columns)
        final = self.result.final.hypothesis
        change = partial.projected(np.asarray(_change(regression, final, indices)))
        outputs = self._outputs(indices)
        ranked = ranked_curves(regression, partial, outputs, penalty)[:_COMPARED]
        places = {(curve.place, curve.variable) for curve in ranked}
        drawn = null_excess(
            regression,
            noise,
            partial,
            Named(change, columns, self._n_parameters(indices), regression.change(final)),
            list(curves(regression, outputs, places)),
        )
        tests = 1 + (len(self.added) if len(self.added) > 1 else 0)
        return max(0.0, float(np.quantile(drawn, 1 - _LEVEL / tests)))

    def _outputs(self, indices: Sequence[int]) -> list[str]:
        terms = self.result.final.hypothesis.terms
        return sorted({output for index in indices for output in terms[index].effect.outputs})

    def _n_parameters(self, indices: Sequence[int]) -> int:
        terms = self.result.final.hypothesis.terms
        return sum(Coordinates(terms[index].effect).n_parameters for index in indices)


def _partial(
    regression: TimeSeriesRegression,
    final: Fit,
    inverse_sigma: Array,
    indices: Sequence[int],
    further: Array | None = None,
) -> PartialRegression:
    """Residual without some terms, all other unknowns and further columns free."""
    free = final.jacobian[:, ~_own(regression, final, indices)]
    free = free if further is None else np.hstack([free, further])
    residual = final.residual + _change(regression, final.hypothesis, indices)
    return PartialRegression(residual, free, inverse_sigma)


def _own(regression: TimeSeriesRegression, final: Fit, indices: Sequence[int]) -> NDArray[np.bool_]:
    """Mask of the unknowns of some terms."""
    own = np.zeros(len(final.vector), dtype=bool)
    for index in indices:
        own |= regression.unknowns_of(index, final.hypothesis)
    return own


def _change(
    regression: TimeSeriesRegression, hypothesis: Hypothesis, indices: Sequence[int]
) -> Array | float:
    """Change of the prediction by some terms beside the others, (rows,)."""
    others = hypothesis
    for index in sorted(indices, reverse=True):
        others = others.without(index)
    return regression.change(hypothesis) - regression.change(others) if indices else 0.0


def _withheld_note(terms: Sequence[Term], outperformed: Sequence[Term], curve: Curve) -> str:
    """Note with the reason for withheld names."""
    than = "" if len(outperformed) == len(terms) else f" than {_names(outperformed)}"
    return f"closest, but not named: {_names(terms)}; {_curve_name(curve)} explains more{than}"


def _curve_name(curve: Curve) -> str:
    place, variable = curve.place.replace("_", " "), curve.variable.replace("_", " ")
    return f"an unknown curve of the {place} over the {variable}"


def _names(terms: Sequence[Term]) -> str:
    return ", ".join(term.label for term in terms)

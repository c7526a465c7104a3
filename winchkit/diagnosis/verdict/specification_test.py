"""Specification test: an effect keeps its name only if no free curve explains clearly more.

Every named effect is compared with curves over one variable (polynomials, linear splines, kinks,
powers), each penalised by ln n per parameter. Where the best curve explains more than the named
effects by a margin, the names are withdrawn.

References
----------
Hart, J. D. (1997). Nonparametric Smoothing and Lack-of-Fit Tests. Springer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.projection import explained_ss, orthonormal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.stepwise import SelectionResult, with_pair, without_term
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.decision import Judgement, judge, withheld
from winchkit.diagnosis.verdict.spline_alternatives import Columns, curves
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = [
    "Curve",
    "PartialRegression",
    "SpecificationTest",
    "best_curve",
    "judge_with_specification_test",
]

_UNIDENTIFIABLE = 1e-7
_LEAST_SQUARED_LENGTH = 1e-300


@dataclass(frozen=True)
class Curve:
    """A curve over one variable and the net decrease of χ² by it."""

    place: str
    """Output that it is added to, or ``cable_force`` or ``winding``, which act on several."""
    variable: str
    net_gain: float
    """Decrease of χ² less the penalty of its parameters."""


class PartialRegression:
    """Whitened residual with the fitted unknowns projected out, to which curves are fitted."""

    def __init__(self, residual: Array, jacobian: Array, inverse_sigma: Array) -> None:
        """Whiten ``residual`` (rows,) and project out the columns of ``jacobian`` (rows, k)."""
        self.inverse_sigma = inverse_sigma
        self.explained = orthonormal(jacobian * inverse_sigma[:, None])
        whitened = residual * inverse_sigma
        self.residual = whitened - self.explained @ (self.explained.T @ whitened)

    @property
    def chi_square(self) -> float:
        """χ² that is left."""
        return float(self.residual @ self.residual)


def best_curve(
    regression: TimeSeriesRegression,
    partial: PartialRegression,
    outputs: Sequence[str],
    penalty_per_parameter: float,
) -> Curve | None:
    """Curve of the largest net decrease of χ², among those that act on one of ``outputs``.

    Parameters
    ----------
    regression
        Regression problem.
    partial
        Residual to which curves are fitted.
    outputs
        Outputs of which a curve must change one.
    penalty_per_parameter
        Penalty per parameter, ln n.

    Returns
    -------
    Curve or None
        None where no variable changes.
    """
    best: Curve | None = None
    for place, variable, laws, columns in curves(regression, outputs):
        basis = _inner_products(partial, columns, len(laws[0][0]))
        net_gain = max(
            basis.explained_ss(coefficients) - penalty_per_parameter * n_parameters
            for coefficients, n_parameters in laws
        )
        if best is None or net_gain > best.net_gain:
            best = Curve(place, variable, net_gain)
    return best


@dataclass(frozen=True)
class _BasisProducts:
    """Gram matrices of whitened basis functions, before and after projection."""

    before: Array
    """Before projection, (knots, knots)."""
    after: Array
    """After projection, (knots, knots)."""
    inner_products: Array
    """Inner products with the residual, (knots,)."""

    def explained_ss(self, coefficients: Array) -> float:
        """Decrease of χ² by the curves of ``coefficients`` (knots, k)."""
        size = np.sqrt(
            np.maximum(np.diag(coefficients.T @ self.before @ coefficients), _LEAST_SQUARED_LENGTH)
        )
        after = coefficients.T @ self.after @ coefficients / np.outer(size, size)
        # Relative to the lengths before projection: a curve that the fit explains leaves rounding.
        return explained_ss(after, (coefficients.T @ self.inner_products) / size, _UNIDENTIFIABLE)


def _inner_products(partial: PartialRegression, columns: Columns, count: int) -> _BasisProducts:
    """Gram matrices of ``count`` basis functions, summed over segments."""
    before, inner_products = np.zeros((count, count)), np.zeros(count)
    explained_products = np.zeros((count, partial.explained.shape[1]))
    for rows, signal in columns:
        whitened = signal * partial.inverse_sigma[rows]
        before += whitened @ whitened.T
        explained_products += whitened @ partial.explained[rows]
        inner_products += whitened @ partial.residual[rows]
    return _BasisProducts(
        before, before - explained_products @ explained_products.T, inner_products
    )


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
    dropped or exchanged for a pair; where too much is left without it, no effect is named. Without
    repeats an outperformed single effect only gets a note.
    """
    judgement = judge(engine, result)
    test = SpecificationTest(engine, result)
    if judgement.reported is not result or not test.added:
        return judgement
    terms = test.terms
    if curve := test.outperforming_curve(test.added):
        pair = with_pair(engine, result)
        if pair is not None:
            return judge_with_specification_test(engine, pair)
        return withheld(engine, result, 1.0, _withheld_note(terms, terms, curve))
    for index in reversed(test.added) if len(terms) > 1 else ():
        curve = test.outperforming_curve([index])
        if curve and result.noise.from_repeats:
            return _without_outperformed(test, index, curve)
        if curve:
            label = terms[index - engine.n_initial_terms].label
            note = f"{_curve_name(curve)} would explain more than {label}"
            judgement = replace(judgement, notes=(*judgement.notes, note))
    return judgement


def _without_outperformed(test: SpecificationTest, index: int, curve: Curve) -> Judgement:
    """Verdict without an outperformed effect, or without any name where that effect is needed."""
    engine, result = test.engine, test.result
    outperformed = result.final.hypothesis.terms[index : index + 1]
    without = judge_with_specification_test(engine, without_term(engine, result, index))
    if without.reported.final.labels[engine.n_initial_terms :]:
        return replace(
            without, notes=(*without.notes, _withheld_note(outperformed, outperformed, curve))
        )
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
        regression, final = self.engine.regression, self.result.final
        hypothesis = final.hypothesis
        others, own = hypothesis, np.zeros(len(final.vector), dtype=bool)
        for index in sorted(indices, reverse=True):
            own |= regression.unknowns_of(index, hypothesis)
            others = others.without(index)
        removed = regression.change(hypothesis) - regression.change(others) if indices else 0.0
        free = final.jacobian[:, ~own]
        free = np.hstack([free, self._discretization_column]) if discretization else free
        return PartialRegression(
            final.residual + removed, free, self.result.noise.inverse_sigma(regression)
        )

    def explained_ss(self, indices: Sequence[int]) -> float:
        """Decrease of χ² by terms, given the others."""
        return self.partial(indices).chi_square - self.partial(()).chi_square

    def outperforming_curve(self, indices: Sequence[int]) -> Curve | None:
        """A curve that outperforms terms by the margin; None where there is none."""
        if not self._outperforming_curve(indices, discretization=False):
            return None
        # The discretisation error is slow to compute, so that it is projected out here only.
        return self._outperforming_curve(indices, discretization=True)

    def _outperforming_curve(self, indices: Sequence[int], *, discretization: bool) -> Curve | None:
        engine, hypothesis = self.engine, self.result.final.hypothesis
        effects = [hypothesis.terms[index].effect for index in indices]
        partial = self.partial(indices, discretization=discretization)
        explained_ss = (
            partial.chi_square - self.partial((), discretization=discretization).chi_square
        )
        # Initial states of runs are not parameters of the law; they carry no penalty here.
        net_gain = explained_ss - engine.penalty_per_parameter * sum(
            Coordinates(effect).n_parameters for effect in effects
        )
        outputs = sorted({output for effect in effects for output in effect.outputs})
        curve = best_curve(engine.regression, partial, outputs, engine.penalty_per_parameter)
        # A certain lack of fit is no chance deviation from the right formula.
        relative_margin = _MARGIN_WITH_LACK_OF_FIT if self.result.lack_of_fit else _MARGIN
        margin = engine.penalty_per_parameter + relative_margin * explained_ss
        return curve if curve and curve.net_gain > net_gain + margin else None


def _withheld_note(terms: Sequence[Term], outperformed: Sequence[Term], curve: Curve) -> str:
    """Note with the reason for withheld names."""
    than = "" if len(outperformed) == len(terms) else f" than {_names(outperformed)}"
    return f"closest, but not named: {_names(terms)}; {_curve_name(curve)} explains more{than}"


def _curve_name(curve: Curve) -> str:
    place, variable = curve.place.replace("_", " "), curve.variable.replace("_", " ")
    return f"an unknown curve of the {place} over the {variable}"


def _names(terms: Sequence[Term]) -> str:
    return ", ".join(term.label for term in terms)

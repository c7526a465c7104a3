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
    "Beside",
    "Curve",
    "Doubt",
    "best_curve",
    "judge_and_doubt",
]

_UNIDENTIFIABLE = 1e-7
_NOTHING = 1e-300


@dataclass(frozen=True)
class Curve:
    """A curve over one variable and the net decrease of χ² by it."""

    place: str
    """Output that it is added to, or ``rope force`` or ``winding``, which act on several."""
    variable: str
    net_gain: float
    """Decrease of χ² less the penalty of its parameters."""


class Beside:
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
    beside: Beside,
    outputs: Sequence[str],
    penalty_per_parameter: float,
) -> Curve | None:
    """Curve of the largest net decrease of χ², among those that act on one of ``outputs``.

    Parameters
    ----------
    regression
        Regression problem.
    beside
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
        hats = _inner_products(beside, columns, len(laws[0][0]))
        net_gain = max(
            hats.explained_ss(law) - penalty_per_parameter * n_parameters
            for law, n_parameters in laws
        )
        if best is None or net_gain > best.net_gain:
            best = Curve(place, variable, net_gain)
    return best


@dataclass(frozen=True)
class _Hats:
    """Gram matrices of whitened basis functions, before and after projection."""

    plain: Array
    """Before projection, (knots, knots)."""
    inner: Array
    """After projection, (knots, knots)."""
    products: Array
    """Inner products with the residual, (knots,)."""

    def explained_ss(self, law: Array) -> float:
        """Decrease of χ² by the curves ``law`` (knots, k)."""
        size = np.sqrt(np.maximum(np.diag(law.T @ self.plain @ law), _NOTHING))
        inner = law.T @ self.inner @ law / np.outer(size, size)
        # Measured by what they were: of what a fit explains whole only rounding is left.
        return explained_ss(inner, (law.T @ self.products) / size, _UNIDENTIFIABLE)


def _inner_products(beside: Beside, columns: Columns, count: int) -> _Hats:
    """Gram matrices of ``count`` basis functions, summed over segments."""
    plain, products = np.zeros((count, count)), np.zeros(count)
    through = np.zeros((count, beside.explained.shape[1]))
    for rows, signal in columns:
        whitened = signal * beside.inverse_sigma[rows]
        plain += whitened @ whitened.T
        through += whitened @ beside.explained[rows]
        products += whitened @ beside.residual[rows]
    return _Hats(plain, plain - through @ through.T, products)


_SLIGHT = 1e-3
"""Margin, share of the named effects' decrease of χ²: physics may differ from a formula."""
_SLIGHT_OF_MORE = 2e-4
"""The same where lack of fit remains."""


def judge_and_doubt(engine: TimeSeriesSelection, result: SelectionResult) -> Judgement:
    """Verdict after the specification test.

    Notes
    -----
    All additions are tested together, then each beside the others. One that a curve outperforms is
    dropped or exchanged for a pair; where too much is left without it, no effect is named. Without
    repeats an outperformed single effect only gets a note.
    """
    judgement = judge(engine, result)
    doubt = Doubt(engine, result)
    if judgement.shown is not result or not doubt.added:
        return judgement
    terms = doubt.terms
    if curve := doubt.beaten(doubt.added):
        pair = with_pair(engine, result)
        if pair is not None:
            return judge_and_doubt(engine, pair)
        return withheld(engine, result, 1.0, _words(terms, terms, curve))
    for index in reversed(doubt.added) if len(terms) > 1 else ():
        curve = doubt.beaten([index])
        if curve and result.noise.from_repeats:
            return _less(doubt, index, curve)
        if curve:
            label = terms[index - engine.n_initial_terms].label
            note = f"{_over(curve)} would explain more than {label}"
            judgement = replace(judgement, notes=(*judgement.notes, note))
    return judgement


def _less(doubt: Doubt, index: int, curve: Curve) -> Judgement:
    """Verdict without an outperformed effect, or without any name where that effect is needed."""
    engine, result = doubt.engine, doubt.result
    doubted = result.final.hypothesis.terms[index : index + 1]
    without = judge_and_doubt(engine, without_term(engine, result, index))
    if without.shown.final.labels[engine.n_initial_terms :]:
        return replace(without, notes=(*without.notes, _words(doubted, doubted, curve)))
    share = doubt.explained_ss([index]) / doubt.explained_ss(doubt.added)
    return withheld(engine, result, min(1.0, share), _words(doubt.terms, doubted, curve))


class Doubt:
    """Residuals of a search's result without some of its effects."""

    def __init__(self, engine: TimeSeriesSelection, result: SelectionResult) -> None:
        self.engine = engine
        self.result = result
        self.added = range(engine.n_initial_terms, len(result.final.hypothesis.terms))
        self.terms = result.final.hypothesis.terms[engine.n_initial_terms :]

    @cached_property
    def _rounding(self) -> Array:
        return self.engine.regression.discretization_error(self.result.final.hypothesis)[:, None]

    def beside(self, indices: Sequence[int], *, rounding: bool = True) -> Beside:
        """Residual without some terms, all other unknowns free in linear approximation.

        The others are not refitted: a lag that replaces a removed friction lies far from where both
        are right. With ``rounding`` the discretisation error is a free column as well.
        """
        regression, final = self.engine.regression, self.result.final
        hypothesis = final.hypothesis
        others, own = hypothesis, np.zeros(len(final.vector), dtype=bool)
        for index in sorted(indices, reverse=True):
            own |= regression.unknowns_of(index, hypothesis)
            others = others.without(index)
        lost = regression.change(hypothesis) - regression.change(others) if indices else 0.0
        free = final.jacobian[:, ~own]
        free = np.hstack([free, self._rounding]) if rounding else free
        return Beside(final.residual + lost, free, self.result.noise.inverse_sigma(regression))

    def explained_ss(self, indices: Sequence[int]) -> float:
        """Decrease of χ² by terms, given the others."""
        return self.beside(indices).chi_square - self.beside(()).chi_square

    def beaten(self, indices: Sequence[int]) -> Curve | None:
        """A curve that outperforms terms by the margin; None where there is none."""
        if not self._beaten(indices, rounding=False):
            return None
        # What sampling may have rounded is not held against a name; it takes a while to know.
        return self._beaten(indices, rounding=True)

    def _beaten(self, indices: Sequence[int], *, rounding: bool) -> Curve | None:
        engine, hypothesis = self.engine, self.result.final.hypothesis
        effects = [hypothesis.terms[index].effect for index in indices]
        beside = self.beside(indices, rounding=rounding)
        explained_ss = beside.chi_square - self.beside((), rounding=rounding).chi_square
        # Initial states of runs are not parameters of the law; they carry no penalty here.
        net_gain = explained_ss - engine.penalty_per_parameter * sum(
            Coordinates(effect).n_parameters for effect in effects
        )
        outputs = sorted({output for effect in effects for output in effect.outputs})
        curve = best_curve(engine.regression, beside, outputs, engine.penalty_per_parameter)
        # What is certainly there is no chance deviation of the right formula.
        slight = _SLIGHT_OF_MORE if self.result.lack_of_fit else _SLIGHT
        margin = engine.penalty_per_parameter + slight * explained_ss
        return curve if curve and curve.net_gain > net_gain + margin else None


def _words(terms: Sequence[Term], doubted: Sequence[Term], curve: Curve) -> str:
    """Note with the reason for withheld names."""
    than = "" if len(doubted) == len(terms) else f" than {_names(doubted)}"
    return f"closest, but not named: {_names(terms)}; {_over(curve)} explains more{than}"


def _over(curve: Curve) -> str:
    place, variable = curve.place.replace("_", " "), curve.variable.replace("_", " ")
    return f"an unknown curve of the {place} over the {variable}"


def _names(terms: Sequence[Term]) -> str:
    return ", ".join(term.label for term in terms)

"""Whether the law of a step is open: a free curve explains clearly more, in its place or beside it.

The curves are polynomials, linear splines, kinks and powers over one variable. They also show
whether anything in a residual is predictable at all.

References
----------
Hart, J. D. (1997). Nonparametric Smoothing and Lack-of-Fit Tests. Springer.
"""

from __future__ import annotations

from collections.abc import Collection, Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Folds
from winchkit.diagnosis.regression.cross_validation import AT_NOISE, excess, held_out_rms
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.curve_fits import FittedCurve, PartialRegression, ranked_curves
from winchkit.diagnosis.verdict.spline_alternatives import PLACES, curves
from winchkit.effects.term import Term
from winchkit.quantity_text import percent

MARGIN = 0.1
"""Share of what a step explains by which a curve must explain more; see docs/methods.md."""
_TRIED = 3
"""Curves that are tested on held-out data, those of the largest gain."""
_FAR_ABOVE = 2.0
"""Ratio of an error to its noise above which a tenth of what is left is a part of a law: half of
the error and more is no noise."""
_CURVES_OVER: Mapping[str, tuple[str, ...]] = {
    "direction": ("speed",),
    "drum_angle": ("motor_angle",),
    "load": ("load", "tension"),
}
"""Variables of curves that contain the laws over another variable; others are their own."""


@dataclass(frozen=True)
class OpenLaw:
    """A curve that speaks against a law, and why in words."""

    curve: FittedCurve
    text: str


def open_law(
    engine: TimeSeriesSelection, final: Fit, noise: BandNoise, index: int
) -> OpenLaw | None:
    """A curve that speaks against the law of the term at ``index``, in its place or beside it."""
    return _better(engine, final, noise, index) or _beside(engine, final, noise, index)


def variables_of_law(term: Term) -> frozenset[str]:
    """Variables of the curves that contain the law of a term, by its place."""
    over = [variable for _, _, variable in term.effect.place if variable]
    return frozenset(curve for v in over for curve in _CURVES_OVER.get(v, (v,)))


def _beside(
    engine: TimeSeriesSelection, final: Fit, noise: BandNoise, index: int
) -> OpenLaw | None:
    """A curve over the law's own variable that explains a tenth of what is left far above the
    noise.

    What is left belongs to the law, and its values contain a part of it, unless a curve over
    another variable explains more: at one speed a file the angle follows the speed.
    """
    term = final.hypothesis.terms[index]
    outputs, over = sorted(term.effect.outputs), variables_of_law(term)
    regression, folds = engine.regression, engine.folds(final, noise)
    size: Mapping[str, float | None] = {o: noise.rms[o] for o in outputs if o in noise.rms}
    present = _errors(regression, final, noise, folds, size)
    if not (over and noise.from_repeats and _is_above(present, size, _FAR_ABOVE)):
        return None
    partial = PartialRegression(final.residual, final.jacobian, noise.inverse_sigma(regression))
    price = engine.penalty_per_parameter
    left = excess(present, size)
    for curve in ranked_curves(regression, partial, outputs, price)[:1]:
        if curve.variable not in over or curve.net_gain <= 0.0:
            return None
        errors = _errors(regression, _with_curve(regression, final, curve), noise, folds, size)
        if (share := 1 - excess(errors, size) / left) > MARGIN:
            return OpenLaw(
                curve,
                f"a curve over {curve.words} beside it explains {percent(share)} of what is left: "
                "the law is another one, and its values contain a part of that",
            )
    return None


def at_places(over: Collection[str]) -> frozenset[tuple[str, str]]:
    """Every place of a curve over some variables."""
    return frozenset((place, variable) for place in PLACES for variable in over)


def _better(
    engine: TimeSeriesSelection, final: Fit, noise: BandNoise, index: int
) -> OpenLaw | None:
    """A curve that explains more than the term at ``index``, in its place.

    It explains more by a tenth, in sample (beyond a penalty of ln n for every parameter) and held
    out, since a curve that contains the law explains about as much; or it reaches the noise of
    repeats where the law does not.
    """
    outputs: list[str] = sorted(final.hypothesis.terms[index].effect.outputs)
    regression, folds = engine.regression, engine.folds(final, noise)
    size: Mapping[str, float | None] = {o: noise.rms[o] for o in outputs if o in noise.rms}
    present = _errors(regression, final, noise, folds, size)
    lacking = noise.from_repeats and _is_above(present, size)
    found = _screened(
        engine, final, noise, index=index, outputs=outputs, margin=0.0 if lacking else MARGIN
    )
    if not found:
        return None
    without = _without(regression, final, index)
    errors = [
        _errors(regression, one, noise, folds, size)
        for one in (without, final, *(_with_curve(regression, without, c) for c in found))
    ]
    alone, own, *others = (excess(error, size) for error in errors)
    explained = alone - own
    best = min(range(len(found)), key=others.__getitem__)
    gained = own - others[best]
    reaches = lacking and not _is_above(errors[2 + best], size)
    if explained <= 0.0 or (gained <= MARGIN * explained and not reaches):
        return None
    more = "reaches the noise, which this law does not"
    if gained > explained:
        more = f"explains {1 + gained / explained:.2g} times as much"
    elif gained > MARGIN * explained:
        more = f"explains {percent(gained / explained)} more"
    curve = found[best]
    return OpenLaw(curve, f"a free curve over {curve.words} {more}: the law is another one")


def _is_above(
    errors: Mapping[str, float], noise: Mapping[str, float | None], ratio: float = AT_NOISE
) -> bool:
    """Whether some error is above its noise by a ratio."""
    return any(size and errors[name] > ratio * size for name, size in noise.items())


def predictable_share(
    engine: TimeSeriesSelection, final: Fit, noise: BandNoise, size: Mapping[str, float | None]
) -> float:
    """Largest share of what a model leaves that a free curve predicts on held-out data."""
    regression, folds = engine.regression, engine.folds(final, noise)
    partial = PartialRegression(final.residual, final.jacobian, noise.inverse_sigma(regression))
    ranked = ranked_curves(regression, partial, regression.outputs, engine.penalty_per_parameter)[
        :_TRIED
    ]
    left = excess(held_out_rms(regression, final, noise, folds), size)
    if not left:
        return 0.0
    shares = [
        1
        - excess(held_out_rms(regression, _with_curve(regression, final, c), noise, folds), size)
        / left
        for c in ranked
        if c.net_gain > 0.0
    ]
    return max(shares, default=0.0)


def _screened(
    engine: TimeSeriesSelection,
    final: Fit,
    noise: BandNoise,
    *,
    index: int,
    outputs: Sequence[str],
    margin: float,
) -> list[FittedCurve]:
    """Curves whose gain exceeds that of a term by the margin in sample, the largest first. The
    coarse regression, which has all frequencies of a slow curve, is screened before all samples
    are.
    """
    coarse = engine.coarse
    if coarse is not None:
        weights = coarse.inverse_sigma(noise)
        at = fit(coarse.regression, coarse.reduced(final.hypothesis), weights, 0)
        found = _above(
            coarse.regression, at, weights, index=index, outputs=outputs, penalty=0.0, margin=margin
        )
        if not found:
            return []
    weights = noise.inverse_sigma(engine.regression)
    penalty = engine.penalty_per_parameter
    return _above(
        engine.regression,
        final,
        weights,
        index=index,
        outputs=outputs,
        penalty=penalty,
        margin=margin,
    )


def _above(
    regression: TimeSeriesRegression,
    final: Fit,
    weights: Array,
    *,
    index: int,
    outputs: Sequence[str],
    penalty: float,
    margin: float,
) -> list[FittedCurve]:
    without = _without(regression, final, index)
    partial = PartialRegression(without.residual, without.jacobian, weights)
    own = PartialRegression(final.residual, final.jacobian, weights)
    least = (1 + margin) * (partial.chi_square - own.chi_square)
    ranked = ranked_curves(regression, partial, outputs, penalty)
    return [curve for curve in ranked if curve.net_gain > least][:_TRIED]


def _errors(
    regression: TimeSeriesRegression,
    model: Fit,
    noise: BandNoise,
    folds: Folds,
    outputs: Container[str],
) -> dict[str, float]:
    errors = held_out_rms(regression, model, noise, folds)
    return {output: error for output, error in errors.items() if output in outputs}


def _without(regression: TimeSeriesRegression, final: Fit, index: int) -> Fit:
    """A fit without one term, the others at their values, to be corrected in linear steps."""
    hypothesis = final.hypothesis.without(index)
    change = regression.change(final.hypothesis) - regression.change(hypothesis)
    others: NDArray[np.bool_] = ~regression.unknowns_of(index, final.hypothesis)
    jacobian = final.jacobian[:, others]
    return replace(
        final,
        hypothesis=hypothesis,
        vector=final.vector[others],
        residual=final.residual + change,
        derivative=lambda: jacobian,
        n_unknowns=int(np.count_nonzero(others)),
    )


def _with_curve(regression: TimeSeriesRegression, model: Fit, curve: FittedCurve) -> Fit:
    """A fit with the columns of a curve as further unknowns, before its initial states."""
    place = curve.place, curve.variable
    (family,) = curves(regression, list(PLACES[curve.place]), {place})
    columns = np.zeros((regression.n_rows, curve.law.shape[1]))
    for rows, signal in family.columns(regression):
        columns[rows] = (curve.law.T @ signal).T
    states = sum(len(start) for start in model.hypothesis.starts)
    at = model.jacobian.shape[1] - states
    jacobian = np.hstack([model.jacobian[:, :at], columns, model.jacobian[:, at:]])
    return replace(model, derivative=lambda: jacobian)

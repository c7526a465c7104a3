"""Statistics of the reported model: χ² with its degrees of freedom, values, and correlations."""

from __future__ import annotations

from math import isfinite

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.conditioning import value_covariance
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.intervals import Spread, estimates
from winchkit.diagnosis.regression.noise import BandNoise
from winchkit.diagnosis.results import Estimate
from winchkit.diagnosis.verdict.plausibility import plausible_range
from winchkit.effects.effect import Parameter
from winchkit.effects.term import Term
from winchkit.fit_statistics import FitStatistics, FittedParameter, correlations_of
from winchkit.schema.profiles.winch import WinchProfile


def fit_statistics(
    regression: Regression,
    initial: Fit,
    fit: Fit,
    noise: BandNoise,
    spread: Spread,
    *,
    profile: WinchProfile | None = None,
) -> FitStatistics | None:
    """Statistics of the reported model: the effects of ``initial``, then the named ones; None
    without unknowns. A scanned order counts as an unknown, as in the selection.
    """
    if not len(fit.vector):
        return None
    covariance = value_covariance(regression, fit, noise)
    inverse_sigma = noise.inverse_sigma(regression)
    source = "repeats" if noise.from_repeats else "the residual beside all candidate effects"
    scanned = sum(p.whole for term in fit.hypothesis.terms for p in term.effect.parameters)
    runs = f"{regression.n_runs} runs, " if regression.motions else ""
    return FitStatistics(
        correlations=correlations_of(covariance.names, covariance.matrix),
        condition=covariance.condition,
        method=f"generalised least squares (trust region), noise from {source}",
        data=runs + ", ".join(output.replace("_", " ") for output in regression.outputs),
        n_observations=regression.n_observations + regression.n_priors,
        n_unknowns=len(fit.vector) + scanned,
        chi_square=_chi_square(fit.residual, inverse_sigma),
        initial_chi_square=_chi_square(initial.residual, inverse_sigma),
        parameters=(
            *_nuisances(regression, fit, spread),
            *_values(regression, initial, fit, spread, profile),
        ),
        converged=fit.converged,
        iterations=fit.iterations,
        rank=fit.rank + scanned,
    )


def _chi_square(residual: Array, inverse_sigma: Array) -> float:
    whitened = residual * inverse_sigma
    return float(whitened @ whitened)


def _nuisances(regression: Regression, fit: Fit, spread: Spread) -> list[FittedParameter]:
    return [
        FittedParameter(
            name,
            float(fit.vector[index]),
            float(spread.std[index]),
            "m" if index == 0 and regression.fits_offset else "",
            0.0,
            (float(spread.low[index]), float(spread.high[index])),
        )
        for index, name in enumerate(regression.nuisance_names)
    ]


def _values(
    regression: Regression,
    initial: Fit,
    fit: Fit,
    spread: Spread,
    profile: WinchProfile | None,
) -> list[FittedParameter]:
    """Values of every effect; the effects of the profile come first and have its values."""
    own = initial.hypothesis.terms
    return [
        _value(term, name, estimate, before[name], profile)
        for index, (term, values) in enumerate(estimates(regression, fit, spread))
        for known in [index < len(own) and own[index].effect.id == term.effect.id]
        for before in [own[index].values if known else term.effect.null]
        for name, estimate in values.items()
    ]


def _value(
    term: Term, name: str, estimate: Estimate, initial: float, profile: WinchProfile | None
) -> FittedParameter:
    parameter = term.effect.parameter(name)
    return FittedParameter(
        f"{term.label}.{name}",
        estimate.value,
        estimate.std,
        estimate.unit,
        initial,
        estimate.interval,
        _range(parameter, profile),
        _at_bound(parameter, estimate.value),
    )


def _range(parameter: Parameter, profile: WinchProfile | None) -> tuple[float, float] | None:
    """Plausible range, or the bounds of the fit where one of them is finite."""
    known = plausible_range(parameter, profile)
    if known is not None:
        return known[:2]
    bounds = parameter.low, parameter.high
    return bounds if any(map(isfinite, bounds)) else None


def _at_bound(parameter: Parameter, value: float) -> str:
    ends = {"low": parameter.low, "high": parameter.high}
    near = [name for name, end in ends.items() if isfinite(end) and np.isclose(value, end)]
    return f"at its {near[0]} bound" if near else ""

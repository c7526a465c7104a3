"""How sure fitted values are: block jackknife beside the covariance of the whitened fit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.fit import Fit
from winchkit.diagnosis.gate import Folds, left_out_steps
from winchkit.diagnosis.noise import Noise
from winchkit.diagnosis.problem import Problem
from winchkit.diagnosis.result import Estimate
from winchkit.effects.bind import Term
from winchkit.effects.coordinates import Coordinates
from winchkit.effects.effect import Parameter

__all__ = ["estimates", "unknown_std"]

Array = NDArray[np.float64]


def unknown_std(problem: Problem, fit: Fit, noise: Noise, blocks: Folds) -> Array:
    """Standard deviation of every unknown: the larger of jackknife and whitened covariance.

    Never the covariance of independent residuals: they are correlated.
    """
    whitened = fit.jacobian * noise.weight(problem)[:, None]
    normal = whitened.T @ whitened
    covariance = np.sqrt(np.maximum(np.diag(np.linalg.pinv(normal, rcond=1e-12)), 0.0))
    steps = left_out_steps(problem, fit, noise, blocks)
    n = blocks.count
    jackknife = np.sqrt((n - 1) / n * np.sum((steps - steps.mean(axis=0)) ** 2, axis=0))
    return np.asarray(np.maximum(covariance, jackknife))


def estimates(problem: Problem, fit: Fit, std: Array) -> list[tuple[Term, dict[str, Estimate]]]:
    """Every term of a fit with its values, standard deviations and units."""
    at = problem.nuisance_columns.shape[1]
    out = []
    for term in fit.hypothesis.terms:
        coordinates = Coordinates(term.effect)
        part = slice(at, at + len(coordinates))
        at += len(coordinates)
        deviation = coordinates.deviations(fit.vector[part], std[part], term.values)
        out.append(
            (
                term,
                {
                    p.name: Estimate(term.values[p.name], _believed(deviation, p), p.unit)
                    for p in term.effect.parameters
                    if p.name in deviation or p.whole
                },
            )
        )
    return out


def _believed(deviation: Mapping[str, float], parameter: Parameter) -> float:
    """Standard deviation of a value; NaN where the data leave it anywhere within its bounds."""
    std = deviation.get(parameter.name, 0.0)
    return float("nan") if std >= parameter.high - parameter.low else std

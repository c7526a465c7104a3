"""Variance components: the standard deviation of each kind of measurement from residuals.

Helmert's estimate in Förstner's iterative form. With whitened residuals v of a kind and their
redundancy numbers 1 − h (h: leverage, the share of an equation that the fit uses up)

    σ² ← σ² Σ v² / Σ (1 − h)

repeated with new weights until it settles: the sum of squares of a kind then equals the number of
its equations that the fit leaves free. A kind with hardly any redundancy keeps its value.

References
----------
F. R. Helmert, *Die Ausgleichungsrechnung nach der Methode der kleinsten Quadrate*, 1907.
W. Förstner, *Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten*, AVN 86, 1979.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array

START: Mapping[str, float] = {
    "closure": 5e-5,
    "position": 5e-5,
    "rotation": 2e-3,
    "swivel": 2e-3,
    "cable_length": 1e-4,
    "balance": 1.0,
}
"""Standard deviations at the start of the iteration, m, rad and N, by kind of constraint (rules of
thumb: a laser tracker, a drum's encoder, angles by a tracker, a load cell)."""

_LEAST_SHARE = 0.02
"""Least redundancy of a kind as a share of its equations: below it rounding decides."""


@dataclass(frozen=True)
class Component:
    """Estimate of one kind's standard deviation."""

    sigma: float
    """SI."""
    redundancy: float
    """Σ (1 − h), degrees of freedom."""


def re_estimated(
    sigma: float, residual: Array, leverage: Array, *, least_redundancy: float, least: float
) -> Component:
    """One step of the iteration for one kind of measurement.

    ``sigma``: standard deviation by which the residuals were divided, SI. ``residual`` (m,).
    ``leverage`` (m,): their leverages, 0 to 1. ``least_redundancy``: degrees of freedom below which
    ``sigma`` is kept; it is also kept below 2 % of m. ``least``: lower limit of the estimate, SI.
    """
    free = float(np.sum(1 - leverage))
    if free < max(least_redundancy, _LEAST_SHARE * len(residual)):
        return Component(sigma, free)
    variance = float(np.sum(residual**2)) / free
    return Component(max(sigma * float(np.sqrt(variance)), least), free)

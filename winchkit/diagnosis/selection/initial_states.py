"""Initial-condition check: whether an effect with memory explains only by its initial states.

A free initial state per run is confounded with an offset per run: a creep with a time constant much
longer than the run fits any dependence on the load.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.projection import partialled_out
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term

__all__ = ["explained_by_initial_states"]

_BY_ITSELF = 0.5


def explained_by_initial_states(
    regression: Regression,
    base: Fit,
    fitted: Fit,
    inverse_sigma: Array,
    penalty_per_parameter: float,
) -> bool:
    """Whether the last effect of a fit explains mainly by its initial states.

    Parameters
    ----------
    regression
        The data and the model.
    base
        Fit without the effect.
    fitted
        Fit with it.
    inverse_sigma
        1/σ of every row, shape (n_rows,).
    penalty_per_parameter
        ln n.

    Notes
    -----
    False where the effect explains, starting from rest in every run, at least half of its χ² and at
    least as much as one offset per run; also where its χ² beyond offsets per run exceeds the
    penalty of all its parameters and states, as under a load that is constant for long.
    """
    known, left = base.jacobian * inverse_sigma[:, None], base.residual * inverse_sigma
    gain = base.chi_square - fitted.chi_square
    column = partialled_out(known, _from_rest(regression, fitted.hypothesis) * inverse_sigma)
    alone = (column @ left) ** 2 / max(float(column @ column), 1e-300)
    by_itself = bool(alone >= _BY_ITSELF * gain)
    levels = _levels(regression, fitted.hypothesis)
    if levels is None:
        return not by_itself
    flat = partialled_out(np.column_stack([known, levels * inverse_sigma[:, None]]), left)
    if by_itself and alone >= left @ left - flat @ flat:
        return False
    hypothesis = fitted.hypothesis
    owed = Coordinates(hypothesis.terms[-1].effect).n_parameters + len(hypothesis.starts[-1])
    return float(flat @ flat) - fitted.chi_square < penalty_per_parameter * owed


def _from_rest(regression: Regression, hypothesis: Hypothesis) -> Array:
    """Change of the prediction by the last effect with zero initial states, shape (n_rows,)."""
    rested = replace(hypothesis, starts=(*hypothesis.starts[:-1], ()))
    return regression.change(rested) - regression.change(
        hypothesis.without(len(hypothesis.terms) - 1)
    )


def _levels(regression: Regression, hypothesis: Hypothesis) -> Array | None:
    """Derivatives by the initial states at the largest time constant, shape (n_rows, n_runs).

    None for an effect without a time constant.
    """
    term, start = hypothesis.terms[-1], hypothesis.starts[-1]
    slow = {p.name: p.high for p in term.effect.parameters if p.role == "shape" and p.unit == "s"}
    if not slow:
        return None
    still = Term(term.effect, {**term.values, **slow})
    frozen = replace(hypothesis, terms=(*hypothesis.terms[:-1], still))
    return regression.jacobian(regression.vector(frozen), frozen)[:, -len(start) :]

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

_LEAST_SHARE_FROM_REST = 0.5
"""Share of its explained χ² that an effect with memory must explain from rest; screened."""


def explained_by_initial_states(
    regression: Regression,
    base: Fit,
    fitted: Fit,
    inverse_sigma: Array,
    penalty_per_parameter: float,
) -> bool:
    """Whether the last effect of a fit explains mainly by its initial states.

    It does not where it explains, from rest in every run, half of its χ² and as much as an offset
    per run; nor where its χ² beyond such offsets exceeds the penalty of all its parameters and
    states, as under a load that is constant for long.
    """
    known, residual = base.jacobian * inverse_sigma[:, None], base.residual * inverse_sigma
    gain = base.chi_square - fitted.chi_square
    column = partialled_out(known, _from_rest(regression, fitted.hypothesis) * inverse_sigma)
    from_rest_ss = (column @ residual) ** 2 / max(float(column @ column), 1e-300)
    mainly_from_rest = bool(from_rest_ss >= _LEAST_SHARE_FROM_REST * gain)
    level_columns = _levels(regression, fitted.hypothesis)
    if level_columns is None:
        return not mainly_from_rest
    remainder = partialled_out(
        np.column_stack([known, level_columns * inverse_sigma[:, None]]), residual
    )
    if mainly_from_rest and from_rest_ss >= residual @ residual - remainder @ remainder:
        return False
    hypothesis = fitted.hypothesis
    n_unknowns = Coordinates(hypothesis.terms[-1].effect).n_parameters + len(hypothesis.starts[-1])
    return float(remainder @ remainder) - fitted.chi_square < penalty_per_parameter * n_unknowns


def _from_rest(regression: Regression, hypothesis: Hypothesis) -> Array:
    """Change of the prediction by the last effect with zero initial states, shape (n_rows,)."""
    from_rest = replace(hypothesis, starts=(*hypothesis.starts[:-1], ()))
    return regression.change(from_rest) - regression.change(
        hypothesis.without(len(hypothesis.terms) - 1)
    )


def _levels(regression: Regression, hypothesis: Hypothesis) -> Array | None:
    """Derivatives by the initial states at the largest time constant, shape (n_rows, n_runs); None
    for an effect without one.
    """
    term, start = hypothesis.terms[-1], hypothesis.starts[-1]
    largest = {
        p.name: p.high for p in term.effect.parameters if p.role == "shape" and p.unit == "s"
    }
    if not largest:
        return None
    slow_term = Term(term.effect, {**term.values, **largest})
    slow_hypothesis = replace(hypothesis, terms=(*hypothesis.terms[:-1], slow_term))
    return regression.jacobian(regression.vector(slow_hypothesis), slow_hypothesis)[
        :, -len(start) :
    ]

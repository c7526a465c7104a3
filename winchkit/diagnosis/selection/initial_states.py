"""Whether an effect with a memory explains by how it goes on, or only by how the runs began.

A free state per run is a free level per load: creep far slower than the runs would explain
whatever depends on the load. What remembers must show by how it changes.
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
    """Whether the last term of a fit, which ``base`` lacks, needs its states too much.

    It does not where it explains half of what it does from rest in every run, and no less than a
    level per run would: a ramp from zero is three quarters level. Nor, as on a bench under a load
    that hangs for long, where it pays for all its numbers by more than levels do.
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
    """What the last term adds where every run begins at rest, rows."""
    rested = replace(hypothesis, starts=(*hypothesis.starts[:-1], ()))
    return regression.change(rested) - regression.change(
        hypothesis.without(len(hypothesis.terms) - 1)
    )


def _levels(regression: Regression, hypothesis: Hypothesis) -> Array | None:
    """What the last term's states explain if nothing moves within a run, (rows, runs).

    None for an effect without a time constant: how far it moved is not a matter of time.
    """
    term, start = hypothesis.terms[-1], hypothesis.starts[-1]
    slow = {p.name: p.high for p in term.effect.parameters if p.role == "shape" and p.unit == "s"}
    if not slow:
        return None
    still = Term(term.effect, {**term.values, **slow})
    frozen = replace(hypothesis, terms=(*hypothesis.terms[:-1], still))
    return regression.jacobian(regression.vector(frozen), frozen)[:, -len(start) :]

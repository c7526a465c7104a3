"""Findings on the residual of a diagnosis: causes that are no effect of the machine."""

from __future__ import annotations

from winchkit.arrays import Array
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.common_force import common_force
from winchkit.diagnosis.residuals.outlying_run import outlying_runs
from winchkit.diagnosis.residuals.unresolved_acceleration import unresolved_acceleration
from winchkit.runs.sanity.finding import Finding

_ANSWERED = frozenset({"adequate", "explained"})
"""Verdicts beside which the profile's error has its cause."""


def findings(
    regression: TimeSeriesRegression, verdict: str, before: Array, after: Array
) -> tuple[Finding, ...]:
    """Findings on the residuals (n_rows,) of the profile and of the final model."""
    found = unresolved_acceleration(regression, after)
    if verdict not in _ANSWERED:
        found += (*common_force(regression, before), *outlying_runs(regression, before))
    return found

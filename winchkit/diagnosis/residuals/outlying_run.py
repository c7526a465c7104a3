"""Outlying run: one that has nearly all of an output's squared error, while the others agree."""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.quantity_text import significant
from winchkit.runs.sanity.finding import Finding

OUTLYING = "outlying-run"
"""Code of the finding."""
_LEAST_RUNS = 3
"""Of two runs either may be the wrong one."""
_RATIO = 30.0
"""Mean square of a run over the largest of the others: errors in proportion to the load differ by
the square of the ratio of the loads, which is five at most in practice."""


def outlying_runs(regression: TimeSeriesRegression, residual: Array) -> tuple[Finding, ...]:
    """Findings on runs with a residual (n_rows,) far above that of every other run."""
    found = []
    for output in regression.outputs:
        own = [segment for segment in regression.segments if segment.output == output]
        squares = np.array([np.mean(residual[segment.rows] ** 2) for segment in own])
        worst = int(np.argmax(squares))
        others = float(np.max(np.delete(squares, worst), initial=0.0))
        if len(own) < _LEAST_RUNS or not squares[worst] > _RATIO * others:
            continue
        ratio = float(np.sqrt(squares[worst] / others)) if others else float("inf")
        text = (
            f"its error is {significant(ratio, 2)} times that of any other run: check whether the "
            "column belongs to this run, and what changed; leave the run out, or record it again"
        )
        name = regression.dataset.recordings[own[worst].run].name
        found.append(Finding(OUTLYING, name, output, ratio, text))
    return tuple(found)

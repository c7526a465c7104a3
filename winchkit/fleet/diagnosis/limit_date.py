"""Date at which a trend reaches a limit, with a confidence interval by Fieller's theorem.

References
----------
Fieller, E. C. (1954). Some problems in interval estimation. J. R. Stat. Soc. B 16, 175-185.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from winchkit.fleet.diagnosis.changes import ParameterSeries
from winchkit.fleet.diagnosis.robust_variance import Variance


@dataclass(frozen=True)
class LimitDate:
    """Date at which the line through the estimates crosses a limit, s since 1970."""

    limit: float
    """SI."""
    date: float
    """Before the last session where the limit was passed already."""
    earliest: float
    """End of the 95 % confidence set."""
    latest: float


def limit_date(series: ParameterSeries, between: Variance, limit: float) -> LimitDate | None:
    """Date at which the trend of a series reaches a limit, SI, not zero; None where its rate leaves
    none.

    With the line a + b (t − t̄) the 95 % set of dates is that of all t at which (a + b (t − t̄) −
    limit)² ≤ q² Var(a + b (t − t̄)): an interval where b differs from zero at 5 %, otherwise
    unbounded, which is no date. A line towards zero reaches no limit. q is the quantile of t with
    the degrees of freedom of τ².
    """
    weight = 1 / (series.stds**2 + between.value)
    centre = float(np.average(series.times, weights=weight))
    t = series.times - centre
    var_a, var_b = 1 / weight.sum(), 1 / (weight @ t**2)
    gap = limit - float(np.average(series.values, weights=weight))
    slope = float(weight @ (t * series.values)) * var_b
    square = float(stdtrit(between.dof, 0.975)) ** 2
    # (b² − q² var_b) u² − 2 gap b u + gap² − q² var_a = 0, with u = t − t̄.
    first, last = slope**2 - square * var_b, gap**2 - square * var_a
    if first <= 0 or slope * limit <= 0:
        return None
    root = np.sqrt(max(gap**2 * slope**2 - first * last, 0.0))
    ends = (gap * slope - root) / first, (gap * slope + root) / first
    date, earliest, latest = (centre + float(u) for u in (gap / slope, *ends))
    return LimitDate(limit, date, earliest, latest)

"""Date at which a trend reaches a limit: the closed form, and coverage by simulation."""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.fleet.diagnosis.changes import ParameterSeries
from winchkit.fleet.diagnosis.limit_date import limit_date
from winchkit.fleet.diagnosis.robust_variance import Variance

KNOWN = Variance(0.0, np.inf)


def line(slope: float, noise: np.ndarray | float = 0.0) -> ParameterSeries:
    times = np.arange(12.0)
    return ParameterSeries(times, slope * times + noise, np.ones(12))


def test_a_line_reaches_its_limit_at_the_quotient() -> None:
    found = limit_date(line(2.0), KNOWN, 40.0)
    assert found is not None
    assert found.date == pytest.approx(20.0)
    assert found.earliest < 20.0 < found.latest
    # Delta method, exact in the limit of a small relative error of the slope.
    sxx = np.sum((np.arange(12) - 5.5) ** 2)
    std = np.sqrt(1 / 12 + 14.5**2 / sxx) / 2.0
    assert (found.latest - found.earliest) / (2 * 1.96 * std) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("slope", "limit"), [(0.05, 40.0), (2.0, -40.0), (-2.0, 40.0)])
def test_a_slope_that_is_not_significant_or_leads_away_gives_no_date(
    slope: float, limit: float
) -> None:
    assert limit_date(line(slope), KNOWN, limit) is None


def test_the_interval_covers_the_date_in_95_of_100() -> None:
    random = np.random.default_rng(2)
    inside = [
        found is not None and found.earliest <= 20.0 <= found.latest
        for found in (
            limit_date(line(0.5, random.normal(size=12)), KNOWN, 10.0) for _ in range(600)
        )
    ]
    assert 0.925 <= np.mean(inside) <= 0.975

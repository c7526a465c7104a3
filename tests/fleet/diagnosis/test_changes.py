"""Changes over sessions and the date of a limit: closed forms, enumeration and a simulated null."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest, norm

from winchkit.fleet.diagnosis.changes import ParameterSeries, change_of, session_variance, step_date
from winchkit.fleet.diagnosis.limit_date import limit_date
from winchkit.fleet.diagnosis.robust_variance import Variance, robust_variance

DAY = 86400.0
KNOWN = Variance(0.0, np.inf)


def series(values: np.ndarray, std: float = 1.0, days: np.ndarray | None = None) -> ParameterSeries:
    times = DAY * (np.arange(len(values)) if days is None else days)
    return ParameterSeries(np.asarray(times, dtype=float), values, np.full(len(values), std))


def test_a_step_without_noise_has_its_size_place_and_closed_form_p_value() -> None:
    values = np.where(np.arange(10) < 6, 1.0, 4.0)
    change = change_of(series(values), KNOWN)
    assert change is not None
    assert change.date is not None
    assert change.kind == "step"
    assert change.size == pytest.approx(3.0)
    assert change.size_std == pytest.approx(np.sqrt(1 / 6 + 1 / 4))
    assert (change.level_before, change.level) == pytest.approx((1.0, 4.0))
    z = 3.0 / np.sqrt(1 / 6 + 1 / 4)
    assert change.p_value == pytest.approx(10 * 2 * norm.sf(z), rel=1e-6)
    assert change.date.probabilities.argmax() == 5


def test_a_line_is_a_trend_with_the_slope_of_ordinary_least_squares() -> None:
    days = np.array([0.0, 1.0, 2.0, 5.0, 9.0, 10.0, 12.0, 20.0])
    values = 3.0 + 0.8 * days
    change = change_of(series(values, days=days), KNOWN)
    assert change is not None
    assert change.kind == "trend"
    assert change.date is None
    assert change.slope * DAY == pytest.approx(0.8)
    assert change.slope_std * DAY == pytest.approx(1 / np.sqrt(np.sum((days - days.mean()) ** 2)))
    assert change.rival_p_value < 0.05


def test_the_posterior_of_the_date_is_that_of_an_integral_over_level_and_height() -> None:
    random = np.random.default_rng(5)
    values = random.normal(size=6) + np.where(np.arange(6) < 3, 0.0, 1.5)
    days = np.array([0.0, 1.0, 3.0, 4.0, 9.0, 10.0])
    found = step_date(series(values, days=days), KNOWN)
    grid = np.linspace(-12, 12, 241)
    level, height = np.meshgrid(grid, grid)
    mass = []
    for k in range(1, 6):
        shape = (np.arange(6) >= k).astype(float)
        squares = sum((y - level - height * x) ** 2 for y, x in zip(values, shape, strict=True))
        mass.append((days[k] - days[k - 1]) * np.exp(-squares / 2).sum())
    assert found.probabilities == pytest.approx(np.array(mass) / sum(mass), rel=1e-6)
    assert 0 <= found.earliest <= found.date <= found.latest <= 10 * DAY


def test_the_interval_of_the_date_covers_it() -> None:
    random = np.random.default_rng(6)
    inside = 0
    for _ in range(300):
        when = random.uniform(0, 19)
        values = random.normal(size=20) + np.where(np.arange(20) > when, 2.0, 0.0)
        found = step_date(series(values), KNOWN)
        inside += found.earliest <= when * DAY <= found.latest
    assert 0.92 <= inside / 300 <= 0.98


def test_p_values_without_a_change_are_valid_with_an_estimated_session_variance() -> None:
    random = np.random.default_rng(7)
    p = []
    for _ in range(60):
        fleet = [series(random.normal(size=12) * np.hypot(1.0, 0.7)) for _ in range(10)]
        between = session_variance(fleet)
        p += [c.p_value for one in fleet if (c := change_of(one, between)) is not None]
    for level in (0.01, 0.05, 0.1):
        assert np.mean(np.array(p) < level) <= level + 2 * np.sqrt(level / len(p))


def test_the_kind_that_is_right_is_rejected_in_one_of_twenty() -> None:
    random = np.random.default_rng(8)
    rejected = kinds = 0
    for _ in range(150):
        change = change_of(series(random.normal(size=16) + 0.6 * np.arange(16)), KNOWN)
        assert change is not None
        kinds += 1
        rejected += change.kind == "step" and change.rival_p_value < 0.05
    assert rejected / kinds <= 0.09


def test_fewer_than_four_sessions_are_no_test() -> None:
    assert change_of(series(np.array([0.0, 0.0, 9.0])), KNOWN) is None


def test_the_robust_variance_is_consistent_and_has_the_stated_degrees_of_freedom() -> None:
    random = np.random.default_rng(9)
    known = random.uniform(0.2, 2.0, 4000)
    assert robust_variance(random.normal(size=4000) * np.sqrt(known + 3.0), known).value == (
        pytest.approx(3.0, rel=0.15)
    )
    draws = [robust_variance(random.normal(size=200), np.zeros(200)) for _ in range(400)]
    # The variance of a scaled χ²(ν)/ν is 2/ν.
    assert np.var([d.value for d in draws]) == pytest.approx(2 / draws[0].dof, rel=0.25)


def test_outlying_series_do_not_inflate_the_session_variance() -> None:
    random = np.random.default_rng(10)
    steps = [np.where(np.arange(24) < 12, 0.0, 1e3 * (w % 2)) for w in range(40)]
    fleet = [series(random.normal(size=24) * np.sqrt(2.0) + step) for step in steps]
    assert session_variance(fleet).value == pytest.approx(1.0, abs=0.35)


def test_z_of_a_fixed_date_is_normal() -> None:
    random = np.random.default_rng(11)
    z = []
    for _ in range(300):
        values = random.normal(size=8) + np.where(np.arange(8) < 4, 0.0, 50.0)
        change = change_of(series(values), KNOWN)
        assert change is not None
        z.append((change.size - 50.0) / change.size_std)
    assert kstest(z, norm.cdf).pvalue > 0.01


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

"""Partial pooling and odd winches: closed forms of the balanced case, and a simulated null."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from winchkit.fleet.diagnosis.partial_pooling import odd_p_values, partial_pooling


@pytest.mark.parametrize("seed", range(5))
def test_equal_variances_give_the_analysis_of_variance(seed: int) -> None:
    random = np.random.default_rng(seed)
    values, std = random.normal(5.0, 2.0, 9), 0.8
    found = partial_pooling(values, np.full(9, std))
    between = max(0.0, float(np.var(values, ddof=1)) - std**2)
    assert found.between_std**2 == pytest.approx(between, rel=1e-4)
    assert found.common == pytest.approx(values.mean())
    assert found.common_std == pytest.approx(np.sqrt((between + std**2) / 9), rel=1e-4)
    share = between / (between + std**2)
    assert found.pooled == pytest.approx(values.mean() + share * (values - values.mean()), rel=1e-4)


def test_homogeneous_winches_are_pooled_completely() -> None:
    found = partial_pooling(np.array([1.0, 1.01, 0.99, 1.0]), np.full(4, 0.5))
    assert found.between_std == 0.0
    assert found.pooled == pytest.approx(np.full(4, 1.0))
    # v/4 of the mean and 2 · 2 v/4 of τ² exceed v, that of the own estimate.
    assert found.pooled_std == pytest.approx(np.full(4, 0.5))


def test_the_error_of_a_pooled_value_is_that_of_prasad_and_rao() -> None:
    found = partial_pooling(np.full(40, 1.0), np.full(40, 0.5))
    assert found.pooled_std**2 == pytest.approx(np.full(40, 0.25 / 40 + 2 * 2 * 0.25 / 40))


def test_equal_values_are_no_exception() -> None:
    found = partial_pooling(np.full(5, 2.0), np.full(5, 0.1))
    assert found.pooled == pytest.approx(np.full(5, 2.0))


def test_pooled_values_are_nearer_to_the_truth_and_their_std_covers_it() -> None:
    random = np.random.default_rng(3)
    own_error, pooled_error, z = 0.0, 0.0, []
    for _ in range(100):
        truth = random.normal(0.0, 0.5, 20)
        values = truth + random.normal(0.0, 1.0, 20)
        found = partial_pooling(values, np.ones(20))
        own_error += np.sum((values - truth) ** 2)
        pooled_error += np.sum((found.pooled - truth) ** 2)
        z += ((found.pooled - truth) / found.pooled_std).tolist()
    assert pooled_error < 0.4 * own_error
    assert 0.92 < np.mean(np.abs(z) < 1.96) < 0.98


@pytest.mark.parametrize("count", [5, 8, 12])
def test_p_values_of_alike_winches_are_valid(count: int) -> None:
    random, std = np.random.default_rng(4), np.full(count, 0.1)
    p = [odd_p_values(random.normal(0, np.hypot(1, 0.1), count), std) for _ in range(200)]
    for level in (0.01, 0.05):
        bound = level + 3 * np.sqrt(level / (200 * count))
        assert np.mean(np.concatenate(p) < level) <= bound


def test_one_winch_is_tested_by_its_externally_studentised_difference() -> None:
    values = np.array([0.3, -1.2, 0.8, 9.0, 0.1, -0.4])
    others = np.delete(values, 3)
    t = (9.0 - others.mean()) / (others.std(ddof=1) * np.sqrt(1 + 1 / 5))
    p = odd_p_values(values, np.full(6, 1e-6))
    assert p[3] == pytest.approx(2 * stats.t.sf(t, 4), rel=1e-4)
    assert np.all(np.delete(p, 3) == 1.0)


def test_of_eight_winches_one_that_is_far_from_the_others_is_found() -> None:
    random, found = np.random.default_rng(6), 0
    for _ in range(20):
        values = random.normal(0.0, 1.0, 8)
        values[5] += 20.0
        found += odd_p_values(values, np.full(8, 0.1))[5] < 0.01 / 40 / 4.3
    assert found >= 18


def test_two_odd_winches_do_not_hide_each_other() -> None:
    random = np.random.default_rng(5)
    values = random.normal(0, 0.1, 20)
    values[[3, 8]] += 3.0
    p = odd_p_values(values, np.full(20, 0.1))
    assert set(np.flatnonzero(p < 1e-4).tolist()) == {3, 8}


def test_of_three_winches_none_is_odd() -> None:
    assert np.all(np.isnan(odd_p_values(np.array([0.0, 0.0, 9.0]), np.ones(3))))

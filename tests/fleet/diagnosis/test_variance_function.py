"""Stated standard deviations that have errors of their own, and ones that are right."""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.fleet.diagnosis.changes import ParameterSeries, Variance, change_of
from winchkit.fleet.diagnosis.variance_function import moderated_stds, power_of_stated

WINCHES, SESSIONS = 60, 24


def fleet(seed: int, true_ratio: float, dof: float) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Values of variance one times a factor that differs from session to session.

    The stated variance has ``dof`` degrees of freedom.
    """
    random = np.random.default_rng(seed)
    values, stated = [], []
    for _ in range(WINCHES):
        true = true_ratio ** random.uniform(-1, 1, SESSIONS)
        values.append(random.normal(size=SESSIONS) * true)
        error = 1.0 if np.isinf(dof) else np.sqrt(random.chisquare(dof, SESSIONS) / dof)
        stated.append(true * error)
    return values, stated


@pytest.mark.parametrize("seed", range(4))
def test_the_power_is_one_where_the_stated_values_are_right(seed: int) -> None:
    assert power_of_stated(*fleet(seed, 3.0, np.inf)) > 0.9


@pytest.mark.parametrize("seed", range(4))
def test_the_power_is_small_where_they_differ_by_their_error_alone(seed: int) -> None:
    assert power_of_stated(*fleet(seed, 1.0, 8.0)) < 0.35


@pytest.mark.parametrize("seed", range(4))
def test_a_step_in_every_winch_does_not_change_the_power(seed: int) -> None:
    values, stated = fleet(seed, 1.0, 8.0)
    stepped = [own + 20.0 * (np.arange(SESSIONS) >= 9) for own in values]
    assert power_of_stated(stepped, stated) == pytest.approx(
        power_of_stated(values, stated), abs=0.1
    )


def test_a_few_sessions_keep_the_stated_values() -> None:
    values, stated = fleet(0, 1.0, 8.0)
    assert power_of_stated([values[0][:4]], [stated[0][:4]]) > 0.7
    assert power_of_stated([], []) == 1.0
    assert power_of_stated([np.zeros(24)], [np.ones(24)]) == 1.0


def test_moderated_values_keep_the_mean_variance() -> None:
    stated = np.array([1.0, 2.0, 0.5, 3.0])
    for power in (0.0, 0.3, 1.0):
        found = moderated_stds(stated, power)
        assert np.mean(found**2) == pytest.approx(np.mean(stated**2), rel=1e-12)
    assert moderated_stds(stated, 1.0) == pytest.approx(stated, rel=1e-12)
    assert np.ptp(moderated_stds(stated, 0.0)) == pytest.approx(0.0, abs=1e-12)


def test_steps_that_are_none_are_as_rare_as_the_level_says() -> None:
    """With the stated values there are 20 times as many as 1 in 1000."""
    plain, moderated = 0, 0
    for seed in range(20):
        values, stated = fleet(seed, 1.0, 8.0)
        power = power_of_stated(values, stated)
        for own, s in zip(values, stated, strict=True):
            times = np.arange(float(SESSIONS))
            for stds, count in ((s, "plain"), (moderated_stds(s, power), "moderated")):
                found = change_of(ParameterSeries(times, own, stds), Variance(0.0, 500.0))
                assert found is not None
                if found.p_value < 1e-3:
                    plain += count == "plain"
                    moderated += count == "moderated"
    assert moderated <= 6  # 1.2 expected of 1200 tests; 6 with probability 2e-3
    assert plain > 15

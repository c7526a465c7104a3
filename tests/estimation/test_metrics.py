"""The paper's two metrics on numbers that one can work out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import UsageError
from winchkit.estimation.metrics import mean_relative_error, overshoot


def test_overshoot_is_the_highest_departure() -> None:
    assert overshoot([90.0, 104.0, 70.0], 100.0) == pytest.approx(0.04)
    assert overshoot([90.0, 95.0], 100.0) == pytest.approx(-0.05)
    assert overshoot([np.nan, 110.0], 100.0) == pytest.approx(0.1)
    assert np.isnan(overshoot([np.nan], 100.0))


def test_relative_error_is_the_mean_of_absolutes() -> None:
    assert mean_relative_error([90.0, 104.0, 100.0], 100.0) == pytest.approx(0.14 / 3)
    assert mean_relative_error([90.0, 220.0], [100.0, 200.0]) == pytest.approx(0.1)
    assert mean_relative_error([90.0, np.nan], 100.0) == pytest.approx(0.1)
    assert np.isnan(mean_relative_error([np.nan], 100.0))


@given(st.lists(st.floats(0.1, 1e4), min_size=1), st.floats(0.1, 1e4), st.floats(0.01, 100))
def test_units_do_not_matter(force: list[float], target: float, unit: float) -> None:
    scaled = [unit * value for value in force]
    one, other = mean_relative_error(force, target), mean_relative_error(scaled, unit * target)
    assert other == pytest.approx(one, rel=1e-9, abs=1e-12)
    assert overshoot(scaled, unit * target) == pytest.approx(overshoot(force, target), abs=1e-9)


def test_a_target_of_nothing_is_refused() -> None:
    with pytest.raises(UsageError, match="above 0"):
        overshoot([1.0], 0.0)
    with pytest.raises(UsageError, match="above 0"):
        mean_relative_error([1.0, 1.0], [1.0, -1.0])

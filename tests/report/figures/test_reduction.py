"""Signals made short for drawing lose no extreme."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.report.figures.reduction import bin_means, decimated, decimated_points, filled_edges


@given(st.integers(1, 5000), st.integers(10, 400), st.integers(0, 2**32 - 1))
def test_every_extreme_stays_and_the_length_is_kept(count: int, points: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=count)
    x = np.arange(count, dtype=float)
    short_x, (short,) = decimated(x, [values], points)
    assert len(short_x) == len(short) <= max(points, 1)
    assert (short.min(), short.max()) == (values.min(), values.max())
    assert np.all(np.diff(short_x) >= 0)
    assert set(short) <= set(values)


def test_a_gap_stays_a_gap() -> None:
    values = np.ones(1000)
    values[400:600] = np.nan
    _, (short,) = decimated(np.arange(1000.0), [values], 100)
    assert np.count_nonzero(np.isnan(short)) == pytest.approx(20, abs=2)


def test_a_single_spike_is_drawn() -> None:
    values = np.zeros(100_000)
    values[54_321] = 7.0
    at, (short,) = decimated(np.arange(100_000.0), [values], 2000)
    assert at[np.argmax(short)] == pytest.approx(54_321, abs=100)
    assert short.max() == 7.0


@given(st.integers(1, 3000), st.integers(1, 300))
def test_dots_are_few_and_sorted(count: int, points: int) -> None:
    x = np.random.default_rng(count).normal(size=count)
    chosen = decimated_points(x, points)
    assert 1 <= len(chosen) <= points
    assert np.all(np.diff(x[chosen]) >= 0)


def test_bins_recover_a_line_through_noise() -> None:
    random = np.random.default_rng(1)
    x = random.uniform(0, 10, 20_000)
    y = 3 * x - 1 + random.normal(size=len(x))
    centres, (means,) = bin_means(x, [y], filled_edges(x, 20))
    assert len(centres) == 20
    assert means == pytest.approx(3 * centres - 1, abs=0.15)


def test_few_values_are_bins_of_their_own() -> None:
    x = np.array([-1.0, 0.0, 1.0, 1.0, -1.0])
    centres, (means,) = bin_means(x, [10 * x + 1], filled_edges(x, 20))
    assert centres.tolist() == [-1.0, 0.0, 1.0]
    assert means.tolist() == [-9.0, 1.0, 11.0]


def test_empty_bins_are_left_out() -> None:
    x = np.array([1.0, 2.0, 355.0])
    centres, _ = bin_means(x, [x], np.linspace(0, 360, 37)[1:-1])
    assert centres == pytest.approx([1.5, 355.0])

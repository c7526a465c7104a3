"""Signals made short for drawing lose no extreme."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.report.figures.reduction import bin_means, decimated, filled_edges


@given(st.integers(1, 5000), st.integers(5, 100), st.integers(0, 2**32 - 1))
def test_every_extreme_stays_and_the_length_is_kept(count: int, intervals: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    series = [random.normal(size=count), random.standard_cauchy(size=count)]
    series[1][random.uniform(size=count) < 0.1] = np.nan
    rows = decimated(series, intervals)
    assert len(rows) <= max(count if count <= 4 * intervals else 0, 4 * intervals + 2)
    assert np.all(np.diff(rows) > 0)
    assert (rows[0], rows[-1]) == (0, count - 1)
    for values in series:
        if np.isfinite(values).any():
            assert np.nanmin(values[rows]) == np.nanmin(values)
            assert np.nanmax(values[rows]) == np.nanmax(values)


@given(st.integers(200, 5000), st.integers(0, 2**32 - 1))
def test_the_extremes_of_every_interval_stay(count: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=count)
    kept = np.isin(np.arange(count), decimated([values], 20))
    for part, there in zip(
        np.split(values, np.linspace(0, count, 21).astype(int)[1:-1]),
        np.split(kept, np.linspace(0, count, 21).astype(int)[1:-1]),
        strict=True,
    ):
        assert {part.min(), part.max()} <= set(part[there])


def test_a_gap_stays_a_gap() -> None:
    values = np.ones(1000)
    values[400:600] = np.nan
    short = values[decimated([values], 50)]
    assert np.count_nonzero(np.isnan(short)) == pytest.approx(10, abs=2)


def test_a_single_spike_is_drawn() -> None:
    values = np.zeros(100_000)
    values[54_321] = 7.0
    rows = decimated([values], 1000)
    assert 54_321 in rows
    assert len(rows) <= 2002


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

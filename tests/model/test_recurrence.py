"""Recurrences against plain loops and an ODE solver."""

from __future__ import annotations

from itertools import pairwise
from math import exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import solve_ivp

from winchkit.model.recurrence import first_order_lag, linear, play

signals = arrays(float, st.integers(0, 70), elements=st.floats(-10, 10))
shares = st.floats(-0.5, 0.5)


@given(st.data(), signals, st.floats(-5, 5))
def test_linear_agrees_with_its_loop(data: st.DataObject, drive: np.ndarray, start: float) -> None:
    decay = data.draw(arrays(float, len(drive), elements=st.floats(-1, 1)))
    before = drive.copy()
    found = linear(decay, drive, start)
    y, expected = start, []
    for a, b in zip(decay.tolist(), drive.tolist(), strict=True):
        y = a * y + b
        expected.append(y)
    assert np.allclose(found, expected, rtol=1e-10, atol=1e-10)
    assert np.array_equal(drive, before)


def test_linear_keeps_what_does_not_decay() -> None:
    """A running sum over many samples, where nothing is forgotten."""
    drive = np.random.default_rng(1).normal(size=5000)
    assert np.allclose(linear(np.ones(5000), drive, 2.0), 2.0 + np.cumsum(drive), atol=1e-10)


@given(signals, st.floats(0, 5), shares)
def test_play_agrees_with_its_loop(x: np.ndarray, gap: float, start: float) -> None:
    before = x.copy()
    found = play(x, gap, start)
    y, expected = 0.0, []
    for k, now in enumerate(x.tolist()):
        y = now + gap * start if k == 0 else min(max(y, now - gap / 2), now + gap / 2)
        expected.append(y)
    assert np.allclose(found, expected, rtol=0, atol=1e-12)
    assert np.array_equal(x, before)


@given(signals, shares)
def test_play_without_a_gap_follows_exactly(x: np.ndarray, start: float) -> None:
    assert np.array_equal(play(x, 0.0, start), x)


@given(signals, st.floats(0.01, 5))
def test_play_stays_within_its_gap_and_stands_inside_it(x: np.ndarray, gap: float) -> None:
    y = play(x, gap)
    assert np.all(np.abs(y - x) <= gap / 2 * (1 + 1e-12))
    moved = np.diff(y) != 0
    at_the_flank = np.abs(np.abs(y - x)[1:] - gap / 2) < 1e-12
    assert np.all(at_the_flank[moved])


def test_lag_follows_its_differential_equation() -> None:
    time = np.sort(np.random.default_rng(2).uniform(0, 4, 120))
    x = np.sin(3 * time) + 0.3 * time

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        return (np.interp(t, time, x) - y) / 0.37

    y = np.array([1.5])
    expected = [1.5]
    for before, after in pairwise(time):
        y = solve_ivp(rate, (before, after), y, rtol=1e-11, atol=1e-12).y[:, -1]
        expected.append(float(y[0]))
    assert np.allclose(first_order_lag(x, time, 0.37, 1.5), expected, atol=1e-9)


def test_lag_of_a_step_is_exponential_and_of_a_ramp_late_by_its_time_constant() -> None:
    time = np.linspace(0, 5, 501)
    step = first_order_lag(np.ones(501), time, 0.5, 0.0)
    assert np.allclose(step, 1 - np.exp(-time / 0.5), atol=1e-12)
    ramp = first_order_lag(2 * time, time, 0.1)
    assert ramp[-1] == pytest.approx(2 * (5 - 0.1), abs=1e-12)


def test_lag_far_shorter_than_a_sample_is_the_signal() -> None:
    x = np.random.default_rng(3).normal(size=50)
    assert np.allclose(first_order_lag(x, np.arange(50.0), 1e-9), x, atol=1e-7)


@given(signals, st.floats(0.001, 100))
def test_lag_stays_within_the_range_of_its_signal(x: np.ndarray, tau: float) -> None:
    y = first_order_lag(x, 0.1 * np.arange(len(x)), tau)
    assert y.shape == x.shape
    if len(x):
        assert y[0] == x[0]
        assert y.min() >= x.min() - 1e-9
        assert y.max() <= x.max() + 1e-9


def test_lag_without_a_time_constant_is_the_signal_itself() -> None:
    x = np.array([1.0, 5.0, -2.0])
    found = first_order_lag(x, np.arange(3.0), 0.0)
    assert np.array_equal(found, x)
    assert found is not x


def test_lag_of_a_single_sample_is_its_start() -> None:
    one = np.array([3.0])
    assert first_order_lag(one, np.zeros(1), 2.0).tolist() == [3.0]
    assert first_order_lag(one, np.zeros(1), 2.0, 0.5).tolist() == [0.5]


def test_lag_forgets_its_start_exponentially() -> None:
    time = np.linspace(0, 3, 31)
    x = np.cos(time)
    apart = first_order_lag(x, time, 0.4, 9.0) - first_order_lag(x, time, 0.4, 1.0)
    assert apart[10] == pytest.approx(8 * exp(-1 / 0.4), rel=1e-12)

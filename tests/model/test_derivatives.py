"""Turning points between samples, against motions in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.model.derivatives import SamplingTimes, lateness, with_turning_points


@given(st.floats(0.02, 0.97), st.floats(0.5, 40.0))
def test_the_top_of_a_parabola_is_found(at: float, bend: float) -> None:
    time = np.arange(9.0)
    moved = 7.0 - bend * (time - 4.0 - at) ** 2
    turned, own = with_turning_points(moved)
    if np.count_nonzero(moved == moved.max()) > 1:
        return  # Two samples are the highest, by rounding too: it turns at neither.
    assert len(turned) == 10
    assert np.max(turned) == pytest.approx(7.0)
    assert np.array_equal(turned[own], moved)
    assert np.all(np.diff(own) >= 1)


def test_a_wave_turns_at_its_crests() -> None:
    time = np.arange(0.0, 10.0, 0.1)
    turned, own = with_turning_points(np.sin(2 * np.pi * time / 0.9))
    added = np.delete(turned, own)
    assert len(added) == pytest.approx(2 * 10.0 / 0.9, abs=1.5)
    assert np.allclose(np.abs(added), 1.0, atol=0.01)
    assert np.max(np.abs(turned[own])) < 0.99995


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_samples_turn_nowhere(count: int) -> None:
    turned, own = with_turning_points(np.arange(float(count)))
    assert np.array_equal(turned[own], np.arange(float(count)))


def test_a_rest_is_no_turn() -> None:
    still = np.array([0.0, 1.0, 2.0, 2.0, 2.0, 1.0])
    turned, _ = with_turning_points(still)
    assert np.array_equal(turned, still)


@given(st.integers(2, 60), st.integers(0, 2**32 - 1))
def test_differences_are_numpys_gradient_on_uneven_samples(count: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    time, x = np.cumsum(random.uniform(0.01, 0.03, count)), random.standard_normal(count)
    assert SamplingTimes(time).differences(x) == pytest.approx(np.gradient(x, time), rel=1e-12)


@pytest.mark.parametrize("delay", [0.0, 4e-3, 0.02])
def test_a_velocity_behind_a_filter_is_late_by_its_time_constant(delay: float) -> None:
    """A low-pass of first order follows a slow sine by its time constant, at whatever stamps."""
    random = np.random.default_rng(4)
    time = np.round(np.arange(0.0, 8.0, 2e-3) + 2e-4 * random.standard_normal(4000), 3)
    time = np.unique(time)
    angle, omega = 40.0 * np.sin(2.0 * time), 2.0
    # Steady state of a first-order low-pass: amplitude 1/√(1 + (ωτ)²), phase −atan(ωτ).
    phase = np.arctan(omega * delay)
    velocity = 80.0 * np.cos(phase) * np.cos(omega * time - phase)
    velocity = velocity + 0.05 * random.standard_normal(len(time))
    late, std = lateness(velocity, angle + 1e-3 * random.standard_normal(len(time)), time)
    assert abs(late - phase / omega) < 4 * std + 0.02 * delay
    times = SamplingTimes(time, angle, velocity)
    assert times.rate[100:-100] == pytest.approx(80.0 * np.cos(omega * time)[100:-100], abs=0.3)

"""The smoothing spline against closed-form motions and a dense solution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.arrays import Array
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.smoothing_spline import Design, SmoothingSpline

RATE = 2 * np.pi / 5


def jittered(seed: int, count: int = 600, step: float = 0.05) -> Array:
    """Times whose steps vary by half, with gaps of half a second every five."""
    random = np.random.default_rng(seed)
    time = np.cumsum(step * random.uniform(0.5, 1.5, count))
    return np.asarray(time[time % 5.0 > 0.5])


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.floats(-2.0, -1.0))
def test_derivatives_of_a_sine_are_as_exact_as_it_says(seed: int, log_noise: float) -> None:
    time, noise = jittered(seed), 10.0**log_noise
    random = np.random.default_rng([seed, 1])
    angle = 20 * np.sin(RATE * time) + noise * random.standard_normal(len(time))
    spline = SmoothingSpline.fit(time, angle)
    truth = {1: 20 * RATE * np.cos(RATE * time), 2: -20 * RATE**2 * np.sin(RATE * time)}
    assert spline.noise == pytest.approx(noise, rel=0.25)
    for order, exact in truth.items():
        error = spline.smoothed(angle, order) - exact
        std = spline.std(order)
        # White jerk is a rougher motion than a sine, so that the claim is on the safe side.
        assert 0.3 < np.sqrt(np.mean((error / std) ** 2)) < 1.3
    differences = np.gradient(np.gradient(angle, time), time)
    assert np.std(spline.smoothed(angle, 2) - truth[2]) < 0.5 * np.std(differences - truth[2])


def test_a_parabola_is_kept_exactly() -> None:
    time = jittered(3)
    moved = 5.0 - 2.0 * time + 0.3 * time**2
    spline = SmoothingSpline.fit(time, np.sin(time) + 0.1 * np.cos(40 * time))
    assert spline.smoothed(moved) == pytest.approx(moved, abs=1e-6)
    assert spline.smoothed(moved, 1) == pytest.approx(0.6 * time - 2.0, abs=1e-6)
    assert spline.smoothed(moved, 2) == pytest.approx(np.full(len(time), 0.6), abs=1e-5)


def test_its_deviations_are_those_of_the_whole_inverse() -> None:
    """Ridge regression on scipy's B-splines, by dense matrices."""
    from scipy.interpolate import BSpline

    time = jittered(4, 60)
    spline = SmoothingSpline.fit(time, np.sin(time) + 0.01 * np.cos(50 * time))
    h, count = spline.design.spacing, int((time[-1] - time[0]) / spline.design.spacing) + 6
    knots = time[0] + h * (np.arange(count + 6) - 5)
    basis = BSpline(knots, np.eye(count), 5)
    bent = np.diff(np.eye(count), 3, axis=0)
    inverse = np.linalg.inv(basis(time).T @ basis(time) + spline.weight * bent.T @ bent)
    for order in (0, 1, 2):
        rows = basis(time, nu=order)
        exact = spline.noise * np.sqrt(np.diag(rows @ inverse @ rows.T))
        assert spline.std(order) == pytest.approx(exact, rel=1e-6)
        smoothed = rows @ inverse @ basis(time).T @ time**3
        assert spline.smoothed(time**3, order) == pytest.approx(smoothed, rel=1e-6, abs=1e-6)


def test_a_rounded_angle_has_at_least_the_noise_of_its_rounding() -> None:
    time = jittered(5)
    step = 0.02
    spline = SmoothingSpline.fit(time, step * np.round(np.sin(RATE * time) / step))
    assert spline.noise >= step / np.sqrt(12) * 0.999
    error = spline.smoothed(step * np.round(np.sin(RATE * time) / step), 1) - RATE * np.cos(
        RATE * time
    )
    assert np.std(error) < 0.03 * RATE


def test_even_samples_keep_their_differences() -> None:
    time = np.arange(200) / 50
    angle = np.sin(time) + 1e-3 * np.cos(20 * time)
    clock = SamplingTimes(time, angle)
    assert clock.spline is None
    assert clock.smoother is None
    assert clock.acceleration_std is None
    assert np.array_equal(clock.rate, np.gradient(angle, time))
    assert np.array_equal(clock.acceleration, np.gradient(np.gradient(angle, time), time))


def test_noise_of_even_samples_does_not_reach_the_acceleration() -> None:
    """By differences it would have 120 times the acceleration of the motion."""
    time = np.arange(5000) / 250
    angle = np.sin(time) + 1e-3 * np.random.default_rng(3).standard_normal(len(time))
    clock = SamplingTimes(time, angle)
    assert clock.spline is None
    inner = slice(250, -250)
    by_differences = np.gradient(np.gradient(angle, time), time)
    assert np.std((by_differences + np.sin(time))[inner]) > 20
    assert np.std((clock.acceleration + np.sin(time))[inner]) < 0.05
    assert np.std((clock.rate - np.cos(time))[inner]) < 0.01
    ripple = 1e-3 * np.sin(30 * time)
    assert np.std((clock.gradient(ripple) - 0.03 * np.cos(30 * time))[inner]) < 1e-4


def test_a_staircase_of_many_samples_a_step_is_no_motion() -> None:
    """Thirty samples a step: the rounding errors of neighbours are alike."""
    time = np.arange(10_000) / 1000
    step = 0.03
    spline = SmoothingSpline.fit(time, step * np.round(np.sin(time) / step))
    inner = slice(1000, -1000)
    angle = step * np.round(np.sin(time) / step)
    assert np.std((spline.smoothed(angle, 1) - np.cos(time))[inner]) < 0.02
    assert np.std((spline.smoothed(angle, 2) + np.sin(time))[inner]) < 0.1
    assert 30 <= spline.reach < 1000
    # A kernel of three knots leaves out the highest frequencies of an acceleration.
    for derivative, accuracy in enumerate((0.03, 0.03, 0.15)):
        middle = float(np.median(spline.std(derivative)))
        assert spline.typical_std(derivative) == pytest.approx(middle, rel=accuracy)


def test_a_polynomial_that_the_penalty_leaves_free_is_exact_whatever_the_weight() -> None:
    """Third differences of a parabola vanish: the smoother returns it and its derivatives."""
    time = np.arange(10_000) / 1000
    staircase = 0.03 * np.round(np.sin(time) / 0.03)
    spline = SmoothingSpline.fit(time, staircase)
    parabola = 1 + 2 * time - 3 * time**2
    for derivative, exact in enumerate((parabola, 2 - 6 * time, np.full_like(time, -6.0))):
        assert spline.smoothed(parabola, derivative) == pytest.approx(exact, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("weight", [1e5, 1e7, 1e9, 2.6e10])
def test_large_weights_leave_the_derivatives_of_a_parabola(weight: float) -> None:
    """Their equations have a condition of 64 times the weight, 2·10¹² for the last one."""
    time = np.arange(100) * 0.02
    spline = SmoothingSpline(Design(time, 0.02), weight, 1e-6)
    assert spline.smoothed(0.1 * time, 1) == pytest.approx(np.full(100, 0.1), abs=1e-7)
    assert spline.smoothed(0.05 * time**2, 2) == pytest.approx(np.full(100, 0.1), abs=1e-6)


@pytest.mark.parametrize("weight", [1.0, 1e4, 1e6, 1e8])
def test_a_noisy_signal_is_smoothed_as_by_a_dense_least_squares_solution(weight: float) -> None:
    time = jittered(8, count=200)
    design = Design(time, 0.05)
    signal = np.sin(time) + 0.3 * np.random.default_rng(9).standard_normal(len(time))
    basis = design.matrix(0).toarray()
    penalty = np.sqrt(weight) * np.diff(np.eye(design.count), 3, axis=0)
    rows, right = np.vstack([basis, penalty]), np.concatenate([signal, np.zeros(len(penalty))])
    expected = np.linalg.lstsq(rows, right, rcond=None)[0]
    spline = SmoothingSpline(design, weight, 0.3)
    for derivative in range(3):
        exact = design.matrix(derivative) @ expected
        size = float(np.max(np.abs(exact)))
        assert spline.smoothed(signal, derivative) == pytest.approx(exact, abs=1e-6 * size)


@pytest.mark.parametrize("weight", [1e-8, 1e-2, 1.0, 1e2, 1e4])
def test_beyond_its_support_a_sample_changes_the_second_derivative_by_two_percent(
    weight: float,
) -> None:
    time = np.arange(401.0)
    spline = SmoothingSpline(Design(time, 1.0), weight, 1.0)
    kernel = np.abs(spline.smoothed((time == 200.0).astype(float), 2))
    acting = np.flatnonzero(kernel > 0.02 * kernel.max())
    width = int(acting[-1]) - 200
    assert 0.75 * spline.support - 1 <= width <= 1.25 * spline.support


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_the_typical_uncertainty_is_that_of_the_recursion_far_from_the_ends(
    derivative: int,
) -> None:
    time = np.arange(2000) / 100
    noise = 1e-2 * np.random.default_rng(4).standard_normal(len(time))
    spline = SmoothingSpline.fit(time, np.sin(0.3 * time) + noise)
    assert spline.reach > 10
    middle = float(np.median(spline.std(derivative)))
    assert spline.typical_std(derivative) == pytest.approx(middle, rel=0.03)


def test_a_reported_velocity_takes_the_place_of_the_angle() -> None:
    random, time = np.random.default_rng(6), jittered(6)
    angle = np.sin(RATE * time) + 3e-3 * random.standard_normal(len(time))
    velocity = RATE * np.cos(RATE * time) + 1e-4 * random.standard_normal(len(time))
    clock = SamplingTimes(time, angle, velocity)
    assert clock.measured_rate is velocity
    exact = -(RATE**2) * np.sin(RATE * time)
    assert np.std(clock.acceleration - exact) < 0.2 * np.std(
        SamplingTimes(time, angle).acceleration - exact
    )


@pytest.mark.parametrize("gap", [5.0, 40.0, 400.0])
def test_a_long_gap_leaves_the_derivatives_on_both_sides(gap: float) -> None:
    """500 to 60,000 knots without a sample, where the penalty alone has no factor."""
    random = np.random.default_rng(3)
    even = np.sort(random.uniform(0, 15, 1500))
    time = np.where(even > 7, even + gap, even)
    noise = 1e-4 * random.standard_normal(1500)
    spline = SmoothingSpline.fit(time, 3 * np.sin(1.3 * time) + noise)
    assert spline.noise == pytest.approx(1e-4, rel=0.03)
    without = SmoothingSpline.fit(even, 3 * np.sin(1.3 * even) + noise)
    assert spline.weight == pytest.approx(without.weight, rel=0.2)
    velocity = spline.smoothed(3 * np.sin(1.3 * time) + noise, 1)
    error = velocity - 3.9 * np.cos(1.3 * time)
    far = np.minimum(np.abs(time - 7), np.abs(time - 7 - gap)) > 0.1
    # As without the gap: 1.1e-3; at its edges there are samples on one side only.
    assert np.sqrt(np.mean(error[far] ** 2)) < 1.7e-3
    assert np.max(np.abs(error[~far])) < 0.12
    # A sine is smoother than white jerk, so that the claim is on the safe side.
    assert 0.3 < np.sqrt(np.mean((error / spline.std(1)) ** 2)) < 1.3


@pytest.mark.parametrize("weight", [1e-2, 1e3, 1e8])
def test_both_sides_of_a_long_gap_are_smoothed_as_runs_of_their_own(weight: float) -> None:
    early, late = jittered(3, count=300), 100.0 + jittered(4, count=200)
    count = len(early)
    signal = np.random.default_rng(5).standard_normal(count + len(late))
    both = SmoothingSpline(Design(np.concatenate([early, late]), 0.05), weight, 1.0)
    first, second = (SmoothingSpline(Design(time, 0.05), weight, 1.0) for time in (early, late))
    for derivative in range(3):
        alone = [
            first.smoothed(signal[:count], derivative),
            second.smoothed(signal[count:], derivative),
        ]
        size = max(float(np.max(np.abs(each))) for each in alone)
        found = both.smoothed(signal, derivative)
        assert found == pytest.approx(np.concatenate(alone), abs=1e-7 * size)
        stds = np.concatenate([first.std(derivative), second.std(derivative)])
        assert both.std(derivative) == pytest.approx(stds, rel=1e-5)


@pytest.mark.parametrize("samples", [1, 2, 3, 7])
def test_few_samples_between_long_gaps_change_nothing_beside_them(samples: int) -> None:
    """The acceleration there is less certain than within a run, as at an end."""
    run = jittered(7, count=600)
    few = 100.0 + 0.05 * np.arange(samples)
    time = np.concatenate([run[:300], few, 200.0 + run[300:]])
    signal = np.sin(time) + 1e-3 * np.random.default_rng(8).standard_normal(len(time))
    there = slice(300, 300 + samples)
    spline = SmoothingSpline.fit(time, signal)
    kept = np.delete(np.arange(len(time)), there)
    without = SmoothingSpline.fit(time[kept], signal[kept])
    assert spline.weight == pytest.approx(without.weight, rel=0.1)
    assert spline.noise == pytest.approx(without.noise, rel=0.02)
    found, exact = spline.smoothed(signal, 2)[kept], without.smoothed(signal[kept], 2)
    assert np.std(found - exact) < 0.05 * np.std(exact)
    assert np.all(np.isfinite(spline.smoothed(signal, 2)))
    assert np.min(spline.std(2)[there]) > 1.5 * np.median(spline.std(2)[kept])

"""Orders of periodic residuals, against plain least squares."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, length_problem
from winchkit.arrays import Array
from winchkit.diagnosis.data.harmonics import half_of_samples_per_turn, strongest_harmonic
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.residuals.attribution import harmonics

RIDE = Ride(samples=3000, rate=100.0)


def share(angle: Array, error: Array) -> float:
    """Of the error's power in a sine and a cosine, fitted."""
    columns = np.column_stack([np.cos(angle), np.sin(angle)])
    fitted = columns @ np.linalg.lstsq(columns, error, rcond=None)[0]
    return float(fitted @ fitted / (error @ error))


LIMIT = half_of_samples_per_turn([RIDE.angle / GROOVED.gearbox.ratio])


@pytest.mark.parametrize("order", [1, 5, 39, LIMIT - 7])
def test_the_order_and_its_share(order: int) -> None:
    random = np.random.default_rng(order)
    drum = RIDE.angle / GROOVED.gearbox.ratio
    error = 1e-3 * np.sin(order * drum + 0.7) + 5e-4 * random.standard_normal(RIDE.samples)
    regression = length_problem([error], RIDE)
    residual = regression.residual(Hypothesis())
    (shown,) = regression.in_time(residual)
    found = {f.variable: f for f in harmonics(regression, residual)}
    shares = [share(k * drum, shown) for k in range(1, LIMIT + 1)]
    assert found["drum_angle"].order == 1 + int(np.argmax(shares)) == order
    assert found["drum_angle"].share == pytest.approx(max(shares), rel=1e-6)
    # The sine has twice the power of the noise.
    assert found["drum_angle"].share == pytest.approx(2 / 3, abs=0.06)


def test_an_angle_that_hardly_moves_has_no_orders() -> None:
    random = np.random.default_rng(0)
    ride = Ride(samples=3000, rate=100.0, stroke=0.02)
    regression = length_problem([1e-3 * random.standard_normal(3000)], ride)
    assert harmonics(regression, regression.residual(Hypothesis())) == []


def test_half_of_the_samples_of_the_slowest_turn() -> None:
    """Two runs, one of them twice as fast: 25 samples per turn resolve 12 orders."""
    slow, fast = np.arange(200) * (2 * np.pi / 25), np.arange(200) * (2 * np.pi / 12)
    assert half_of_samples_per_turn([slow, fast]) == 12
    assert half_of_samples_per_turn([np.zeros(50)]) == 0
    assert half_of_samples_per_turn([]) == 0


def test_noise_has_an_order_in_one_of_a_hundred_cases() -> None:
    """The largest share of all orders over both angles, of 200 noises."""
    random = np.random.default_rng(3)
    short = Ride(samples=400, rate=100.0)
    found = 0
    for _ in range(200):
        regression = length_problem([1e-3 * random.standard_normal(400)], short)
        found += bool(harmonics(regression, regression.residual(Hypothesis())))
    assert found <= 10, "0.02 is expected, 0.05 has a probability below 0.01"


@pytest.mark.parametrize("turns", [0.7, 1.5, 1.9, 3.2])
def test_fewer_than_two_whole_periods_are_none(turns: float) -> None:
    """A cubic bend over the motion resembles a sine of one period; an order of three has three."""
    angle = np.linspace(0.0, 2 * np.pi * turns, 2000)
    across = np.linspace(-1.0, 1.0, 2000)
    found = strongest_harmonic(angle, across**3 - 0.6 * across, 40)
    assert found is None or found[0] * turns >= 1.99
    third = strongest_harmonic(angle, np.sin(3 * angle), 40)
    assert third is not None
    assert third[0] == 3

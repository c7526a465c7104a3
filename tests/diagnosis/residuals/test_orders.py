"""Orders of periodic residuals, against plain least squares."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, length_problem
from winchkit.arrays import Array
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.residuals.attribution import harmonics

RIDE = Ride(samples=3000, rate=100.0)


def share(angle: Array, error: Array) -> float:
    """Of the error's power in a sine and a cosine, fitted."""
    columns = np.column_stack([np.cos(angle), np.sin(angle)])
    fitted = columns @ np.linalg.lstsq(columns, error, rcond=None)[0]
    return float(fitted @ fitted / (error @ error))


@pytest.mark.parametrize("order", [1, 5, 39])
def test_the_order_and_its_share(order: int) -> None:
    random = np.random.default_rng(order)
    drum = RIDE.angle / GROOVED.gearbox.ratio
    error = 1e-3 * np.sin(order * drum + 0.7) + 5e-4 * random.standard_normal(RIDE.samples)
    regression = length_problem([error], RIDE)
    residual = regression.residual(Hypothesis())
    (shown,) = regression.in_time(residual)
    found = {f.variable: f for f in harmonics(regression, residual)}
    shares = [share(k * drum, shown) for k in range(1, 41)]
    assert found["drum_angle"].order == 1 + int(np.argmax(shares)) == order
    assert found["drum_angle"].share == pytest.approx(max(shares), rel=1e-6)
    # The sine has twice the power of the noise.
    assert found["drum_angle"].share == pytest.approx(2 / 3, abs=0.06)


def test_an_angle_that_hardly_moves_has_no_orders() -> None:
    random = np.random.default_rng(0)
    ride = Ride(samples=3000, rate=100.0, stroke=0.02)
    regression = length_problem([1e-3 * random.standard_normal(3000)], ride)
    assert harmonics(regression, regression.residual(Hypothesis())) == []

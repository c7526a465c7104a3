"""The load on its cable against an ODE solver, free fall and statics."""

from math import cos, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from plant_benches import GRAVITY
from winchkit.sim.plant.hanging_load import _DAMPING_RATIO, HangingLoad

MASS, COMPLIANCE = 20.0, 2.5e-5


def swinging(end_of: object, speed_of: object, duration: float) -> tuple[float, float]:
    """Position and speed from scipy, for a cable end that moves."""
    damping = 2 * _DAMPING_RATIO * sqrt(MASS / COMPLIANCE)

    def rates(t: float, y: np.ndarray) -> list[float]:
        tension = (y[0] - end_of(t)) / COMPLIANCE + damping * (y[1] - speed_of(t))
        return [y[1], GRAVITY - tension / MASS]

    start = [end_of(0.0) + COMPLIANCE * MASS * GRAVITY, 0.0]
    found = solve_ivp(rates, (0, duration), start, rtol=1e-9, atol=1e-12)
    return float(found.y[0, -1]), float(found.y[1, -1])


@pytest.mark.parametrize("duration", [0.03, 0.1, 0.35])
def test_swings_as_a_damped_spring(duration: float) -> None:
    def end_of(t: float) -> float:
        return 3.0 - 0.01 * (1 - cos(20 * t))

    def speed_of(t: float) -> float:
        return -0.2 * np.sin(20 * t)

    load = HangingLoad(MASS, 0.0)
    load.rest(3.0, COMPLIANCE)
    count = round(duration / 1e-3)
    for step in range(1, count + 1):
        load.step(end_of(step * 1e-3), speed_of(step * 1e-3), COMPLIANCE, 1e-3)
    position, speed = swinging(end_of, speed_of, duration)
    assert load.position == pytest.approx(position, abs=2e-6)
    assert load.speed == pytest.approx(speed, abs=2e-4)


@given(st.floats(1e-13, 1e-2), st.floats(0.5, 200.0), st.floats(1e-4, 1e-3))
def test_hangs_still_however_stiff(compliance: float, mass: float, dt: float) -> None:
    load = HangingLoad(mass, 0.0)
    load.rest(2.0, compliance)
    for _ in range(50):
        load.step(2.0, 0.0, compliance, dt)
    assert load.tension == pytest.approx(mass * GRAVITY, rel=1e-6)
    assert load.position == pytest.approx(2.0 + compliance * mass * GRAVITY, rel=1e-9)


@given(st.floats(1e-13, 1e-3), st.floats(-0.5, 0.5))
def test_a_cable_under_impact_stays_stable(compliance: float, speed: float) -> None:
    load = HangingLoad(MASS, 0.0)
    load.rest(2.0, compliance)
    end = 2.0
    for step in range(400):
        now = speed if step < 200 else 0.0
        end += now * 1e-3
        load.step(end, now, compliance, 1e-3)
        assert load.tension >= 0.0
    swing = abs(speed) * sqrt(MASS * compliance)
    assert abs(load.position - end - compliance * MASS * GRAVITY) <= 2.5 * swing + 1e-3


def test_a_slack_cable_lets_the_load_fall() -> None:
    load = HangingLoad(MASS, 0.0)
    load.rest(2.0, COMPLIANCE)
    start = load.position
    for step in range(1, 101):
        load.step(2.0 + 5.0 * step * 1e-3, 5.0, COMPLIANCE, 1e-3)
    assert load.tension == 0.0
    assert load.speed == pytest.approx(GRAVITY * 0.1, rel=0.02)
    assert load.position - start == pytest.approx(GRAVITY * 0.1**2 / 2, rel=0.04)
